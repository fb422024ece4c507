"""The records of an MCAP file: what each kind holds, every length checked before it is used."""

from __future__ import annotations

from collections.abc import Iterator
from struct import Struct
from typing import NamedTuple

from idlc.recordings.errors import RecordingError
from idlc.recordings.source import Source

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
    """Where messages are: a chunk, or records outside of any, whose `compression` is None.

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
    """What the writer counted."""

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

    def take(self, size: int) -> memoryview:
        """Return the next bytes."""
        left = len(self.data) - self.at
        if size > left:
            raise RecordingError(f"{self.what} is broken: {size} bytes expected, {left} left")
        self.at += size
        return self.data[self.at - size : self.at]

    def number(self, size: int) -> int:
        """Return an unsigned number of so many bytes."""
        return int.from_bytes(self.take(size), "little")

    def name(self) -> str:
        """Return a short text; bytes that are none stay visible, so that names stay different."""
        return str(self.take(self.number(4)), "utf-8", "backslashreplace")

    def part(self) -> Fields:
        """Return what a size of four bytes and so many bytes hold."""
        return Fields(self.take(self.number(4)), self.what)

    def more(self) -> bool:
        """Return whether something is left."""
        return self.at < len(self.data)


def records(data: memoryview) -> Iterator[tuple[int, int, memoryview]]:
    """Yield kind, place and content of each record; raise RecordingError if one is cut off."""
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
    """Yield kind, place and size, with the head, of each record that is there as a whole."""
    while at + HEAD.size <= end:
        op, size = HEAD.unpack(source.view(at, HEAD.size))
        if not op or at + HEAD.size + size > end:
            return
        yield op, at, HEAD.size + size
        at += HEAD.size + size


def schema(data: memoryview) -> McapSchema:
    """Read a Schema record; what is no UTF-8 is replaced, as comments may be in any encoding."""
    fields = Fields(data, "a schema")
    number, name, encoding = fields.number(2), fields.name(), fields.name()
    text = str(fields.take(fields.number(4)), "utf-8", "replace")
    return McapSchema(number, name, encoding, text)


def channel(data: memoryview) -> Channel:
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


def chunk_index(data: memoryview) -> Chunk:
    """Read a ChunkIndex record."""
    fields = Fields(data, "the index of a chunk")
    first, last, at, size = (fields.number(8) for _ in range(4))
    indexes = bytes(fields.take(fields.number(4)))
    if len(indexes) % INDEX_OFFSET.size:
        raise RecordingError("the index of a chunk is broken: its offsets are cut off")
    index_size = fields.number(8)
    return Chunk(at, size, first, last, fields.name(), indexes or None, index_size)


def statistics(data: memoryview) -> Statistics:
    """Read a Statistics record."""
    fields = Fields(data, "the statistics")
    messages = fields.number(8)
    fields.take(2 + 4 + 4 + 4)
    chunks, start = fields.number(4), fields.number(8)
    fields.take(8)
    part, counts = fields.part(), {}
    while part.more():
        number = part.number(2)
        counts[number] = part.number(8)
    return Statistics(messages, chunks, start, counts)


class ChunkHead(NamedTuple):
    """What stands before the records of a chunk: these take `stored` bytes, from `start`."""

    first: int
    last: int
    size: int
    crc: int
    compression: str
    start: int
    stored: int


def chunk_head(source: Source, at: int, size: int) -> ChunkHead:
    """Read how a Chunk record begins."""
    data = source.view(at + HEAD.size, min(size - HEAD.size, LONGEST_HEAD))
    fields = Fields(data, "a chunk")
    first, last, large, crc = fields.number(8), fields.number(8), fields.number(8), fields.number(4)
    compression, stored = fields.name(), fields.number(8)
    left = size - HEAD.size - fields.at
    if stored > left:
        raise RecordingError(f"a chunk is broken: {stored} bytes expected, {left} left")
    return ChunkHead(first, last, large, crc, compression, at + HEAD.size + fields.at, stored)
