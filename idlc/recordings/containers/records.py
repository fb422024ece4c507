"""The records of MCAP files, and where in a file they are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from struct import Struct
from typing import NamedTuple, TypeVar

from idlc.recordings.containers.source import RecordingError, Source

Item = TypeVar("Item")
MAGIC = b"\x89MCAP0\r\n"
#: What precedes the content of each record: opcode and length.
HEAD = Struct("<BQ")
#: What precedes the data of a message: channel, sequence, log and publish time.
MESSAGE_HEAD = Struct("<HIQQ")
#: At the end of a file: the record, and the magic bytes once more.
FOOTER = Struct("<BQQQI")
INDEX_OFFSET = Struct("<HQ")
#: The head of a chunk has the name of a compression, of which none is long.
LONGEST_HEAD = 256
#: Adjacent chunks are read together up to so many bytes: few calls, and memory stays bounded.
GROUP = 1 << 24

HEADER_OP, FOOTER_OP, SCHEMA_OP, CHANNEL_OP, MESSAGE_OP, CHUNK_OP = 1, 2, 3, 4, 5, 6
MESSAGE_INDEX_OP, CHUNK_INDEX_OP, ATTACHMENT_OP, ATTACHMENT_INDEX_OP = 7, 8, 9, 0x0A
STATISTICS_OP, METADATA_OP, METADATA_INDEX_OP = 0x0B, 0x0C, 0x0D
SUMMARY_OFFSET_OP, DATA_END_OP = 0x0E, 0x0F


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


def grouped(
    items: Iterable[Item], size_of: Callable[[Item], int], most: int
) -> Iterator[list[Item]]:
    """Yield neighbours that together take at most so many bytes, or one that takes more."""
    group: list[Item] = []
    total = 0
    for item in items:
        size = size_of(item)
        if group and total + size > most:
            yield group
            group, total = [], 0
        group.append(item)
        total += size
    if group:
        yield group


def read_chunk_index(data: memoryview) -> Chunk:
    """Read a ChunkIndex record."""
    fields = Fields(data, "the index of a chunk")
    first, last, at, size = (fields.number(8) for _ in range(4))
    indexes = bytes(fields.read(fields.number(4)))
    if len(indexes) % INDEX_OFFSET.size:
        raise RecordingError("the index of a chunk is broken: its offsets are cut off")
    index_size = fields.number(8)
    return Chunk(at, size, first, last, fields.name(), indexes or None, index_size)


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


def index_entries(source: Source, channel: int, at: int) -> int:
    """Return the number of bytes of entries in the MessageIndex at `at`, by its head."""
    op, size = HEAD.unpack(source.view(at, HEAD.size))
    if op != MESSAGE_INDEX_OP:
        raise RecordingError(f"there is no index of messages at byte {at}, where another has one")
    source.check(at + HEAD.size, size)
    fields = Fields(source.view(at + HEAD.size, min(size, 6)), "an index of messages")
    if fields.number(2) != channel:
        raise RecordingError(f"the index of messages at byte {at} is of another channel")
    entries = fields.number(4)
    if entries % 16 or entries > size - 6:
        raise RecordingError(f"the index of messages at byte {at} is cut off")
    return entries
