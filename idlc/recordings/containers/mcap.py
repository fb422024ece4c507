"""MCAP files: their content from the summary, or from a walk over their records without one.

The summary is at the end, so a recorder that died wrote none, and other writers leave parts of it
out. It is used only if it accounts for all that its own statistics count.
"""

from __future__ import annotations

import zlib
from array import array
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from struct import Struct
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from idlc.recordings.containers import records
from idlc.recordings.containers.compression import DecompressionBudget, decompress
from idlc.recordings.containers.file import (
    START,
    Schema,
    Topic,
    full_name,
    recorded_schema,
)
from idlc.recordings.containers.records import (
    FOOTER,
    HEAD,
    INDEX_OFFSET,
    MAGIC,
    MESSAGE_HEAD,
    MESSAGE_OP,
    Chunk,
    ChunkHead,
    Fields,
    heads,
    sound_heads,
)
from idlc.recordings.containers.source import DamageError, FileSource, RecordingError, of_file
from idlc.recordings.damage import DamageList

if TYPE_CHECKING:
    from idlc.recordings.containers.messages import TopicMessages, Window

LATEST = (1 << 64) - 1
#: The start of a message: its channel and time, with its sequence number between them.
CHANNEL_AND_TIME = Struct("<HIQ")
#: An entry of an index of messages: their times, and where in the chunk they begin.
TIME_AND_PLACE = Struct("<QQ")


class Channel(NamedTuple):
    """A stream of messages of one topic and type."""

    schema: int
    topic: str
    encoding: str
    metadata: dict[str, str]


class FileStatistics(msgspec.Struct):
    """The content of a file; `start` and `end` are the times of the first and last message.

    `counts` is by channel; so is `loose`, of messages outside of chunks in a file with a summary.
    `raws` has the contents of records by their kind and number, as they were first defined. With
    `is_proven`, a checksum covers the summary; without `is_ended`, the file ends before it.
    """

    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    raws: dict[tuple[int, int], bytes] = {}
    chunks: list[Chunk] = []
    counts: dict[int, int] = {}
    loose: dict[int, int] | None = None
    start: int | None = None
    end: int | None = None
    is_proven: bool = False
    is_ended: bool = True
    notes: list[str] = []

    def add(self, op: int, data: memoryview) -> None:
        """Add a schema or a channel; definitions of one number must be equal."""
        if op == records.SCHEMA_OP:
            fields = Fields(data, "a schema")
            number, name, encoding = fields.number(2), full_name(fields.name()), fields.name()
            # comments may be in any encoding
            text = str(fields.read(fields.number(4)), "utf-8", "replace")
            schema = Schema(name, encoding, text)
            if self.schemas.setdefault(number, schema) != schema:
                raise RecordingError(f"schema {number} has two different definitions")
            self.raws.setdefault((op, number), bytes(data))
        elif op == records.CHANNEL_OP:
            fields = Fields(data, "a channel")
            number, schema_number = fields.number(2), fields.number(2)
            topic, encoding, part, metadata = fields.name(), fields.name(), fields.part(), {}
            while part.more():
                key = part.name()
                metadata[key] = part.name()
            channel = Channel(schema_number, topic, encoding, metadata)
            if self.channels.setdefault(number, channel) != channel:
                raise RecordingError(f"channel {number} has two different definitions")
            self.raws.setdefault((op, number), bytes(data))

    def count(self, channel: int, messages: int, first: int, last: int) -> None:
        """Count messages of a channel, none of which is outside of these times."""
        self.counts[channel] = self.counts.get(channel, 0) + messages
        self.start = first if self.start is None else min(first, self.start)
        self.end = last if self.end is None else max(last, self.end)


def read_facts(
    source: FileSource, damage: DamageList, index: bool = True, check: bool | None = None
) -> FileStatistics:
    """Return the content of a file; without `index`, its summary is not used.

    Chunks with a wrong checksum are left out unless `check` is False.
    """
    if source.size < len(MAGIC) or source.view(0, len(MAGIC)) != MAGIC:
        raise RecordingError(f"`{source.name}` is not an MCAP file: it begins with other bytes")
    reason = "idlc does not use its index"
    if index:
        try:
            return _summary(source)
        except DamageError as error:
            reason = error.message
    return _walk(_Walk(source, damage, check), reason, index)


def _starts(source: FileSource, chunk: Chunk, room: DecompressionBudget) -> Iterator[memoryview]:
    """Yield the start of each message of a chunk, or of a stretch outside of any."""
    most = MESSAGE_HEAD.size + START
    if chunk.compression is None:
        for op, at, size in heads(source, chunk.at, chunk.at + chunk.size):
            if op == MESSAGE_OP:
                yield source.view(at + HEAD.size, min(size - HEAD.size, most))
        return
    head = records.read_chunk_head(source, chunk.at, chunk.size)
    for op, _, data in records.read_records(_content(source, head, room)):
        if op == MESSAGE_OP:
            yield data[:most]


def _sizes(
    source: FileSource, chunk: Chunk, room: DecompressionBudget
) -> Iterator[tuple[int, int]]:
    """Yield channel and size of each message of a chunk, or of a stretch outside of any."""
    if chunk.compression is None:
        for op, at, size in heads(source, chunk.at, chunk.at + chunk.size):
            if op == MESSAGE_OP:
                channel = int.from_bytes(source.view(at + HEAD.size, 2), "little")
                yield channel, size - HEAD.size - MESSAGE_HEAD.size
        return
    head = records.read_chunk_head(source, chunk.at, chunk.size)
    for op, _, data in records.read_records(_content(source, head, room)):
        if op == MESSAGE_OP:
            yield int.from_bytes(data[:2], "little"), len(data) - MESSAGE_HEAD.size


def _content(source: FileSource, head: ChunkHead, room: DecompressionBudget) -> memoryview:
    """Return the records of a chunk."""
    room.reserve(head.size)
    target = memoryview(bytearray(head.size))
    decompress(source.view(head.start, head.stored), head.compression, target)
    return target


def _summary(source: FileSource) -> FileStatistics:
    """Return the content by the summary; raise DamageError if that is not reliable."""
    end = source.size - FOOTER.size - len(MAGIC)
    if end < len(MAGIC) or source.view(source.size - len(MAGIC), len(MAGIC)) != MAGIC:
        raise DamageError("it was not closed")
    op, size, start, _, crc = FOOTER.unpack(source.view(end, FOOTER.size))
    if (op, size) != (records.FOOTER_OP, FOOTER.size - HEAD.size):
        raise DamageError("it has no footer")
    if not len(MAGIC) <= start <= end:
        raise DamageError("it has no summary")
    data = source.view(start, source.size - len(MAGIC) - 4 - start)
    if crc and zlib.crc32(data) != crc:
        raise DamageError("the checksum of its summary is wrong")
    facts, statistics = FileStatistics(is_proven=crc != 0), None
    for op, _, content in records.read_records(data[: end - start]):
        facts.add(op, content)
        if op == records.CHUNK_INDEX_OP:
            facts.chunks.append(records.read_chunk_index(content))
        elif op == records.STATISTICS_OP:
            statistics = content
    _check_summary(facts, statistics)
    _add_loose(source, facts, start)
    return facts


def _check_summary(facts: FileStatistics, statistics: memoryview | None) -> None:
    """Add the counts of the writer; raise DamageError if by these a summary is incomplete."""
    if statistics is None:
        raise DamageError("its summary has no statistics")
    fields = Fields(statistics, "the statistics")
    messages, _ = fields.number(8), fields.read(2 + 4 + 4 + 4)
    chunks, first, last = fields.number(4), fields.number(8), fields.number(8)
    part = fields.part()
    while part.more():
        number = part.number(2)
        facts.counts[number] = part.number(8)
    if messages:
        facts.start, facts.end = first, last
    if chunks != len(facts.chunks):
        raise DamageError("its summary names other chunks than it counts")
    if not facts.counts.keys() <= facts.channels.keys():
        raise DamageError("its summary does not name all channels")
    needed = {channel.schema for channel in facts.channels.values() if channel.schema}
    if not needed <= facts.schemas.keys():
        raise DamageError("its summary does not name all schemas")
    if messages != sum(facts.counts.values()):
        raise DamageError("its summary contains two different message counts")


def _add_loose(source: FileSource, facts: FileStatistics, start: int) -> None:
    """Add the stretches that no chunk covers and that have messages, in a file with a summary.

    Raises DamageError if chunks overlap.
    """
    facts.chunks.sort(key=lambda chunk: chunk.at)
    walk, end = _Walk(source, DamageList(source.name), False), len(MAGIC)
    ranges = [(chunk.at, chunk.at + chunk.size + chunk.index_size) for chunk in facts.chunks]
    for at, following in (*ranges, (start, start)):
        if at < end:
            raise DamageError("its summary lists chunks that do not exist")
        for op, place, size in heads(source, end, at):
            if op == records.CHUNK_OP:
                raise DamageError("its summary does not name all chunks")
            if op == MESSAGE_OP:
                walk.message(place, size)
            end = place + size
        if end != at:
            raise DamageError("its records do not lead to its summary")
        walk.end_of_loose()
        end = following
    facts.loose = walk.facts.counts
    facts.chunks += walk.facts.chunks
    facts.chunks.sort(key=lambda chunk: chunk.at)


class _Walk:
    """A walk over all records of a file, which opens every chunk.

    Nothing else says whether a chunk has more messages than its indexes name.
    """

    def __init__(self, source: FileSource, damage: DamageList, check: bool | None) -> None:
        self.source = source
        self.damage = damage
        self.check = check
        self.facts = FileStatistics()
        self.loose: tuple[int, int] | None = None
        self.chunk: tuple[int, int] | None = None
        self.indexes: list[tuple[int, int]] = []
        self.room = DecompressionBudget(source.size)
        self.conflicts: list[tuple[RecordingError, int, int]] = []

    def content(self, at: int, size: int) -> memoryview:
        """Return the content of a record."""
        return self.source.view(at + HEAD.size, size - HEAD.size)

    def define(
        self,
        op: int,
        data: memoryview,
        start: int,
        stop: int,
        *,
        is_proven: bool = False,
        is_repeated: bool = False,
    ) -> None:
        """Add a schema or a channel, unless it is damaged.

        A checksum covers one that `is_proven`; one that `is_repeated` is in a summary.
        """
        try:
            self.facts.add(op, data)
        except DamageError as error:
            self.damage.add(error.message, start, stop)
        except RecordingError as error:
            if is_proven:
                raise
            if not is_repeated:
                self.conflicts.append((error, start, stop))

    def end(self) -> None:
        """Add the last messages, and definitions that contradict others if there is damage."""
        self.end_of_chunk()
        self.end_of_loose()
        for error, start, stop in self.conflicts:
            if not self.damage:
                raise error
            self.damage.add(error.message, start, stop)

    def message(self, at: int, size: int) -> None:
        """Count a message outside of any chunk, and make it part of a stretch of them."""
        data = self.source.view(at + HEAD.size, CHANNEL_AND_TIME.size)
        channel, _, time = CHANNEL_AND_TIME.unpack(data)
        self.facts.count(channel, 1, time, time)
        if self.loose and (at != self.loose[1] or at + size - self.loose[0] > records.GROUP):
            self.end_of_loose()
        start = self.loose[0] if self.loose else at
        self.loose = (start, at + size)

    def end_of_loose(self) -> None:
        """Make one stretch of the messages outside of chunks until here."""
        if self.loose:
            start, end = self.loose
            self.facts.chunks.append(Chunk(start, end - start, 0, LATEST, None, None))
            self.loose = None

    def end_of_chunk(self) -> None:
        """Add the chunk before, its messages, and its indexes if they name all of these."""
        if self.chunk is None:
            return
        (at, size), self.chunk = self.chunk, None
        named, offsets = self._named()
        try:
            head = records.read_chunk_head(self.source, at, size)
        except DamageError as error:
            self.damage.add(error.message, at, at + size, messages=sum(named.values()) or None)
            return
        counts: dict[int, int] = {}
        first, last = LATEST, 0
        try:
            try:
                content = _content(self.source, head, self.room)
            except DamageError:
                proven = records.proven_head(self.source, head)
                if proven is None:
                    raise
                content = _content(self.source, proven, self.room)
            if self.check is not False and head.crc and zlib.crc32(content) != head.crc:
                raise DamageError("the checksum of a chunk is wrong")
            every = zip(records.read_records(content), self.room.records(), strict=False)
            for (op, _, data), _ in every:
                if op != MESSAGE_OP:
                    self.define(op, data, at, at + size, is_proven=head.crc != 0)
                elif len(data) >= CHANNEL_AND_TIME.size:
                    channel, _, time = CHANNEL_AND_TIME.unpack_from(data)
                    counts[channel] = counts.get(channel, 0) + 1
                    first, last = min(first, time), max(last, time)
        except DamageError as error:
            # without a checksum, the messages before the damage are as good as any
            messages = sum(named.values()) - sum(counts.values()) if named else None
            times = head.first, head.last
            self.damage.add(error.message, at, at + size, messages=messages, times=times)
        for channel, messages in counts.items():
            self.facts.count(channel, messages, first, last)
        indexes = bytes(offsets) if counts == named else None
        if counts:
            self.facts.chunks.append(Chunk(at, size, first, last, head.compression, indexes))

    def _named(self) -> tuple[dict[int, int], bytes]:
        """Return the numbers of messages that the indexes of a chunk name, and their places."""
        indexes, self.indexes = self.indexes, []
        named: dict[int, int] = {}
        offsets = bytearray()
        for place, length in indexes:
            fields = Fields(self.content(place, length), "the index of a chunk")
            channel, entries = fields.number(2), fields.number(4)
            named[channel] = named.get(channel, 0) + entries // 16
            offsets += INDEX_OFFSET.pack(channel, place)
        return named, bytes(offsets)


def _walk(walk: _Walk, reason: str, index: bool) -> FileStatistics:
    """Return the content by the complete records; `reason` says why the summary is not used.

    Without `index`, the indexes of chunks are not used either.
    """
    source, ended, end = walk.source, False, len(MAGIC)
    skipped: list[tuple[int, int]] = []
    every = sound_heads(source, end, source.size, lambda *part: skipped.append(part))
    for op, at, size in every:
        end = at + size
        if op == records.MESSAGE_INDEX_OP and walk.chunk:
            if index:
                walk.indexes.append((at, size))
            continue
        walk.end_of_chunk()
        if op == MESSAGE_OP:
            walk.message(at, size)
        elif op == records.CHUNK_OP:
            walk.end_of_loose()
            walk.chunk = at, size
        elif op in (records.SCHEMA_OP, records.CHANNEL_OP):
            walk.define(op, walk.content(at, size), at, end, is_repeated=ended)
        # a summary follows, and nothing keeps a writer from going on
        ended = op == records.DATA_END_OP or (ended and op not in (MESSAGE_OP, records.CHUNK_OP))
    for start, stop in skipped:
        if stop < source.size:
            walk.damage.add("there are no records", start, stop)
        elif not ended:
            walk.damage.add("the end of the file is not a whole record", start, stop)
    walk.end()
    for number in walk.facts.counts.keys() - walk.facts.channels.keys():
        what = f"the definition of channel {number} is missing"
        walk.damage.add(what, messages=walk.facts.counts.pop(number))
    walk.facts.is_ended = ended
    left = source.size - end
    rest = f", {left:,} bytes are skipped" if left else ""
    extent = "from its records" if ended else f"to its last whole record{rest}"
    walk.facts.notes.append(f"{reason}: read {extent}")
    return walk.facts


class McapFile:
    """An MCAP file, whose channels are topics; without `read`, nothing is read of them.

    `check` compares the checksums of chunks: None does so once there is damage. A `strict` file
    raises RecordingError for damage.
    """

    def __init__(
        self,
        place: Any,
        index: bool = True,
        check: bool | None = None,
        read: bool = True,
        strict: bool = False,
    ) -> None:
        self.place = place
        self.check = check
        self.source = FileSource(place)
        self.name = self.source.name
        self.size = self.source.size
        self.damage = DamageList(self.name, strict)
        with of_file(self.name):
            facts = read_facts(self.source, self.damage, index, check) if read else FileStatistics()
        self.facts = facts
        self.start, self.end = facts.start, facts.end
        self.notes = [f"{Path(self.name).name}: {note}" for note in facts.notes]
        self.topics: list[tuple[Topic, int]] = []
        for number, channel in facts.channels.items():
            schema, count = facts.schemas.get(channel.schema), facts.counts.get(number, 0)
            kind, recorded = (schema.name, recorded_schema(schema)) if schema else ("", None)
            digest = channel.metadata.get("topic_type_hash") or None
            qos = channel.metadata.get("offered_qos_profiles", "")
            topic = Topic(channel.topic, kind, count, digest, channel.encoding, recorded, qos)
            self.topics.append((topic, number))

    def first_messages(self) -> Iterator[tuple[int, bytes]]:
        """Yield channels with the start of their first messages; no chunk is opened twice."""
        waiting = {channel for channel in self.facts.channels if self.facts.counts.get(channel)}
        room = DecompressionBudget(self.source.size)
        for chunk in self.facts.chunks:
            named = {channel for channel, _ in INDEX_OFFSET.iter_unpack(chunk.indexes or b"")}
            mine = waiting if chunk.indexes is None else waiting & named
            if not mine:
                continue
            starts = _starts(self.source, chunk, room)
            with suppress(DamageError):  # reading the messages says what is wrong
                for data, _ in zip(starts, room.records(), strict=False):
                    number = int.from_bytes(data[:2], "little")
                    if number in mine:
                        yield number, bytes(data[MESSAGE_HEAD.size :])
                        mine.remove(number)
                        waiting.discard(number)
                        if not mine:
                            break

    def sizes(self) -> dict[int, int] | None:
        """Return the bytes of the messages of each channel; None if not all chunks are indexed.

        The indexes of a chunk say where its messages begin. What is between them is more than a
        message only where a channel is defined, so the chunks with first messages are opened.
        """
        sizes: dict[int, int] = {}
        seen: set[int] = set()
        room = DecompressionBudget(self.source.size)
        for chunk in self.facts.chunks:
            starts: list[tuple[int, int]] = []
            for channel, at in INDEX_OFFSET.iter_unpack(chunk.indexes or b""):
                entries = records.index_entries(self.source, channel, at)
                data = self.source.view(at + HEAD.size + 6, entries)
                starts += [(place, channel) for _, place in TIME_AND_PLACE.iter_unpack(data)]
            new = {channel for _, channel in starts} - seen
            if chunk.compression is not None and chunk.indexes is None:
                return None
            if new or chunk.compression is None:
                seen |= new
                for channel, size in _sizes(self.source, chunk, room):
                    sizes[channel] = sizes.get(channel, 0) + size
                continue
            head = records.read_chunk_head(self.source, chunk.at, chunk.size)
            starts.sort()
            ends = [*(place for place, _ in starts[1:]), head.size]
            for (place, channel), end in zip(starts, ends, strict=True):
                size = end - place - HEAD.size - MESSAGE_HEAD.size
                sizes[channel] = sizes.get(channel, 0) + size
        return sizes

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
        if window != (None, None) or not self.facts.is_proven:
            chunks = self._checked(chunks, topics)
        return [
            chunk
            for chunk in chunks
            if chunk.compression is None or window.overlaps(chunk.first, chunk.last)
        ]

    @cached_property
    def _indexes(self) -> dict[int, array[int]]:
        """By channel the numbers of chunks, each followed by the offset of its MessageIndex."""
        indexes: dict[int, array[int]] = defaultdict(lambda: array("Q"))
        for number, chunk in enumerate(self.facts.chunks):
            for channel, at in INDEX_OFFSET.iter_unpack(chunk.indexes or b""):
                indexes[channel].extend((number, at))
        return indexes

    def _checked(self, chunks: list[Chunk], channels: Collection[int]) -> list[Chunk]:
        """Return chunks of some channels; all, without their indexes, if these are not complete.

        A window would miss the same messages as its index. In stores that is not checked, because
        each index is a request there.
        """
        loose, counts = self.facts.loose, self.facts.counts
        whole = [chunk for chunk in chunks if chunk.compression is not None]
        if loose is None or not self.source.is_local:
            return chunks
        counted = sum(counts.get(number, 0) - loose.get(number, 0) for number in channels)
        if all(chunk.indexes is not None for chunk in whole):
            with suppress(DamageError):
                named = sum(
                    records.index_entries(self.source, channel, at) // 16
                    for chunk in whole
                    for channel, at in INDEX_OFFSET.iter_unpack(chunk.indexes or b"")
                )
                if named == counted:
                    return chunks
        return [chunk._replace(indexes=None) for chunk in self.facts.chunks]

    def parts(
        self, topics: Collection[int], window: Window, size: int
    ) -> Iterator[tuple[Chunk, ...]]:
        """Yield neighbours of about `size` bytes."""
        pieces = self.pieces(topics, window)
        return map(tuple, records.grouped(pieces, lambda chunk: chunk.size, size))

    def messages(
        self, topics: Collection[int], pieces: Iterable[Any], window: Window
    ) -> Iterator[TopicMessages]:
        """Yield the messages of some channels in some chunks, adjacent ones together."""
        from idlc.recordings.containers.mcap_messages import in_chunks

        return in_chunks(self.source, pieces, topics, window, self.check, self.damage)

    def close(self) -> None:
        """Release the file."""
        self.source.close()
