"""What is in an MCAP file: from its summary, or from a walk over its records where that has none.

The summary is at the end, so a recorder that died wrote none, and other writers leave parts of it
out. It is believed only if it accounts for all that its own statistics count.
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from struct import Struct

from idlc.recordings import mcap_records as mcap
from idlc.recordings.compression import Room, decompress
from idlc.recordings.encapsulation import START
from idlc.recordings.errors import RecordingError
from idlc.recordings.mcap_records import HEAD, MAGIC, Channel, Chunk, McapSchema
from idlc.recordings.source import Source

END_OF_TIME = (1 << 64) - 1
#: Bytes of a Message record before the message itself.
MESSAGE_HEAD = 22
#: How a message begins: with its sequence number between them.
CHANNEL_AND_TIME = Struct("<HIQ")


@dataclass
class McapFacts:
    """What a file holds; `start` is when the first message came.

    `counts` is by channel; so is `loose`, of messages outside of chunks in a file with a summary.
    """

    schemas: dict[int, McapSchema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[Chunk] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    loose: dict[int, int] | None = None
    start: int | None = None
    notes: list[str] = field(default_factory=list)

    def add(self, op: int, data: memoryview) -> None:
        """Take note of a schema or a channel; those of one id must be the same."""
        if op == mcap.SCHEMA_OP:
            schema = mcap.schema(data)
            if self.schemas.setdefault(schema.id, schema) != schema:
                raise RecordingError(f"schema {schema.id} is defined in two ways")
        elif op == mcap.CHANNEL_OP:
            channel = mcap.channel(data)
            if self.channels.setdefault(channel.id, channel) != channel:
                raise RecordingError(f"channel {channel.id} is defined in two ways")


def read_facts(source: Source, index: bool = True, check: bool = False) -> McapFacts:
    """Return what a file holds; without `index`, whatever its summary says.

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
    """Yield channels with how their first messages begin; each chunk is opened at most once."""
    waiting = {one for one in channels if facts.counts.get(one)}
    room = Room(source.size)
    for chunk in facts.chunks:
        named = {channel for channel, _ in mcap.INDEX_OFFSET.iter_unpack(chunk.indexes or b"")}
        mine = waiting if chunk.indexes is None else waiting & named
        if not mine:
            continue
        for data, _ in zip(_contents(source, chunk, room), room.each(), strict=False):
            number = int.from_bytes(data[:2], "little")
            if number in mine:
                yield number, bytes(data[MESSAGE_HEAD:])
                mine.remove(number)
                waiting.discard(number)
                if not mine:
                    break


def _contents(source: Source, chunk: Chunk, room: Room) -> Iterator[memoryview]:
    """Yield how each message of a chunk, or of a stretch outside of any, begins."""
    most = MESSAGE_HEAD + START
    if chunk.compression is None:
        for op, at, size in mcap.heads(source, chunk.at, chunk.at + chunk.size):
            if op == mcap.MESSAGE_OP:
                yield source.view(at + HEAD.size, min(size - HEAD.size, most))
        return
    for op, _, data in mcap.records(_content(source, chunk, room)):
        if op == mcap.MESSAGE_OP:
            yield data[:most]


def _content(source: Source, chunk: Chunk, room: Room) -> memoryview:
    """Return the records of a chunk."""
    head = mcap.chunk_head(source, chunk.at, chunk.size)
    room.take(head.size)
    target = memoryview(bytearray(head.size))
    decompress(source.view(head.start, head.stored), head.compression, target)
    return target


class ContradictionError(RecordingError):
    """A summary is not only incomplete but wrong, and what was written with it may be, too."""


def _summary(source: Source, check: bool) -> McapFacts:
    """Return what the summary says; raise RecordingError if it is not to be relied on."""
    end = source.size - mcap.FOOTER.size - len(MAGIC)
    if end < len(MAGIC) or source.view(source.size - len(MAGIC), len(MAGIC)) != MAGIC:
        raise RecordingError("it was not closed")
    op, size, start, _, crc = mcap.FOOTER.unpack(source.view(end, mcap.FOOTER.size))
    if (op, size) != (mcap.FOOTER_OP, mcap.FOOTER.size - HEAD.size):
        raise RecordingError("it has no footer")
    if not len(MAGIC) <= start <= end:
        raise RecordingError("it has no summary")
    data = source.view(start, end - start)
    if check and crc:
        covered = source.view(start, source.size - len(MAGIC) - 4 - start)
        if zlib.crc32(covered) != crc:
            raise ContradictionError("the checksum of its summary is wrong")
    facts, statistics = McapFacts(), None
    for op, _, content in mcap.records(data):
        facts.add(op, content)
        if op == mcap.CHUNK_INDEX_OP:
            facts.chunks.append(mcap.chunk_index(content))
        elif op == mcap.STATISTICS_OP:
            statistics = mcap.statistics(content)
    _believe(facts, statistics)
    _add_loose(source, facts, start)
    return facts


def _believe(facts: McapFacts, statistics: mcap.Statistics | None) -> None:
    """Raise RecordingError if a summary leaves something out, by its own count."""
    if statistics is None:
        raise RecordingError("its summary has no statistics")
    if statistics.chunks != len(facts.chunks):
        raise ContradictionError("its summary names other chunks than it counts")
    if not statistics.counts.keys() <= facts.channels.keys():
        raise RecordingError("its summary does not name all channels")
    if any(one.schema and one.schema not in facts.schemas for one in facts.channels.values()):
        raise RecordingError("its summary does not name all schemas")
    if statistics.messages != sum(statistics.counts.values()):
        raise ContradictionError("its summary counts messages in two ways")
    facts.counts = statistics.counts
    facts.start = statistics.start if statistics.messages else None


def _add_loose(source: Source, facts: McapFacts, start: int) -> None:
    """Add the stretches that no chunk covers and that have messages, in a file with a summary.

    Raises RecordingError if the chunks are not where there is room for them.
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
    for op, place, size in mcap.heads(source, at, end):
        if op == mcap.CHUNK_OP:
            raise ContradictionError("its summary does not name all chunks")
        if op == mcap.MESSAGE_OP:
            first, last = place if first is None else first, place + size
            number = int.from_bytes(source.view(place + mcap.HEAD.size, min(2, size)), "little")
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
        """Return what a record holds."""
        return self.source.view(at + HEAD.size, size - HEAD.size)

    def count(self, channel: int, messages: int, first: int) -> None:
        """Count messages of a channel, none of which came before the first time."""
        counts = self.facts.counts
        counts[channel] = counts.get(channel, 0) + messages
        if self.facts.start is None or first < self.facts.start:
            self.facts.start = first

    def message(self, at: int, size: int) -> None:
        """Take note of a message outside of any chunk."""
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
        """Take note of a chunk."""
        head = mcap.chunk_head(self.source, at, size)
        self.last = Chunk(at, size, head.first, head.last, head.compression, None)

    def index(self, at: int, size: int) -> None:
        """Take note of the index of one channel in the chunk before it."""
        fields = mcap.Fields(self.content(at, size), "the index of a chunk")
        channel, entries = fields.number(2), fields.number(4)
        self.entries[channel] = self.entries.get(channel, 0) + entries // 16
        self.offsets += mcap.INDEX_OFFSET.pack(channel, at)

    def end_of_chunk(self) -> None:
        """Take note of what is in the chunk before, and of its indexes if they name all of it."""
        if self.last is None:
            return
        counts: dict[int, int] = {}
        first, last = END_OF_TIME, 0
        try:
            content = _content(self.source, self.last, self.room)
        except RecordingError as error:
            if not self.entries or not self.entries.keys() <= self.facts.channels.keys():
                raise
            # reading the topics that it holds says so again; the others are not lost with them
            if not self.damaged:
                what = f"the chunk at byte {self.last.at}, and perhaps others, cannot be read"
                self.facts.notes.append(f"{what}: {error.message}")
            self.damaged = True
            content, counts = memoryview(b""), self.entries
            first, last = self.last.first, self.last.last
        for (op, _, data), _ in zip(mcap.records(content), self.room.each(), strict=False):
            self.facts.add(op, data)
            if op == mcap.MESSAGE_OP and len(data) >= CHANNEL_AND_TIME.size:
                channel, _, time = CHANNEL_AND_TIME.unpack_from(data)
                counts[channel] = counts.get(channel, 0) + 1
                first, last = min(first, time), max(last, time)
        for channel, messages in counts.items():
            self.count(channel, messages, first)
        indexes = bytes(self.offsets) if counts == self.entries else None
        self.facts.chunks.append(self.last._replace(first=first, last=last, indexes=indexes))
        self.last, self.offsets, self.entries = None, bytearray(), {}


def _walk(source: Source, reason: str, index: bool) -> McapFacts:
    """Return what the whole records of a file say; `reason` is why its summary is not used.

    Without `index`, those of chunks are not used either.
    """
    walk, ended, end = _Walk(source, index), False, len(MAGIC)
    for op, at, size in mcap.heads(source, end, source.size):
        end = at + size
        if op == mcap.MESSAGE_INDEX_OP and walk.last:
            if walk.uses_index:
                walk.index(at, size)
            continue
        walk.end_of_chunk()
        if op == mcap.MESSAGE_OP:
            walk.message(at, size)
        elif op == mcap.CHUNK_OP:
            walk.end_of_loose()
            walk.chunk(at, size)
        elif op in (mcap.SCHEMA_OP, mcap.CHANNEL_OP):
            walk.facts.add(op, walk.content(at, size))
        # a summary follows, and nothing keeps a writer from going on
        ended = op == mcap.DATA_END_OP or (ended and op not in (mcap.MESSAGE_OP, mcap.CHUNK_OP))
        if op == mcap.FOOTER_OP:
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
