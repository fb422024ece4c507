"""The content of an MCAP file: from its summary, or from a walk over its records without one.

The summary is at the end, so a recorder that died wrote none, and other writers leave parts of it
out. It is used only if it accounts for all that its own statistics count.
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator
from struct import Struct
from typing import NamedTuple

import msgspec

from idlc.recordings.containers.compression import Room, decompress
from idlc.recordings.containers.source import START, RecordingError, Source

MAGIC = b"\x89MCAP0\r\n"
HEAD = Struct("<BQ")
#: At the end of a file: the record, and the magic bytes once more.
FOOTER = Struct("<BQQQI")
INDEX_OFFSET = Struct("<HQ")
#: The head of a chunk has the name of a compression, of which none is long.
LONGEST_HEAD = 256

FOOTER_OP, SCHEMA_OP, CHANNEL_OP, MESSAGE_OP, CHUNK_OP = 2, 3, 4, 5, 6
MESSAGE_INDEX_OP, CHUNK_INDEX_OP, STATISTICS_OP = 7, 8, 0x0B
SUMMARY_OFFSET_OP, DATA_END_OP = 0x0E, 0x0F


class McapSchema(NamedTuple):
    """A definition, as the file has it."""

    id: int
    name: str
    encoding: str
    text: str


class Channel(NamedTuple):
    """A stream of messages of one topic and type."""

    id: int
    schema: int
    topic: str
    encoding: str
    metadata: dict[str, str]


class Chunk(NamedTuple):
    """A range with messages: a chunk, or records outside of any, whose `compression` is None.

    `indexes` has channels and places of its MessageIndex records, packed; None if it has none.
    They take `index_size` bytes behind it.
    """

    at: int
    size: int
    first: int
    last: int
    compression: str | None
    indexes: bytes | None
    index_size: int = 0


class Statistics(NamedTuple):
    """The counts of the writer."""

    messages: int
    chunks: int
    start: int
    counts: dict[int, int]


class Fields:
    """Reads the fields of one record, one after the other."""

    def __init__(self, data: memoryview, what: str) -> None:
        self.data = data
        self.at = 0
        self.what = what

    def read(self, size: int) -> memoryview:
        """Return the next bytes."""
        left = len(self.data) - self.at
        if size > left:
            raise RecordingError(f"{self.what} is broken: {size} bytes expected, {left} left")
        self.at += size
        return self.data[self.at - size : self.at]

    def number(self, size: int) -> int:
        """Return an unsigned number of so many bytes."""
        return int.from_bytes(self.read(size), "little")

    def name(self) -> str:
        """Return a short text; invalid bytes stay visible, so that names stay different."""
        return str(self.read(self.number(4)), "utf-8", "backslashreplace")

    def part(self) -> Fields:
        """Return the fields of a part, which its size of four bytes precedes."""
        return Fields(self.read(self.number(4)), self.what)

    def more(self) -> bool:
        """Return whether something is left."""
        return self.at < len(self.data)


def read_records(data: memoryview) -> Iterator[tuple[int, int, memoryview]]:
    """Yield kind, offset and content of each record; raise RecordingError if one is cut off."""
    at, end = 0, len(data)
    while at < end:
        if end - at < HEAD.size:
            raise RecordingError(f"a record is cut off after {end - at} bytes")
        op, size = HEAD.unpack_from(data, at)
        start = at + HEAD.size
        if not op:
            raise RecordingError("a record is of no kind")
        if size > end - start:
            raise RecordingError(f"a record of {size} bytes is cut off after {end - start}")
        yield op, at, data[start : start + size]
        at = start + size


def heads(source: Source, at: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Yield kind, offset and size, with the head, of each complete record."""
    while at + HEAD.size <= end:
        op, size = HEAD.unpack(source.view(at, HEAD.size))
        if not op or at + HEAD.size + size > end:
            return
        yield op, at, HEAD.size + size
        at += HEAD.size + size


def read_schema(data: memoryview) -> McapSchema:
    """Read a Schema record; invalid UTF-8 is replaced, as comments may be in any encoding."""
    fields = Fields(data, "a schema")
    number, name, encoding = fields.number(2), fields.name(), fields.name()
    text = str(fields.read(fields.number(4)), "utf-8", "replace")
    return McapSchema(number, name, encoding, text)


def read_channel(data: memoryview) -> Channel:
    """Read a Channel record."""
    fields = Fields(data, "a channel")
    number, kind, topic, encoding = (
        fields.number(2),
        fields.number(2),
        fields.name(),
        fields.name(),
    )
    part, metadata = fields.part(), {}
    while part.more():
        key = part.name()
        metadata[key] = part.name()
    return Channel(number, kind, topic, encoding, metadata)


def read_chunk_index(data: memoryview) -> Chunk:
    """Read a ChunkIndex record."""
    fields = Fields(data, "the index of a chunk")
    first, last, at, size = (fields.number(8) for _ in range(4))
    indexes = bytes(fields.read(fields.number(4)))
    if len(indexes) % INDEX_OFFSET.size:
        raise RecordingError("the index of a chunk is broken: its offsets are cut off")
    index_size = fields.number(8)
    return Chunk(at, size, first, last, fields.name(), indexes or None, index_size)


def read_statistics(data: memoryview) -> Statistics:
    """Read a Statistics record."""
    fields = Fields(data, "the statistics")
    messages = fields.number(8)
    fields.read(2 + 4 + 4 + 4)
    chunks, start = fields.number(4), fields.number(8)
    fields.read(8)
    part, counts = fields.part(), {}
    while part.more():
        number = part.number(2)
        counts[number] = part.number(8)
    return Statistics(messages, chunks, start, counts)


class ChunkHead(NamedTuple):
    """The head of a chunk; its records take `stored` bytes, from `start`."""

    first: int
    last: int
    size: int
    crc: int
    compression: str
    start: int
    stored: int


def read_chunk_head(source: Source, at: int, size: int) -> ChunkHead:
    """Read the head of a Chunk record."""
    data = source.view(at + HEAD.size, min(size - HEAD.size, LONGEST_HEAD))
    fields = Fields(data, "a chunk")
    first, last, large, crc = fields.number(8), fields.number(8), fields.number(8), fields.number(4)
    compression, stored = fields.name(), fields.number(8)
    left = size - HEAD.size - fields.at
    if stored > left:
        raise RecordingError(f"a chunk is broken: {stored} bytes expected, {left} left")
    return ChunkHead(first, last, large, crc, compression, at + HEAD.size + fields.at, stored)


END_OF_TIME = (1 << 64) - 1
#: Bytes of a Message record before the message itself.
MESSAGE_HEAD = 22
#: The start of a message: its channel and time, with its sequence number between them.
CHANNEL_AND_TIME = Struct("<HIQ")


class McapFacts(msgspec.Struct):
    """The content of a file; `start` is the time of the first message.

    `counts` is by channel; so is `loose`, of messages outside of chunks in a file with a summary.
    """

    schemas: dict[int, McapSchema] = {}
    channels: dict[int, Channel] = {}
    chunks: list[Chunk] = []
    counts: dict[int, int] = {}
    loose: dict[int, int] | None = None
    start: int | None = None
    notes: list[str] = []

    def add(self, op: int, data: memoryview) -> None:
        """Add a schema or a channel; definitions of one id must be equal."""
        if op == SCHEMA_OP:
            schema = read_schema(data)
            if self.schemas.setdefault(schema.id, schema) != schema:
                raise RecordingError(f"schema {schema.id} is defined in two ways")
        elif op == CHANNEL_OP:
            channel = read_channel(data)
            if self.channels.setdefault(channel.id, channel) != channel:
                raise RecordingError(f"channel {channel.id} is defined in two ways")


def read_facts(source: Source, index: bool = True, check: bool = False) -> McapFacts:
    """Return the content of a file; without `index`, its summary is not used.

    `check` compares the summary's checksum.
    """
    if source.size < len(MAGIC) or source.view(0, len(MAGIC)) != MAGIC:
        raise RecordingError(f"`{source.name}` is no MCAP file: it begins with other bytes")
    reason = "its index is not used"
    if index:
        try:
            return _summary(source, check)
        except ContradictionError as error:
            reason, index = error.message, False
        except RecordingError as error:
            reason = error.message
    return _walk(source, reason, index)


def first_messages(
    source: Source, facts: McapFacts, channels: Collection[int]
) -> Iterator[tuple[int, bytes]]:
    """Yield channels with the start of their first messages; each chunk is opened at most once."""
    waiting = {channel for channel in channels if facts.counts.get(channel)}
    room = Room(source.size)
    for chunk in facts.chunks:
        named = {channel for channel, _ in INDEX_OFFSET.iter_unpack(chunk.indexes or b"")}
        mine = waiting if chunk.indexes is None else waiting & named
        if not mine:
            continue
        for data, _ in zip(_contents(source, chunk, room), room.records(), strict=False):
            number = int.from_bytes(data[:2], "little")
            if number in mine:
                yield number, bytes(data[MESSAGE_HEAD:])
                mine.remove(number)
                waiting.discard(number)
                if not mine:
                    break


def _contents(source: Source, chunk: Chunk, room: Room) -> Iterator[memoryview]:
    """Yield the start of each message of a chunk, or of a stretch outside of any."""
    most = MESSAGE_HEAD + START
    if chunk.compression is None:
        for op, at, size in heads(source, chunk.at, chunk.at + chunk.size):
            if op == MESSAGE_OP:
                yield source.view(at + HEAD.size, min(size - HEAD.size, most))
        return
    for op, _, data in read_records(_content(source, chunk, room)):
        if op == MESSAGE_OP:
            yield data[:most]


def _content(source: Source, chunk: Chunk, room: Room) -> memoryview:
    """Return the records of a chunk."""
    head = read_chunk_head(source, chunk.at, chunk.size)
    room.reserve(head.size)
    target = memoryview(bytearray(head.size))
    decompress(source.view(head.start, head.stored), head.compression, target)
    return target


class ContradictionError(RecordingError):
    """A summary is not only incomplete but wrong, and the indexes written with it may be, too."""


def _summary(source: Source, check: bool) -> McapFacts:
    """Return the content by the summary; raise RecordingError if that is not reliable."""
    end = source.size - FOOTER.size - len(MAGIC)
    if end < len(MAGIC) or source.view(source.size - len(MAGIC), len(MAGIC)) != MAGIC:
        raise RecordingError("it was not closed")
    op, size, start, _, crc = FOOTER.unpack(source.view(end, FOOTER.size))
    if (op, size) != (FOOTER_OP, FOOTER.size - HEAD.size):
        raise RecordingError("it has no footer")
    if not len(MAGIC) <= start <= end:
        raise RecordingError("it has no summary")
    data = source.view(start, end - start)
    if check and crc:
        covered = source.view(start, source.size - len(MAGIC) - 4 - start)
        if zlib.crc32(covered) != crc:
            raise ContradictionError("the checksum of its summary is wrong")
    facts, statistics = McapFacts(), None
    for op, _, content in read_records(data):
        facts.add(op, content)
        if op == CHUNK_INDEX_OP:
            facts.chunks.append(read_chunk_index(content))
        elif op == STATISTICS_OP:
            statistics = read_statistics(content)
    _check_summary(facts, statistics)
    _add_loose(source, facts, start)
    return facts


def _check_summary(facts: McapFacts, statistics: Statistics | None) -> None:
    """Raise RecordingError if a summary is incomplete, by its own count."""
    if statistics is None:
        raise RecordingError("its summary has no statistics")
    if statistics.chunks != len(facts.chunks):
        raise ContradictionError("its summary names other chunks than it counts")
    if not statistics.counts.keys() <= facts.channels.keys():
        raise RecordingError("its summary does not name all channels")
    needed = {channel.schema for channel in facts.channels.values() if channel.schema}
    if not needed <= facts.schemas.keys():
        raise RecordingError("its summary does not name all schemas")
    if statistics.messages != sum(statistics.counts.values()):
        raise ContradictionError("its summary counts messages in two ways")
    facts.counts = statistics.counts
    facts.start = statistics.start if statistics.messages else None


def _add_loose(source: Source, facts: McapFacts, start: int) -> None:
    """Add the stretches that no chunk covers and that have messages, in a file with a summary.

    Raises RecordingError if chunks overlap.
    """
    facts.chunks.sort(key=lambda chunk: chunk.at)
    end, gaps = len(MAGIC), []
    for at, following in [
        *((chunk.at, chunk.at + chunk.size + chunk.index_size) for chunk in facts.chunks),
        (start, start),
    ]:
        if at < end:
            raise ContradictionError("its summary names chunks that are not there")
        gaps.append((end, at))
        end = following
    facts.loose = {}
    for first, last in gaps:
        facts.chunks += _loose(source, facts.loose, first, last)
    facts.chunks.sort(key=lambda chunk: chunk.at)


def _loose(source: Source, counts: dict[int, int], at: int, end: int) -> Iterator[Chunk]:
    """Yield the stretch of messages in a gap between chunks, if there is one."""
    first, last = None, at
    for op, place, size in heads(source, at, end):
        if op == CHUNK_OP:
            raise ContradictionError("its summary does not name all chunks")
        if op == MESSAGE_OP:
            first, last = place if first is None else first, place + size
            number = int.from_bytes(source.view(place + HEAD.size, min(2, size)), "little")
            counts[number] = counts.get(number, 0) + 1
    if first is not None:
        yield Chunk(first, last - first, 0, END_OF_TIME, None, None)


class _Walk:
    """A walk over all records of a file, which opens every chunk.

    Nothing else says whether a chunk has more messages than its indexes name.
    """

    def __init__(self, source: Source, index: bool) -> None:
        self.source = source
        self.uses_index = index
        self.facts = McapFacts()
        self.loose: tuple[int, int] | None = None
        self.last: Chunk | None = None
        self.offsets = bytearray()
        self.entries: dict[int, int] = {}
        self.room = Room(source.size)
        self.damaged = False

    def content(self, at: int, size: int) -> memoryview:
        """Return the content of a record."""
        return self.source.view(at + HEAD.size, size - HEAD.size)

    def count(self, channel: int, messages: int, first: int) -> None:
        """Count messages of a channel, none of which came before the first time."""
        counts = self.facts.counts
        counts[channel] = counts.get(channel, 0) + messages
        if self.facts.start is None or first < self.facts.start:
            self.facts.start = first

    def message(self, at: int, size: int) -> None:
        """Count a message outside of any chunk."""
        data = self.source.view(at + HEAD.size, min(size - HEAD.size, CHANNEL_AND_TIME.size))
        if len(data) == CHANNEL_AND_TIME.size:
            channel, _, time = CHANNEL_AND_TIME.unpack(data)
            self.count(channel, 1, time)
        start = self.loose[0] if self.loose else at
        self.loose = (start, at + size)

    def end_of_loose(self) -> None:
        """Make one stretch of the messages outside of chunks until here."""
        if self.loose:
            start, end = self.loose
            chunk = Chunk(start, end - start, 0, END_OF_TIME, None, None)
            self.facts.chunks.append(chunk)
            self.loose = None

    def chunk(self, at: int, size: int) -> None:
        """Begin a chunk."""
        head = read_chunk_head(self.source, at, size)
        self.last = Chunk(at, size, head.first, head.last, head.compression, None)

    def index(self, at: int, size: int) -> None:
        """Add the index of one channel in the chunk before it."""
        fields = Fields(self.content(at, size), "the index of a chunk")
        channel, entries = fields.number(2), fields.number(4)
        self.entries[channel] = self.entries.get(channel, 0) + entries // 16
        self.offsets += INDEX_OFFSET.pack(channel, at)

    def end_of_chunk(self) -> None:
        """Add the chunk before, its messages, and its indexes if they name all of these."""
        if self.last is None:
            return
        counts: dict[int, int] = {}
        first, last = END_OF_TIME, 0
        try:
            content = _content(self.source, self.last, self.room)
        except RecordingError as error:
            if not self.entries or not self.entries.keys() <= self.facts.channels.keys():
                raise
            # reading the topics in it reports the problem again; other topics stay readable
            if not self.damaged:
                what = f"the chunk at byte {self.last.at}, and perhaps others, cannot be read"
                self.facts.notes.append(f"{what}: {error.message}")
            self.damaged = True
            content, counts = memoryview(b""), self.entries
            first, last = self.last.first, self.last.last
        for (op, _, data), _ in zip(read_records(content), self.room.records(), strict=False):
            self.facts.add(op, data)
            if op == MESSAGE_OP and len(data) >= CHANNEL_AND_TIME.size:
                channel, _, time = CHANNEL_AND_TIME.unpack_from(data)
                counts[channel] = counts.get(channel, 0) + 1
                first, last = min(first, time), max(last, time)
        for channel, messages in counts.items():
            self.count(channel, messages, first)
        indexes = bytes(self.offsets) if counts == self.entries else None
        self.facts.chunks.append(self.last._replace(first=first, last=last, indexes=indexes))
        self.last, self.offsets, self.entries = None, bytearray(), {}


def _walk(source: Source, reason: str, index: bool) -> McapFacts:
    """Return the content by the complete records; `reason` says why the summary is not used.

    Without `index`, the indexes of chunks are not used either.
    """
    walk, ended, end = _Walk(source, index), False, len(MAGIC)
    for op, at, size in heads(source, end, source.size):
        end = at + size
        if op == MESSAGE_INDEX_OP and walk.last:
            if walk.uses_index:
                walk.index(at, size)
            continue
        walk.end_of_chunk()
        if op == MESSAGE_OP:
            walk.message(at, size)
        elif op == CHUNK_OP:
            walk.end_of_loose()
            walk.chunk(at, size)
        elif op in (SCHEMA_OP, CHANNEL_OP):
            walk.facts.add(op, walk.content(at, size))
        # a summary follows, and nothing keeps a writer from going on
        ended = op == DATA_END_OP or (ended and op not in (MESSAGE_OP, CHUNK_OP))
        if op == FOOTER_OP:
            break
    walk.end_of_chunk()
    walk.end_of_loose()
    if ended:
        walk.facts.notes.append(f"{reason}: read from its records")
    else:
        left = source.size - end
        rest = f", {left:,} bytes are left out" if left else ""
        walk.facts.notes.append(f"{reason}: read to its last whole record{rest}")
    return walk.facts
