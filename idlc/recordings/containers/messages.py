"""Messages as they are recorded: bytes and times."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from struct import Struct
from typing import Any, NamedTuple, TypeAlias

import msgspec
import numpy as np

from idlc.recordings.containers import mcap
from idlc.recordings.containers.compression import ZSTD_MAGIC, Room, decompress, zstd_frame
from idlc.recordings.containers.db3 import Db3, Rows
from idlc.recordings.containers.mcap import HEAD, INDEX_OFFSET, Chunk, ChunkHead
from idlc.recordings.containers.source import (
    LocalFile,
    Read,
    RecordingError,
    Source,
    of_file,
    within,
)

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
#: Adjacent chunks are read together up to so many bytes: few calls, and memory stays bounded.
MCAP_GROUP = 1 << 24
#: In uncompressed chunks, gaps between messages are read too if they are smaller.
NEAR = 1 << 15


class LoadedChunk(NamedTuple):
    """A chunk whose records are in a buffer, from `start` to `stop`."""

    chunk: Chunk
    start: int
    stop: int


def mcap_messages(
    source: Source,
    chunks: Iterable[Chunk],
    channels: Collection[int],
    window: Window,
    check: bool = False,
) -> Iterator[Messages]:
    """Yield the messages of some channels in chunks, adjacent chunks together."""
    with of_file(source.name):
        room = Room(source.size)
        matching = (chunk for chunk in chunks if may_have(chunk, window))
        groups = _groups(source, matching, room)
        while True:
            with source.opened():  # closed while the caller uses the messages
                group = next(groups, None)
                if group is None:
                    return
                ranges = _read(source, group, channels, room, check).within(window)
            if len(ranges):
                yield decompress_each(ranges, room)


def _read(
    source: Source,
    group: list[tuple[Chunk, ChunkHead]],
    channels: Collection[int],
    room: Room,
    check: bool,
) -> Ranges:
    """Return the messages of some channels in adjacent chunks."""
    buffer = np.empty(sum(head.size for _, head in group), np.uint8).data
    opened, offsets, at = [], [], 0
    for chunk, head in group:
        entry = LoadedChunk(chunk, at, at := at + head.size)
        places = _indexed(source, entry, channels)
        _fill(source, entry, head, buffer, places, check)
        if places is None:
            places = np.array(_walked(buffer, entry, channels, room), np.int64)
        opened.append(entry)
        offsets.append(places)
    return _messages(buffer, opened, offsets, channels)


def may_have(chunk: Chunk, window: Window) -> bool:
    """Return whether messages of a window may be in a chunk, by its index."""
    return chunk.compression is None or window.overlaps(chunk.first, chunk.last)


def count(source: Source, chunk: Chunk) -> int:
    """Return the number of messages that the indexes of a chunk name."""
    places = INDEX_OFFSET.iter_unpack(chunk.indexes or b"")
    return sum(_entries(source, channel, at) // 16 for channel, at in places)


def _head(source: Source, chunk: Chunk) -> ChunkHead:
    """Return the head of a chunk."""
    if chunk.compression is None:
        return ChunkHead(0, 0, chunk.size, 0, "", chunk.at, chunk.size)
    head = source.view(chunk.at, HEAD.size)
    if HEAD.unpack(head) != (mcap.CHUNK_OP, chunk.size - HEAD.size):
        raise RecordingError(f"there is no chunk at byte {chunk.at}, where an index has one")
    return mcap.read_chunk_head(source, chunk.at, chunk.size)


def _groups(
    source: Source, chunks: Iterable[Chunk], room: Room
) -> Iterator[list[tuple[Chunk, ChunkHead]]]:
    """Yield groups of adjacent chunks that are read together."""
    group: list[tuple[Chunk, ChunkHead]] = []
    size = 0
    for whole in chunks:
        for chunk in _divided(source, whole) if whole.compression is None else (whole,):
            head = _head(source, chunk)
            if head.compression:
                room.reserve(head.size)
            elif head.size != head.stored:
                raise RecordingError("a chunk that is not compressed declares another size")
            if group and size + head.size > MCAP_GROUP:
                yield group
                group, size = [], 0
            group.append((chunk, head))
            size += head.size
    if group:
        yield group


def _divided(source: Source, stretch: Chunk) -> Iterator[Chunk]:
    """Yield parts of a stretch of records outside of chunks, which may be the whole file."""
    start, end = stretch.at, stretch.at + stretch.size
    if stretch.size > MCAP_GROUP:
        for _, at, size in mcap.heads(source, start, end):
            if start < at and at + size - start > MCAP_GROUP:
                yield stretch._replace(at=start, size=at - start)
                start = at
    yield stretch._replace(at=start, size=end - start)


def _fill(
    source: Source,
    opened: LoadedChunk,
    head: ChunkHead,
    buffer: memoryview,
    offsets: Any,
    check: bool,
) -> None:
    """Read the records of a chunk into a buffer, or only those at `offsets` if that suffices."""
    target = buffer[opened.start : opened.stop]
    check = check and head.crc != 0
    if head.compression:
        decompress(source.view(head.start, head.stored), head.compression, target)
    else:
        with source.opened() as read:
            if offsets is None or check or not isinstance(source, LocalFile):
                read(head.start, target)
            else:
                _read_some(read, head.start, target, offsets - opened.start)
    if check and zlib.crc32(target) != head.crc:
        raise RecordingError(f"the checksum of the chunk at byte {opened.chunk.at} is wrong")


def _read_some(read: Read, start: int, target: memoryview, offsets: Any) -> None:
    """Read messages of a chunk that begins at `start`, adjacent ones together."""
    for near in np.split(offsets, np.flatnonzero(np.diff(offsets) > NEAR) + 1):
        if not len(near):
            return
        first, last = int(near[0]), int(near[-1])
        stop = min(last + NEAR, len(target))
        read(start + first, target[first:stop])
        _, size = HEAD.unpack_from(target, last)
        end = min(last + HEAD.size + size, len(target))
        if end > stop:
            read(start + stop, target[stop:end])


def _indexed(source: Source, opened: LoadedChunk, channels: Collection[int]) -> Any:
    """Return the offsets in the buffer of the messages of some channels; None without an index."""
    if opened.chunk.indexes is None:
        return None
    parts = [
        np.frombuffer(source.view(at + HEAD.size + 6, _entries(source, channel, at)), "<u8")[1::2]
        for channel, at in INDEX_OFFSET.iter_unpack(opened.chunk.indexes)
        if channel in channels
    ]
    offsets = np.concatenate([np.zeros(0, "<u8"), *parts])
    last = opened.stop - opened.start - MESSAGE.itemsize
    if len(offsets) and (last < 0 or int(offsets.max()) > last):
        raise RecordingError("an index of messages leaves its chunk")
    offsets = offsets.astype(np.int64)
    if (offsets[1:] <= offsets[:-1]).any():
        offsets.sort()
    return offsets + opened.start


def _entries(source: Source, channel: int, at: int) -> int:
    """Return the number of bytes of entries in the MessageIndex at `at`, by its head."""
    op, size = HEAD.unpack(source.view(at, HEAD.size))
    if op != mcap.MESSAGE_INDEX_OP:
        raise RecordingError(f"there is no index of messages at byte {at}, where another has one")
    within(source, at + HEAD.size, size)
    fields = mcap.Fields(source.view(at + HEAD.size, min(size, 6)), "an index of messages")
    if fields.number(2) != channel:
        raise RecordingError(f"the index of messages at byte {at} is of another channel")
    entries = fields.number(4)
    if entries % 16 or entries > size - 6:
        raise RecordingError(f"the index of messages at byte {at} is cut off")
    return entries


def _walked(
    view: memoryview, opened: LoadedChunk, channels: Collection[int], room: Room
) -> list[int]:
    """Return the offsets of messages, by a walk from record to record."""
    unpack, ahead = MESSAGE_HEAD.unpack_from, MESSAGE_HEAD.size
    places, at, stop = [], opened.start, opened.stop
    for _ in room.records():
        if at + ahead > stop:
            break
        op, size, channel = unpack(view, at)
        if op == mcap.MESSAGE_OP and channel in channels:
            places.append(at)
        at += HEAD.size + size
    if at != stop and not (at < stop and at + HEAD.size + view[at + 1] == stop):
        raise RecordingError(f"records of the chunk at byte {opened.chunk.at} are cut off")
    return places


def _messages(
    buffer: memoryview, opened: list[LoadedChunk], offsets: list[Any], channels: Collection[int]
) -> Ranges:
    """Return the messages at some offsets of a buffer; raise RecordingError for others."""
    array: Any = np.frombuffer(buffer, np.uint8)
    at = np.concatenate(offsets)
    counts = [len(part) for part in offsets]
    ends = np.repeat(np.array([entry.stop for entry in opened], np.int64), counts)
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
    raws = [plain(raw, room) for raw in ranges.views()]
    return Separate(ranges.log_times, ranges.publish_times, raws)


def plain(data: Raw, room: Room) -> Raw:
    """Return a message that may be compressed by itself."""
    return zstd_frame(data, room) if data[:4] == ZSTD_MAGIC else data


#: Rows are yielded together until they have so many bytes.
DB3_GROUP = 1 << 25
#: SQLite has no other integers.
SMALLEST, LARGEST = -(1 << 63), (1 << 63) - 1


def db3_messages(
    database: Db3, pieces: Iterable[Rows], topics: Collection[int], window: Window
) -> Iterator[Messages]:
    """Yield the messages of some topics in some rows."""
    room = Room(database.size)
    for piece in pieces:
        with of_file(database.name):
            first: int | None = piece.first
            while first is not None:
                times, raws, first = _group(database, Rows(first, piece.last), topics, window, room)
                if raws:
                    yield Separate(np.array(times, np.int64), None, raws)


def _group(
    database: Db3, piece: Rows, topics: Collection[int], window: Window, room: Room
) -> tuple[list[int], list[Raw], int | None]:
    """Return times and contents of the first messages, and the row that is next, if any.

    The file is locked only meanwhile, so that a recorder can go on writing.
    """
    times: list[int] = []
    raws: list[Raw] = []
    size = 0
    with closing(_rows(database, piece, topics, window, room)) as rows:
        for row, time, data in rows:
            times.append(time)
            raws.append(data)
            size += len(data)
            if size >= DB3_GROUP:
                return times, raws, row + 1 if row < piece.last else None
    return times, raws, None


def _rows(
    database: Db3, piece: Rows, topics: Collection[int], window: Window, room: Room
) -> Generator[tuple[int, int, bytes], None, None]:
    """Yield row, time and content of each message."""
    marks = ", ".join("?" * len(topics))
    start = SMALLEST if window.start is None else max(window.start, SMALLEST)
    end = LARGEST if window.end is None else min(window.end - 1, LARGEST)
    query = (
        "SELECT rowid, timestamp, data FROM messages NOT INDEXED WHERE rowid BETWEEN ? AND ? "  # noqa: S608
        f"AND topic_id IN ({marks}) AND (timestamp BETWEEN ? AND ? "
        "OR typeof(timestamp) <> 'integer') ORDER BY rowid"
    )
    if start > end:
        return
    rows = database.rows(query, (*piece, *topics, start, end))
    with closing(rows):
        for row, time, data in rows:
            if not isinstance(time, int) or not isinstance(data, bytes):
                raise RecordingError("a message has values of other types")
            yield row, time, data if data[:4] != ZSTD_MAGIC else zstd_frame(data, room)
