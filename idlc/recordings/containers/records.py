"""The records of MCAP files, and where in a file they are."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from struct import Struct
from typing import NamedTuple, TypeVar

from idlc.recordings.containers.compression import decompressed
from idlc.recordings.containers.source import DamageError, FileSource

ItemT = TypeVar("ItemT")
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
#: The smallest content of each kind of record.
LEAST = {
    HEADER_OP: 8,
    FOOTER_OP: 20,
    SCHEMA_OP: 14,
    CHANNEL_OP: 16,
    MESSAGE_OP: MESSAGE_HEAD.size,
    CHUNK_OP: 40,
    MESSAGE_INDEX_OP: 6,
    CHUNK_INDEX_OP: 64,
    ATTACHMENT_OP: 36,
    ATTACHMENT_INDEX_OP: 48,
    STATISTICS_OP: 46,
    METADATA_OP: 8,
    METADATA_INDEX_OP: 20,
    SUMMARY_OFFSET_OP: 17,
    DATA_END_OP: 4,
}
#: The kinds of records that are also in chunks.
INNER = {SCHEMA_OP, CHANNEL_OP, MESSAGE_OP}
#: So many records in a row prove that the first is one.
IN_A_ROW = 3
#: Anything that may be the head of a record smaller than 1 TiB; of chunks, compressed and not.
_ANY_HEAD = re.compile(rb"[\x02-\x0f](?=.{5}\0{3})", re.DOTALL)
#: A search for the next record reads so much at a time.
SEARCHED = 1 << 20


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
            raise DamageError(f"{self.what} is broken: {size} bytes expected, {left} left")
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
    """Yield kind, offset and content of each record; raise DamageError if one is cut off."""
    at, end = 0, len(data)
    while at < end:
        if end - at < HEAD.size:
            raise DamageError(f"a record is cut off after {end - at} bytes")
        op, size = HEAD.unpack_from(data, at)
        start = at + HEAD.size
        if not op:
            raise DamageError("a record is of no kind")
        if size > end - start:
            raise DamageError(f"a record of {size} bytes is cut off after {end - start}")
        yield op, at, data[start : start + size]
        at = start + size


def sound_size(data: memoryview) -> int:
    """Return how many bytes the whole records at the start of a chunk take."""
    end = 0
    with suppress(DamageError):
        for op, at, content in read_records(data):
            if len(content) < LEAST.get(op, 0):
                break
            end = at + HEAD.size + len(content)
    return end


def heads(source: FileSource, at: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Yield kind, offset and size, with the head, of each complete record."""
    while (head := _head(source, at, end)) is not None:
        op, size = head
        yield op, at, size
        at += size


def sound_heads(
    source: FileSource, at: int, end: int, skipped: Callable[[int, int], object]
) -> Iterator[tuple[int, int, int]]:
    """Yield the same, and go on behind damage, whose range `skipped` is called with.

    Ends with the footer. Records of the kinds that are in chunks are only found again in a file
    that has messages outside of chunks.
    """
    before: tuple[int, int, int] | None = None
    is_loose = False
    while at < end:
        head = _head(source, at, end)
        if head is not None and head[0] == CHUNK_OP and not _is_chunk(source, at, head[1]):
            # later versions of MCAP may add fields
            head = head if _is_record(source, at + head[1], end) else None
        if head is not None:
            if before:
                yield before
            before = (head[0], at, head[1])
            is_loose |= head[0] == MESSAGE_OP
            at += head[1]
            if head[0] == FOOTER_OP:
                break
            continue
        # the size of the record before may be what is wrong
        proven = before is None or before[0] == CHUNK_OP
        start = at if before is None or proven else before[1] + HEAD.size
        following = resume(source, start, end, is_loose)
        if following < at and before:
            skipped(before[1], following)
        else:
            if before:
                yield before
            skipped(at, following)
        before, at = None, following
    if before:
        yield before


def resume(source: FileSource, at: int, end: int, is_loose: bool) -> int:
    """Return where the next record begins, at or after an offset; `end` if none does."""
    while at < end:
        # a pattern looks ahead, so windows overlap
        window = min(SEARCHED + HEAD.size, end - at)
        data = source.view(at, window)
        for match in _ANY_HEAD.finditer(data):
            place = at + match.start()
            op, size = HEAD.unpack_from(data, match.start())
            if size < LEAST[op] or place + HEAD.size + size > end or (op in INNER and not is_loose):
                continue
            if _is_record(source, place, end):
                return place
        at += max(window - HEAD.size, 1)
    return end


def _head(source: FileSource, at: int, end: int) -> tuple[int, int] | None:
    """Return kind and size, with the head, of a record; None if none can be at an offset."""
    if at + HEAD.size > end:
        return None
    op, size = HEAD.unpack(source.view(at, HEAD.size))
    if not op or at + HEAD.size + size > end or size < LEAST.get(op, 0):
        return None
    return op, HEAD.size + size


def _is_chunk(source: FileSource, at: int, size: int) -> bool:
    """Return whether the two sizes of a chunk agree."""
    try:
        head = read_chunk_head(source, at, size)
    except DamageError:
        return False
    return head.start + head.stored == at + size


def _is_record(source: FileSource, at: int, end: int) -> bool:
    """Return whether a record begins at an offset: a whole chunk, or several records in a row."""
    for _ in range(IN_A_ROW):
        if at == end:
            return True
        head = _head(source, at, end)
        if head is None or head[0] not in LEAST:
            return False
        if head[0] == CHUNK_OP:
            return _is_chunk(source, at, head[1])
        at += head[1]
        if head[0] == FOOTER_OP:
            return True
    return True


def grouped(
    items: Iterable[ItemT], size_of: Callable[[ItemT], int], most: int
) -> Iterator[list[ItemT]]:
    """Yield neighbours that together take at most so many bytes, or one that takes more."""
    group: list[ItemT] = []
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
        raise DamageError("the index of a chunk is broken: its offsets are cut off")
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


def read_chunk_head(source: FileSource, at: int, size: int) -> ChunkHead:
    """Read the head of a Chunk record."""
    data = source.view(at + HEAD.size, min(size - HEAD.size, LONGEST_HEAD))
    fields = Fields(data, "a chunk")
    first, last, large, crc = fields.number(8), fields.number(8), fields.number(8), fields.number(4)
    compression, stored = fields.name(), fields.number(8)
    left = size - HEAD.size - fields.at
    if stored > left:
        raise DamageError(f"a chunk is broken: {stored} bytes expected, {left} left")
    return ChunkHead(first, last, large, crc, compression, at + HEAD.size + fields.at, stored)


def proven_head(source: FileSource, head: ChunkHead) -> ChunkHead | None:
    """Return the head of a chunk with the size of its content, if the checksum proves that."""
    with suppress(DamageError):
        content = decompressed(source.view(head.start, head.stored), head.compression)
        if head.crc and zlib.crc32(content) == head.crc:
            return head._replace(size=len(content))
    return None


def index_entries(source: FileSource, channel: int, at: int) -> int:
    """Return the number of bytes of entries in the MessageIndex at `at`, by its head."""
    op, size = HEAD.unpack(source.view(at, HEAD.size))
    if op != MESSAGE_INDEX_OP:
        raise DamageError(f"there is no index of messages at byte {at}, where another has one")
    source.check(at + HEAD.size, size)
    fields = Fields(source.view(at + HEAD.size, min(size, 6)), "an index of messages")
    if fields.number(2) != channel:
        raise DamageError(f"the index of messages at byte {at} is of another channel")
    entries = fields.number(4)
    if entries % 16 or entries != size - 6:
        raise DamageError(f"the index of messages at byte {at} is cut off")
    return entries
