"""The messages in chunks of MCAP files, or outside of any."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from struct import Struct
from typing import Any, TypeAlias

import numpy as np

from idlc.recordings.containers import records
from idlc.recordings.containers.compression import (
    ZSTD_MAGIC,
    DecompressionBudget,
    decompress,
    zstd_frame,
)
from idlc.recordings.containers.messages import (
    Ranges,
    Raw,
    Separate,
    TopicMessages,
    Window,
    times_of,
)
from idlc.recordings.containers.records import HEAD, INDEX_OFFSET, Chunk, ChunkHead
from idlc.recordings.containers.source import DamageError, FileSource, of_file
from idlc.recordings.damage import DamageList

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
    source: FileSource,
    chunks: Iterable[Chunk],
    channels: Collection[int],
    window: Window,
    check: bool | None,
    damage: DamageList,
) -> Iterator[TopicMessages]:
    """Yield the messages of some channels in chunks, adjacent chunks together.

    Chunks and messages that cannot be read are added to the damage.
    """
    with of_file(source.name):
        reader = _Reader(source, channels, check, damage)
        groups = records.grouped(reader.heads(chunks), lambda pair: pair[1].size, records.GROUP)
        while True:
            with source.opened():  # closed while the caller uses the messages
                group = next(groups, None)
                if group is None:
                    return
                parts = [ranges.within(window) for ranges in reader.read(group)]
            for ranges in parts:
                messages = reader.decompressed(ranges)
                if len(messages):
                    yield messages


class _Reader:
    """Reads the messages of some channels from chunks."""

    def __init__(
        self, source: FileSource, channels: Collection[int], check: bool | None, damage: DamageList
    ) -> None:
        self.source = source
        self.channels = channels
        self.check = check
        self.damage = damage
        self.room = DecompressionBudget(source.size)

    def heads(self, chunks: Iterable[Chunk]) -> Iterator[Headed]:
        """Yield each chunk with its head, if there is room for its records."""
        for chunk in chunks:
            try:
                yield chunk, self._head(chunk)
            except DamageError as error:
                self._add(chunk, error)

    def _head(self, chunk: Chunk) -> ChunkHead:
        if chunk.compression is None:
            return ChunkHead(0, 0, chunk.size, 0, "", chunk.at, chunk.size)
        start = self.source.view(chunk.at, HEAD.size)
        head = records.read_chunk_head(self.source, chunk.at, chunk.size)
        try:
            if HEAD.unpack(start) != (records.CHUNK_OP, chunk.size - HEAD.size):
                what = f"there is no chunk at byte {chunk.at}, although an index lists one"
                raise DamageError(what)
            if head.compression:
                self.room.reserve(head.size)
            elif head.size != head.stored:
                raise DamageError("a chunk that is not compressed declares another size")
        except DamageError:
            proven = records.proven_head(self.source, head)
            if proven is None or self.damage.is_strict:
                raise
            head = proven
        return head

    def _add(self, chunk: Chunk, error: DamageError, messages: int | None = None) -> None:
        """Add a chunk to the damage, with what an index says of it."""
        times = (None, None) if chunk.compression is None else (chunk.first, chunk.last)
        stop = chunk.at + chunk.size
        self.damage.add(error.message, chunk.at, stop, messages=messages, times=times)

    def read(self, group: list[Headed]) -> list[Ranges]:
        """Return the messages in adjacent chunks, each by itself if one of them is damaged."""
        self.damage.is_unproven |= not all(head.crc for _, head in group)
        if not self.damage:
            with suppress(DamageError):
                return [self._read(group, self.check is True)]
        return [ranges for pair in group for ranges in self._salvaged(*pair)]

    def _read(self, group: list[Headed], check: bool, partial: bool = False) -> Ranges:
        return _read(self.source, group, self.channels, self.room, check, partial)

    def _salvaged(self, chunk: Chunk, head: ChunkHead) -> Iterator[Ranges]:
        """Yield the messages of a chunk by its index, or without it.

        Without a checksum, the messages before the damage are as good as any.
        """
        check = self.check is not False
        problem: DamageError | None = None
        bare = chunk._replace(indexes=None)
        proven = records.proven_head(self.source, head) if head.compression else None
        for own, own_head in dict.fromkeys([(chunk, head), (bare, head), (bare, proven or head)]):
            try:
                ranges = self._read([(own, own_head)], check)
            except DamageError as error:
                problem = error
            else:
                if problem and self.damage.is_strict:
                    self._add(chunk, problem)
                yield ranges
                return
        assert problem is not None
        self._add(chunk, problem)
        if not (check and head.crc):
            with suppress(DamageError):
                yield self._read([(chunk._replace(indexes=None), head)], False, partial=True)

    def decompressed(self, ranges: Ranges) -> TopicMessages:
        """Return messages that may be compressed by themselves."""
        array = np.frombuffer(ranges.buffer, np.uint8)
        filled = ranges.starts[ranges.stops > ranges.starts]
        # no message that is not compressed begins like a zstd frame
        if not (array[filled] == ZSTD_MAGIC[0]).any():
            return ranges
        raws: list[Raw] = []
        whole = np.ones(len(ranges), np.bool_)
        for index, raw in enumerate(ranges.views()):
            try:
                raws.append(zstd_frame(raw, self.room) if raw[:4] == ZSTD_MAGIC else raw)
            except DamageError as error:
                time = int(ranges.log_times[index])
                self.damage.add(error.message, messages=1, times=(time, time))
                whole[index] = False
        publish = ranges.publish_times
        publish = None if publish is None else publish[whole]
        return Separate(ranges.log_times[whole], publish, raws)


def _read(
    source: FileSource,
    group: list[Headed],
    channels: Collection[int],
    room: DecompressionBudget,
    check: bool,
    partial: bool,
) -> Ranges:
    """Return the messages of some channels in adjacent chunks; with `partial`, those before damage.

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
            raise DamageError(f"the checksum of the chunk at byte {chunk.at} is wrong")
        if places is None:
            places = np.array(_walked(target, chunk, channels, room, partial), np.int64)
        starts.append(places + at)
        at += head.size
        ends.append(np.full(len(places), at))
    return _messages(buffer, np.concatenate(starts), np.concatenate(ends), channels)


def _read_some(source: FileSource, start: int, target: memoryview, places: Any) -> None:
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


def _indexed(source: FileSource, chunk: Chunk, size: int, channels: Collection[int]) -> Any:
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
        raise DamageError("an index of messages leaves its chunk")
    places = places.astype(np.int64)
    if (places[1:] <= places[:-1]).any():
        places.sort()
    return places


def indexed_messages(
    source: FileSource, chunk: Chunk, data: memoryview, channels: Iterable[int]
) -> Iterator[tuple[int, int]]:
    """Yield where in a chunk messages begin and end, for each channel whose index is sound."""
    for channel in channels:
        with suppress(DamageError):
            places = _indexed(source, chunk, len(data), [channel])
            if places is not None:
                ends = np.full(len(places), len(data))
                ranges = _messages(data, places, ends, [channel])
                starts = ranges.starts - MESSAGE.itemsize
                yield from zip(starts.tolist(), ranges.stops.tolist(), strict=True)


def _walked(
    view: memoryview,
    chunk: Chunk,
    channels: Collection[int],
    room: DecompressionBudget,
    partial: bool,
) -> list[int]:
    """Return where in a chunk messages begin, by a walk from record to record."""
    unpack, ahead, stop = MESSAGE_HEAD.unpack_from, MESSAGE_HEAD.size, len(view)
    places: list[int] = []
    at = 0
    for _ in room.records():
        if at + ahead > stop:
            break
        op, size, channel = unpack(view, at)
        if partial and (not op or size < records.LEAST.get(op, 0) or size > stop - at - HEAD.size):
            return places
        if op == records.MESSAGE_OP and channel in channels:
            places.append(at)
        at += HEAD.size + size
    is_whole = at == stop or (at < stop and at + HEAD.size + view[at + 1] == stop)
    if not (is_whole or partial):
        raise DamageError(f"records of the chunk at byte {chunk.at} are cut off")
    return places


def _messages(buffer: memoryview, at: Any, ends: Any, channels: Collection[int]) -> Ranges:
    """Return the messages that begin at some places; raise DamageError for others.

    `ends` has with each of them the end of its chunk.
    """
    array: Any = np.frombuffer(buffer, np.uint8)
    if (at + MESSAGE.itemsize > ends).any():
        raise DamageError("a message is cut off")
    every = max(0, len(array) - MESSAGE.itemsize + 1)
    heads: Any = np.ndarray((every,), MESSAGE, array, strides=(1,))[at]
    of_channels = np.isin(heads["channel"], np.array(list(channels), np.uint16))
    if not ((heads["op"] == records.MESSAGE_OP) & of_channels).all():
        raise DamageError("an index names a place where there is no message of its channel")
    room = (ends - at - HEAD.size).astype(np.uint64)
    if ((heads["size"] < LEAST) | (heads["size"] > room)).any():
        raise DamageError("a message is cut off")
    stops = at + HEAD.size + heads["size"].astype(np.int64)
    if (stops[:-1] > at[1:]).any():
        raise DamageError("an index names messages that overlap")
    log, publish = times_of(heads["log"]), times_of(heads["publish"])
    return Ranges(log, publish, buffer, at + MESSAGE.itemsize, stops)
