"""Messages as they are recorded, bytes and times, and how they are read from chunks of MCAP."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterable, Iterator, Sequence
from struct import Struct
from typing import Any, NamedTuple, TypeAlias

import msgspec
import numpy as np

from idlc.recordings.containers import mcap
from idlc.recordings.containers.compression import ZSTD_MAGIC, Room, decompress, zstd_frame
from idlc.recordings.containers.mcap import HEAD, INDEX_OFFSET, Chunk, ChunkHead
from idlc.recordings.containers.source import RecordingError, Source, of_file

#: Times of numpy and Arrow end here, in the year 2262.
END_OF_TIME = 1 << 63

#: From this mean size on, messages are not copied to be one buffer.
LARGE = 1 << 15

Raw: TypeAlias = bytes | memoryview


class Window(NamedTuple):
    """A range of times in nanoseconds; the end is not included."""

    start: int | None = None
    end: int | None = None

    def overlaps(self, first: int, last: int) -> bool:
        """Return whether messages of these times, the last included, may be in it."""
        before = self.end is not None and first >= self.end
        return not before and (self.start is None or last >= self.start)

    def narrowed(self, start: int | None, end: int | None) -> Window:
        """Return the intersection of this and another window."""
        starts = [time for time in (self.start, start) if time is not None]
        ends = [time for time in (self.end, end) if time is not None]
        return Window(max(starts, default=None), min(ends, default=None))

    def holds(self, times: Any) -> Any:
        """Return a mask of the times that are in it, or None if all are."""
        if self.start is None and self.end is None:
            return None
        # numpy compares numbers of 64 bits, and limits may have more
        inside = np.full(len(times), self.start is None or self.start < END_OF_TIME)
        if self.start is not None and 0 < self.start < END_OF_TIME:
            inside &= times >= self.start
        if self.end is not None and self.end < END_OF_TIME:
            inside &= times < max(self.end, 0)
        return inside


#: The window that leaves nothing out.
ALWAYS = Window()


class Messages(msgspec.Struct, frozen=True, eq=False):
    """Messages of one topic, in the order in which they were recorded, for `to_columns` to read.

    Times are int64, in nanoseconds; `publish_times` is None where a recording has none.
    """

    log_times: Any
    publish_times: Any | None

    def __len__(self) -> int:
        return len(self.log_times)

    def views(self) -> list[Raw]:
        """Return the bytes of each message."""
        raise NotImplementedError


class Ranges(Messages, frozen=True, eq=False):
    """Messages that are each a part of one buffer."""

    buffer: Any
    starts: Any
    stops: Any

    def within(self, window: Window) -> Ranges:
        """Return the messages in a window."""
        inside = window.holds(self.log_times)
        if inside is None or inside.all():
            return self
        publish = None if self.publish_times is None else self.publish_times[inside]
        starts, stops = self.starts[inside], self.stops[inside]
        return Ranges(self.log_times[inside], publish, self.buffer, starts, stops)

    def views(self) -> list[Raw]:
        """Return each message as a part of the buffer."""
        view = memoryview(self.buffer)
        pairs = zip(self.starts.tolist(), self.stops.tolist(), strict=True)
        return [view[start:stop] for start, stop in pairs]


class Separate(Messages, frozen=True, eq=False):
    """Messages in buffers of their own: joining large ones would only copy them."""

    raws: list[Raw]

    def __iter__(self) -> Iterator[Raw]:
        return iter(self.raws)

    def views(self) -> list[Raw]:
        """Return the bytes of each message."""
        return self.raws


def times_of(values: Any, what: str) -> Any:
    """Return unsigned times as int64."""
    if len(values) and int(values.max()) >= END_OF_TIME:
        raise RecordingError(f"a message has a {what} after the year 2262")
    return values.astype(np.int64)


def join_messages(parts: Sequence[Messages]) -> Messages:
    """Return the messages of all parts, in memory once more only if they are small."""
    if len(parts) == 1:
        return parts[0]
    none: Any = np.zeros(0, np.int64)
    log = np.concatenate([none, *(part.log_times for part in parts)])
    publish_times = [part.publish_times for part in parts if part.publish_times is not None]
    publish = np.concatenate([none, *publish_times]) if len(publish_times) == len(parts) else None
    ranges = [part for part in parts if isinstance(part, Ranges)]
    if len(ranges) == len(parts) and len({id(part.buffer) for part in ranges}) == 1:
        starts = np.concatenate([part.starts for part in ranges])
        stops = np.concatenate([part.stops for part in ranges])
        return Ranges(log, publish, ranges[0].buffer, starts, stops)
    raws = [raw for part in parts for raw in part.views()]
    sizes: Any = np.fromiter(map(len, raws), np.int64, len(raws))
    if sizes.sum() >= LARGE * len(raws):
        return Separate(log, publish, raws)
    stops = np.cumsum(sizes)
    return Ranges(log, publish, b"".join(raws), stops - sizes, stops)


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


def in_chunks(
    source: Source,
    chunks: Iterable[Chunk],
    channels: Collection[int],
    window: Window,
    check: bool = False,
) -> Iterator[Messages]:
    """Yield the messages of some channels in chunks, adjacent chunks together."""
    with of_file(source.name):
        room = Room(source.size)
        groups = _groups(source, chunks, room)
        while True:
            with source.opened():  # closed while the caller uses the messages
                group = next(groups, None)
                if group is None:
                    return
                ranges = _read(source, group, channels, room, check).within(window)
            if len(ranges):
                yield decompress_each(ranges, room)


def _groups(
    source: Source, chunks: Iterable[Chunk], room: Room
) -> Iterator[list[tuple[Chunk, ChunkHead]]]:
    """Yield groups of adjacent chunks that are read together."""
    group: list[tuple[Chunk, ChunkHead]] = []
    size = 0
    for chunk in chunks:
        head = _head(source, chunk)
        if head.compression:
            room.reserve(head.size)
        elif head.size != head.stored:
            raise RecordingError("a chunk that is not compressed declares another size")
        if group and size + head.size > mcap.GROUP:
            yield group
            group, size = [], 0
        group.append((chunk, head))
        size += head.size
    if group:
        yield group


def _head(source: Source, chunk: Chunk) -> ChunkHead:
    """Return the head of a chunk."""
    if chunk.compression is None:
        return ChunkHead(0, 0, chunk.size, 0, "", chunk.at, chunk.size)
    head = source.view(chunk.at, HEAD.size)
    if HEAD.unpack(head) != (mcap.CHUNK_OP, chunk.size - HEAD.size):
        raise RecordingError(f"there is no chunk at byte {chunk.at}, where an index has one")
    return mcap.read_chunk_head(source, chunk.at, chunk.size)


def _read(
    source: Source,
    group: list[tuple[Chunk, ChunkHead]],
    channels: Collection[int],
    room: Room,
    check: bool,
) -> Ranges:
    """Return the messages of some channels in adjacent chunks."""
    buffer = np.empty(sum(head.size for _, head in group), np.uint8).data
    starts, ends, at = [], [], 0
    for chunk, head in group:
        target = buffer[at : at + head.size]
        places = _indexed(source, chunk, head.size, channels)
        _fill(source, chunk, head, target, places, check)
        if places is None:
            places = np.array(_walked(target, chunk, channels, room), np.int64)
        starts.append(places + at)
        at += head.size
        ends.append(np.full(len(places), at))
    return _messages(buffer, np.concatenate(starts), np.concatenate(ends), channels)


def _fill(
    source: Source, chunk: Chunk, head: ChunkHead, target: memoryview, places: Any, check: bool
) -> None:
    """Read the records of a chunk into a buffer, or only those at `places` if that suffices."""
    check = check and head.crc != 0
    if head.compression:
        decompress(source.view(head.start, head.stored), head.compression, target)
    elif places is None or check or not source.is_local:
        source.read(head.start, target)
    else:
        _read_some(source, head.start, target, places)
    if check and zlib.crc32(target) != head.crc:
        raise RecordingError(f"the checksum of the chunk at byte {chunk.at} is wrong")


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
            entries = source.view(at + HEAD.size + 6, mcap.index_entries(source, channel, at))
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
        if op == mcap.MESSAGE_OP and channel in channels:
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
    if not ((heads["op"] == mcap.MESSAGE_OP) & of_channels).all():
        raise RecordingError("an index names a place where there is no message of its channel")
    room = (ends - at - HEAD.size).astype(np.uint64)
    if ((heads["size"] < LEAST) | (heads["size"] > room)).any():
        raise RecordingError("a message is cut off")
    stops = at + HEAD.size + heads["size"].astype(np.int64)
    if (stops[:-1] > at[1:]).any():
        raise RecordingError("an index names messages that overlap")
    log, publish = times_of(heads["log"], "log time"), times_of(heads["publish"], "publish time")
    return Ranges(log, publish, buffer, at + MESSAGE.itemsize, stops)


def decompress_each(ranges: Ranges, room: Room) -> Messages:
    """Return messages without the compression that each may have by itself.

    No other message begins like a zstd frame.
    """
    array = np.frombuffer(ranges.buffer, np.uint8)
    candidates = ranges.starts[ranges.stops > ranges.starts]
    if not (array[candidates] == ZSTD_MAGIC[0]).any():
        return ranges
    raws = [zstd_frame(raw, room) if raw[:4] == ZSTD_MAGIC else raw for raw in ranges.views()]
    return Separate(ranges.log_times, ranges.publish_times, raws)
