"""MCAP files: their content from the summary, or from a walk over their records without one.

The summary is at the end, so a recorder that died wrote none, and other writers leave parts of it
out. It is used only if it accounts for all that its own statistics count.
"""

from __future__ import annotations

import zlib
from array import array
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator
from functools import cached_property
from pathlib import Path
from struct import Struct
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from idlc.recordings.containers.compression import Room, decompress
from idlc.recordings.containers.file import (
    START,
    File,
    Schema,
    Topic,
    check_count,
    full_name,
    recorded_schema,
)
from idlc.recordings.containers.source import RecordingError, Source, of_file

if TYPE_CHECKING:
    from idlc.recordings.containers.messages import Messages, Window

MAGIC = b"\x89MCAP0\r\n"
HEAD = Struct("<BQ")
#: At the end of a file: the record, and the magic bytes once more.
FOOTER = Struct("<BQQQI")
INDEX_OFFSET = Struct("<HQ")
#: The head of a chunk has the name of a compression, of which none is long.
LONGEST_HEAD = 256
#: Adjacent chunks are read together up to so many bytes: few calls, and memory stays bounded.
GROUP = 1 << 24

FOOTER_OP, SCHEMA_OP, CHANNEL_OP, MESSAGE_OP, CHUNK_OP = 2, 3, 4, 5, 6
MESSAGE_INDEX_OP, CHUNK_INDEX_OP, STATISTICS_OP = 7, 8, 0x0B
SUMMARY_OFFSET_OP, DATA_END_OP = 0x0E, 0x0F


class Channel(NamedTuple):
    """A stream of messages of one topic and type."""

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

    def may_have(self, window: Window) -> bool:
        """Return whether messages of a window may be in it."""
        return self.compression is None or window.overlaps(self.first, self.last)


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


def read_schema(fields: Fields) -> Schema:
    """Read a Schema record; invalid UTF-8 is replaced, as comments may be in any encoding."""
    name, encoding = full_name(fields.name()), fields.name()
    return Schema(name, encoding, str(fields.read(fields.number(4)), "utf-8", "replace"))


def read_channel(fields: Fields) -> Channel:
    """Read a Channel record."""
    schema, topic, encoding = fields.number(2), fields.name(), fields.name()
    part, metadata = fields.part(), {}
    while part.more():
        key = part.name()
        metadata[key] = part.name()
    return Channel(schema, topic, encoding, metadata)


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


END_OF_TIME = (1 << 64) - 1
#: Bytes of a Message record before the message itself.
MESSAGE_HEAD = 22
#: The start of a message: its channel and time, with its sequence number between them.
CHANNEL_AND_TIME = Struct("<HIQ")


class Facts(msgspec.Struct):
    """The content of a file; `start` is the time of the first message.

    `counts` is by channel; so is `loose`, of messages outside of chunks in a file with a summary.
    """

    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    chunks: list[Chunk] = []
    counts: dict[int, int] = {}
    loose: dict[int, int] | None = None
    start: int | None = None
    notes: list[str] = []

    def add(self, op: int, data: memoryview) -> None:
        """Add a schema or a channel; definitions of one number must be equal."""
        if op == SCHEMA_OP:
            fields = Fields(data, "a schema")
            number, schema = fields.number(2), read_schema(fields)
            if self.schemas.setdefault(number, schema) != schema:
                raise RecordingError(f"schema {number} is defined in two ways")
        elif op == CHANNEL_OP:
            fields = Fields(data, "a channel")
            number, channel = fields.number(2), read_channel(fields)
            if self.channels.setdefault(number, channel) != channel:
                raise RecordingError(f"channel {number} is defined in two ways")

    def count(self, channel: int, messages: int, first: int) -> None:
        """Count messages of a channel, none of which came before the first time."""
        self.counts[channel] = self.counts.get(channel, 0) + messages
        if self.start is None or first < self.start:
            self.start = first


def read_facts(source: Source, index: bool = True, check: bool = False) -> Facts:
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


def _starts(source: Source, chunk: Chunk, room: Room) -> Iterator[memoryview]:
    """Yield the start of each message of a chunk, or of a stretch outside of any."""
    most = MESSAGE_HEAD + START
    if chunk.compression is None:
        for op, at, size in heads(source, chunk.at, chunk.at + chunk.size):
            if op == MESSAGE_OP:
                yield source.view(at + HEAD.size, min(size - HEAD.size, most))
        return
    head = read_chunk_head(source, chunk.at, chunk.size)
    for op, _, data in read_records(_content(source, head, room)):
        if op == MESSAGE_OP:
            yield data[:most]


def _content(source: Source, head: ChunkHead, room: Room) -> memoryview:
    """Return the records of a chunk."""
    room.reserve(head.size)
    target = memoryview(bytearray(head.size))
    decompress(source.view(head.start, head.stored), head.compression, target)
    return target


class ContradictionError(RecordingError):
    """A summary is not only incomplete but wrong, and the indexes written with it may be, too."""


def _summary(source: Source, check: bool) -> Facts:
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
    facts, statistics = Facts(), None
    for op, _, content in read_records(data):
        facts.add(op, content)
        if op == CHUNK_INDEX_OP:
            facts.chunks.append(read_chunk_index(content))
        elif op == STATISTICS_OP:
            statistics = content
    _check_summary(facts, statistics)
    _add_loose(source, facts, start)
    return facts


def _check_summary(facts: Facts, statistics: memoryview | None) -> None:
    """Add the counts of the writer; raise RecordingError if by these a summary is incomplete."""
    if statistics is None:
        raise RecordingError("its summary has no statistics")
    fields = Fields(statistics, "the statistics")
    messages, _ = fields.number(8), fields.read(2 + 4 + 4 + 4)
    chunks, start, _ = fields.number(4), fields.number(8), fields.read(8)
    part = fields.part()
    while part.more():
        number = part.number(2)
        facts.counts[number] = part.number(8)
    facts.start = start if messages else None
    if chunks != len(facts.chunks):
        raise ContradictionError("its summary names other chunks than it counts")
    if not facts.counts.keys() <= facts.channels.keys():
        raise RecordingError("its summary does not name all channels")
    needed = {channel.schema for channel in facts.channels.values() if channel.schema}
    if not needed <= facts.schemas.keys():
        raise RecordingError("its summary does not name all schemas")
    if messages != sum(facts.counts.values()):
        raise ContradictionError("its summary counts messages in two ways")


def _add_loose(source: Source, facts: Facts, start: int) -> None:
    """Add the stretches that no chunk covers and that have messages, in a file with a summary.

    Raises RecordingError if chunks overlap.
    """
    facts.chunks.sort(key=lambda chunk: chunk.at)
    walk, end = _Walk(source), len(MAGIC)
    for at, following in [
        *((chunk.at, chunk.at + chunk.size + chunk.index_size) for chunk in facts.chunks),
        (start, start),
    ]:
        if at < end:
            raise ContradictionError("its summary names chunks that are not there")
        for op, place, size in heads(source, end, at):
            if op == CHUNK_OP:
                raise ContradictionError("its summary does not name all chunks")
            if op == MESSAGE_OP:
                walk.message(place, size)
        walk.end_of_loose()
        end = following
    facts.loose = walk.facts.counts
    facts.chunks += walk.facts.chunks
    facts.chunks.sort(key=lambda chunk: chunk.at)


class _Walk:
    """A walk over all records of a file, which opens every chunk.

    Nothing else says whether a chunk has more messages than its indexes name.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.facts = Facts()
        self.loose: tuple[int, int] | None = None
        self.chunk: Chunk | None = None
        self.indexes: list[tuple[int, int]] = []
        self.room = Room(source.size)
        self.damaged = False

    def content(self, at: int, size: int) -> memoryview:
        """Return the content of a record."""
        return self.source.view(at + HEAD.size, size - HEAD.size)

    def message(self, at: int, size: int) -> None:
        """Count a message outside of any chunk, and make it part of a stretch of them."""
        data = self.source.view(at + HEAD.size, min(size - HEAD.size, CHANNEL_AND_TIME.size))
        if len(data) == CHANNEL_AND_TIME.size:
            channel, _, time = CHANNEL_AND_TIME.unpack(data)
            self.facts.count(channel, 1, time)
        if self.loose and at + size - self.loose[0] > GROUP:
            self.end_of_loose()
        start = self.loose[0] if self.loose else at
        self.loose = (start, at + size)

    def end_of_loose(self) -> None:
        """Make one stretch of the messages outside of chunks until here."""
        if self.loose:
            start, end = self.loose
            self.facts.chunks.append(Chunk(start, end - start, 0, END_OF_TIME, None, None))
            self.loose = None

    def end_of_chunk(self) -> None:
        """Add the chunk before, its messages, and its indexes if they name all of these."""
        if self.chunk is None:
            return
        head = read_chunk_head(self.source, self.chunk.at, self.chunk.size)
        named: dict[int, int] = {}
        offsets = bytearray()
        for at, size in self.indexes:
            fields = Fields(self.content(at, size), "the index of a chunk")
            channel, entries = fields.number(2), fields.number(4)
            named[channel] = named.get(channel, 0) + entries // 16
            offsets += INDEX_OFFSET.pack(channel, at)
        counts: dict[int, int] = {}
        first, last = END_OF_TIME, 0
        try:
            content = _content(self.source, head, self.room)
        except RecordingError as error:
            if not named or not named.keys() <= self.facts.channels.keys():
                raise
            # reading the topics in it reports the problem again; other topics stay readable
            if not self.damaged:
                what = f"the chunk at byte {self.chunk.at}, and perhaps others, cannot be read"
                self.facts.notes.append(f"{what}: {error.message}")
            self.damaged = True
            content, counts = memoryview(b""), named
            first, last = head.first, head.last
        for (op, _, data), _ in zip(read_records(content), self.room.records(), strict=False):
            self.facts.add(op, data)
            if op == MESSAGE_OP and len(data) >= CHANNEL_AND_TIME.size:
                channel, _, time = CHANNEL_AND_TIME.unpack_from(data)
                counts[channel] = counts.get(channel, 0) + 1
                first, last = min(first, time), max(last, time)
        for channel, messages in counts.items():
            self.facts.count(channel, messages, first)
        indexes = bytes(offsets) if counts == named else None
        chunk = self.chunk._replace(first=first, last=last, indexes=indexes)
        self.facts.chunks.append(chunk._replace(compression=head.compression))
        self.chunk, self.indexes = None, []


def _walk(source: Source, reason: str, index: bool) -> Facts:
    """Return the content by the complete records; `reason` says why the summary is not used.

    Without `index`, the indexes of chunks are not used either.
    """
    walk, ended, end = _Walk(source), False, len(MAGIC)
    for op, at, size in heads(source, end, source.size):
        end = at + size
        if op == MESSAGE_INDEX_OP and walk.chunk:
            if index:
                walk.indexes.append((at, size))
            continue
        walk.end_of_chunk()
        if op == MESSAGE_OP:
            walk.message(at, size)
        elif op == CHUNK_OP:
            walk.end_of_loose()
            walk.chunk = Chunk(at, size, 0, 0, "", None)
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


class McapFile(File):
    """An MCAP file, whose channels are topics; without `read`, nothing is read of them."""

    def __init__(
        self, place: Any, index: bool = True, check: bool = False, read: bool = True
    ) -> None:
        self.place = place
        self.check = check
        self.source = Source(place)
        self.name = self.source.name
        with of_file(self.name):
            self.facts = read_facts(self.source, index, check) if read else Facts()
        self.notes = [f"{Path(self.name).name}: {note}" for note in self.facts.notes]
        self.topics = [(self._topic(number), number) for number in self.facts.channels]

    def _topic(self, number: int) -> Topic:
        channel = self.facts.channels[number]
        schema = self.facts.schemas.get(channel.schema)
        name = schema.name if schema else ""
        if schema:
            schema = recorded_schema(name, schema.encoding, schema.text)
        count = self.facts.counts.get(number, 0)
        digest = channel.metadata.get("topic_type_hash") or None
        return Topic(channel.topic, name, count, digest, channel.encoding, schema)

    @property
    def start(self) -> int | None:
        """The time of the first message."""
        return self.facts.start

    def first_messages(self) -> Iterator[tuple[int, bytes]]:
        """Yield channels with the start of their first messages; no chunk is opened twice."""
        waiting = {channel for channel in self.facts.channels if self.facts.counts.get(channel)}
        room = Room(self.source.size)
        for chunk in self.facts.chunks:
            named = {channel for channel, _ in INDEX_OFFSET.iter_unpack(chunk.indexes or b"")}
            mine = waiting if chunk.indexes is None else waiting & named
            if not mine:
                continue
            starts = _starts(self.source, chunk, room)
            for data, _ in zip(starts, room.records(), strict=False):
                number = int.from_bytes(data[:2], "little")
                if number in mine:
                    yield number, bytes(data[MESSAGE_HEAD:])
                    mine.remove(number)
                    waiting.discard(number)
                    if not mine:
                        break

    def pieces(self, topics: Collection[int], window: Window) -> list[Chunk]:
        """Return the chunks that may hold messages of some channels, with the indexes of these."""
        mine: dict[int, bytes] = {}
        for channel in topics:
            entries = self._indexes.get(channel, ())
            for number, at in zip(entries[::2], entries[1::2], strict=True):
                mine[number] = mine.get(number, b"") + INDEX_OFFSET.pack(channel, at)
        chunks = [
            chunk._replace(indexes=mine.get(number))
            for number, chunk in enumerate(self.facts.chunks)
            if number in mine or chunk.indexes is None
        ]
        if window != (None, None):
            chunks = self._checked(chunks, topics)
        return [chunk for chunk in chunks if chunk.may_have(window)]

    @cached_property
    def _indexes(self) -> dict[int, array[int]]:
        """By channel the numbers of chunks, each followed by the offset of its MessageIndex."""
        indexes: dict[int, array[int]] = defaultdict(lambda: array("Q"))
        for number, chunk in enumerate(self.facts.chunks):
            for channel, at in INDEX_OFFSET.iter_unpack(chunk.indexes or b""):
                indexes[channel].extend((number, at))
        return indexes

    def _checked(self, chunks: list[Chunk], channels: Collection[int]) -> list[Chunk]:
        """Return chunks of some channels, without their indexes if these may be incomplete.

        Raises RecordingError if the indexes miss messages, which a window would miss, too. In
        stores that is not checked, because each index is a request there.
        """
        loose, counts = self.facts.loose, self.facts.counts
        whole = [chunk for chunk in chunks if chunk.compression is not None]
        if loose is None or not self.source.is_local:
            return chunks
        if any(chunk.indexes is None for chunk in whole):
            return [chunk._replace(indexes=None) for chunk in self.facts.chunks]
        with of_file(self.name):
            counted = sum(counts.get(number, 0) - loose.get(number, 0) for number in channels)
            name = self.facts.channels[next(iter(channels))].topic
            named = sum(
                index_entries(self.source, channel, at) // 16
                for chunk in whole
                for channel, at in INDEX_OFFSET.iter_unpack(chunk.indexes or b"")
            )
            check_count(name, counted, named)
        return chunks

    def parts(
        self, topics: Collection[int], window: Window, size: int
    ) -> Iterator[tuple[Chunk, ...]]:
        """Yield neighbours of about `size` bytes."""
        part: list[Chunk] = []
        total = 0
        for chunk in self.pieces(topics, window):
            if part and total + chunk.size > size:
                yield tuple(part)
                part, total = [], 0
            part.append(chunk)
            total += chunk.size
        if part:
            yield tuple(part)

    def messages(
        self, topics: Collection[int], pieces: Iterable[Chunk], window: Window
    ) -> Iterator[Messages]:
        """Yield the messages of some channels in some chunks, adjacent ones together."""
        from idlc.recordings.containers.messages import in_chunks

        return in_chunks(self.source, pieces, topics, window, self.check)

    def close(self) -> None:
        """Release the file."""
        self.source.close()
