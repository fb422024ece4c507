"""The messages in chunks of MCAP files, or outside of any."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterable, Iterator
from struct import Struct
from typing import Any, TypeAlias

import numpy as np

from idlc.recordings.containers import records
from idlc.recordings.containers.compression import ZSTD_MAGIC, Room, decompress, zstd_frame
from idlc.recordings.containers.messages import Messages, Ranges, Separate, Window, times_of
from idlc.recordings.containers.records import HEAD, INDEX_OFFSET, Chunk, ChunkHead
from idlc.recordings.containers.source import RecordingError, Source, of_file

#: The head of a message's record.
MESSAGE = np.dtype(
    [
        ("op", "u1"),
        ("size", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log", "<u8"),
        ("publish", "<u8"),
    ]
)
MESSAGE_HEAD = Struct("<BQH")
LEAST = MESSAGE.itemsize - HEAD.size
#: In uncompressed chunks, gaps between messages are read too if they are smaller.
NEAR = 1 << 15
#: A chunk and what its head says.
Headed: TypeAlias = tuple[Chunk, ChunkHead]


def in_chunks(
    source: Source, chunks: Iterable[Chunk], channels: Collection[int], window: Window, check: bool
) -> Iterator[Messages]:
    """Yield the messages of some channels in chunks, adjacent chunks together."""
    with of_file(source.name):
        room = Room(source.size)
        heads = _heads(source, chunks, room)
        groups = records.grouped(heads, lambda pair: pair[1].size, records.GROUP)
        while True:
            with source.opened():  # closed while the caller uses the messages
                group = next(groups, None)
                if group is None:
                    return
                ranges = _read(source, group, channels, room, check).within(window)
            array = np.frombuffer(ranges.buffer, np.uint8)
            filled = ranges.starts[ranges.stops > ranges.starts]
            # a message may be compressed by itself: no other begins like a zstd frame
            if (array[filled] == ZSTD_MAGIC[0]).any():
                raws = [
                    zstd_frame(raw, room) if raw[:4] == ZSTD_MAGIC else raw
                    for raw in ranges.views()
                ]
                yield Separate(ranges.log_times, ranges.publish_times, raws)
            elif len(ranges):
                yield ranges


def _heads(source: Source, chunks: Iterable[Chunk], room: Room) -> Iterator[Headed]:
    """Yield each chunk with its head, if there is room for its records."""
    for chunk in chunks:
        if chunk.compression is None:
            yield chunk, ChunkHead(0, 0, chunk.size, 0, "", chunk.at, chunk.size)
            continue
        start = source.view(chunk.at, HEAD.size)
        if HEAD.unpack(start) != (records.CHUNK_OP, chunk.size - HEAD.size):
            raise RecordingError(
                f"there is no chunk at byte {chunk.at}, although an index lists one"
            )
        head = records.read_chunk_head(source, chunk.at, chunk.size)
        if head.compression:
            room.reserve(head.size)
        elif head.size != head.stored:
            raise RecordingError("a chunk that is not compressed declares another size")
        yield chunk, head


def _read(
    source: Source, group: list[Headed], channels: Collection[int], room: Room, check: bool
) -> Ranges:
    """Return the messages of some channels in adjacent chunks.

    Of a chunk without compression only these are read, if it has an index.
    """
    buffer = np.empty(sum(head.size for _, head in group), np.uint8).data
    starts, ends, at = [], [], 0
    for chunk, head in group:
        target = buffer[at : at + head.size]
        places = _indexed(source, chunk, head.size, channels)
        whole = places is None or (check and head.crc != 0) or not source.is_local
        if head.compression:
            decompress(source.view(head.start, head.stored), head.compression, target)
        elif whole:
            source.read(head.start, target)
        else:
            _read_some(source, head.start, target, places)
        if check and head.crc and zlib.crc32(target) != head.crc:
            raise RecordingError(f"the checksum of the chunk at byte {chunk.at} is wrong")
        if places is None:
            places = np.array(_walked(target, chunk, channels, room), np.int64)
        starts.append(places + at)
        at += head.size
        ends.append(np.full(len(places), at))
    return _messages(buffer, np.concatenate(starts), np.concatenate(ends), channels)


def _read_some(source: Source, start: int, target: memoryview, places: Any) -> None:
    """Read messages of a chunk that begins at `start`, adjacent ones together."""
    for near in np.split(places, np.flatnonzero(np.diff(places) > NEAR) + 1):
        if not len(near):
            return
        first, last = int(near[0]), int(near[-1])
        stop = min(last + NEAR, len(target))
        source.read(start + first, target[first:stop])
        _, size = HEAD.unpack_from(target, last)
        end = min(last + HEAD.size + size, len(target))
        if end > stop:
            source.read(start + stop, target[stop:end])


def _indexed(source: Source, chunk: Chunk, size: int, channels: Collection[int]) -> Any:
    """Return where in a chunk messages of some channels begin; None without an index."""
    if chunk.indexes is None:
        return None
    parts: list[Any] = [np.zeros(0, "<u8")]
    for channel, at in INDEX_OFFSET.iter_unpack(chunk.indexes):
        if channel in channels:
            entries = source.view(at + HEAD.size + 6, records.index_entries(source, channel, at))
            parts.append(np.frombuffer(entries, "<u8")[1::2])
    places = np.concatenate(parts)
    last = size - MESSAGE.itemsize
    if len(places) and (last < 0 or int(places.max()) > last):
        raise RecordingError("an index of messages leaves its chunk")
    places = places.astype(np.int64)
    if (places[1:] <= places[:-1]).any():
        places.sort()
    return places


def _walked(view: memoryview, chunk: Chunk, channels: Collection[int], room: Room) -> list[int]:
    """Return where in a chunk messages begin, by a walk from record to record."""
    unpack, ahead, stop = MESSAGE_HEAD.unpack_from, MESSAGE_HEAD.size, len(view)
    places, at = [], 0
    for _ in room.records():
        if at + ahead > stop:
            break
        op, size, channel = unpack(view, at)
        if op == records.MESSAGE_OP and channel in channels:
            places.append(at)
        at += HEAD.size + size
    if at != stop and not (at < stop and at + HEAD.size + view[at + 1] == stop):
        raise RecordingError(f"records of the chunk at byte {chunk.at} are cut off")
    return places


def _messages(buffer: memoryview, at: Any, ends: Any, channels: Collection[int]) -> Ranges:
    """Return the messages that begin at some places; raise RecordingError for others.

    `ends` has with each of them the end of its chunk.
    """
    array: Any = np.frombuffer(buffer, np.uint8)
    if (at + MESSAGE.itemsize > ends).any():
        raise RecordingError("a message is cut off")
    every = max(0, len(array) - MESSAGE.itemsize + 1)
    heads: Any = np.ndarray((every,), MESSAGE, array, strides=(1,))[at]
    of_channels = np.isin(heads["channel"], np.array(list(channels), np.uint16))
    if not ((heads["op"] == records.MESSAGE_OP) & of_channels).all():
        raise RecordingError("an index names a place where there is no message of its channel")
    room = (ends - at - HEAD.size).astype(np.uint64)
    if ((heads["size"] < LEAST) | (heads["size"] > room)).any():
        raise RecordingError("a message is cut off")
    stops = at + HEAD.size + heads["size"].astype(np.int64)
    if (stops[:-1] > at[1:]).any():
        raise RecordingError("an index names messages that overlap")
    log, publish = times_of(heads["log"], "log time"), times_of(heads["publish"], "publish time")
    return Ranges(log, publish, buffer, at + MESSAGE.itemsize, stops)
