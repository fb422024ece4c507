"""An MCAP file with topics of other types: chunks without these are copied as they are compressed.

Definitions may be anywhere in a chunk, so all are decompressed, and their messages indexed anew.
"""

from __future__ import annotations

import zlib
from bisect import bisect_left
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from struct import Struct
from typing import Any, BinaryIO, TypeAlias

import numpy as np

from idlc.recordings.containers import compression, mcap_writer, records
from idlc.recordings.containers.conversion import (
    Conversion,
    Conversions,
    DefinitionKey,
    Recorded,
    RewrittenTopic,
    RewrittenTopics,
    check,
    converted,
    definition_key,
    selected,
)
from idlc.recordings.containers.file import Schema, full_name, wrong_count
from idlc.recordings.containers.mcap import FileStatistics, read_facts
from idlc.recordings.containers.mcap_messages import MESSAGE, indexed_messages
from idlc.recordings.containers.messages import Raw
from idlc.recordings.containers.records import (
    CHANNEL_OP,
    FOOTER,
    HEAD,
    MAGIC,
    MESSAGE_OP,
    SCHEMA_OP,
    Chunk,
    ChunkHead,
    Fields,
    heads,
    sound_heads,
)
from idlc.recordings.containers.source import DamageError, FileSource, RecordingError, of_file
from idlc.recordings.damage import DamageList

#: Numbers of schemas end before.
MOST_SCHEMAS = 1 << 16
#: The key of a channel's metadata that has the hash of its type.
HASH = b"topic_type_hash"
#: What is made anew.
DERIVED = {
    *(records.MESSAGE_INDEX_OP, records.CHUNK_INDEX_OP, records.ATTACHMENT_INDEX_OP),
    *(records.METADATA_INDEX_OP, records.STATISTICS_OP, records.SUMMARY_OFFSET_OP),
    records.DATA_END_OP,
}
#: Attachments are copied by so many bytes.
BLOCK = 1 << 20


class _UnlistedError(Exception):
    """A summary does not list all definitions."""


class RewritePlan:
    """The definitions that take the place of others."""

    def __init__(
        self, facts: FileStatistics, conversions: Conversions, recorded: dict[str, Recorded]
    ) -> None:
        self.changed: dict[int, Conversion] = {}
        for number, channel_ in facts.channels.items():
            definition = facts.schemas.get(channel_.schema)
            conversion = selected(conversions, channel_.topic, _key(definition))
            if conversion is not None:
                self.changed[number] = conversion
        self._check(facts, recorded)
        #: By kind and number: contents of records.
        self.contents = dict(facts.raws)
        #: By channel, for those that change.
        self.schemas: dict[int, int] = {}
        users = {number: own.schema for number, own in facts.channels.items()}
        numbers = {own: number for number, own in reversed(facts.schemas.items())}
        new = {
            number: Schema(full_name(own.type), own.encoding, own.definition)
            for number, own in self.changed.items()
        }
        kept = {own for number, own in users.items() if number not in new}
        kept |= {numbers[own] for own in new.values() if own in numbers}
        taken = {*facts.schemas, *users.values()}
        unused = (number for number in range(1, MOST_SCHEMAS) if number not in taken)
        for number, own in new.items():
            if own not in numbers:
                was = users[number]
                numbers[own] = was if was and was not in kept else next(unused, 0)
                if not numbers[own]:
                    raise RecordingError("it has no number for another schema")
                kept.add(numbers[own])
                content = mcap_writer.schema(numbers[own], own.name, own.encoding, own.text)
                self.contents[SCHEMA_OP, numbers[own]] = content
            self.schemas[number] = numbers[own]
            raw, digest = facts.raws[CHANNEL_OP, number], self.changed[number].type_hash
            self.contents[CHANNEL_OP, number] = _retyped(raw, numbers[own], digest)
        #: The schemas that no channel refers to anymore.
        self.gone = {users[number] for number in new} - kept

    def _check(self, facts: FileStatistics, recorded: dict[str, Recorded]) -> None:
        for number, conversion in self.changed.items():
            own = facts.channels[number]
            definition = facts.schemas.get(own.schema)
            kind = definition.name if definition else ""
            check(own.topic, own.encoding, (kind, definition), conversion, recorded)


def _key(definition: Schema | None) -> DefinitionKey:
    """Return the key of a channel's definition."""
    return definition_key(definition.name if definition else "", definition)


def _retyped(raw: bytes, schema_number: int, digest: str) -> bytes:
    """Return the content of a channel's record with another type."""
    fields = Fields(memoryview(raw), "a channel")
    number, _ = fields.number(2), fields.number(2)
    topic, encoding = bytes(fields.part().data), bytes(fields.part().data)
    part, metadata = fields.part(), dict[bytes, bytes]()
    while part.more():
        key = bytes(part.part().data)
        metadata[key] = bytes(part.part().data)
    metadata[HASH] = digest.encode()
    if not digest:
        del metadata[HASH]
    return mcap_writer.channel(number, schema_number, topic, encoding, metadata)


#: A part of records, from one offset to another, and what takes its place.
BytesEdit: TypeAlias = tuple[int, int, bytes]


class Rewriting:
    """One pass over a file; `room` bounds what is decompressed."""

    def __init__(
        self,
        source: FileSource,
        facts: FileStatistics,
        plan: RewritePlan,
        write: Callable[[Raw], object],
        damage: DamageList,
    ) -> None:
        self.source = source
        self.facts = facts
        self.damage = damage
        self.plan = plan
        self.room = compression.DecompressionBudget(source.size)
        #: The schemas that are defined outside of chunks.
        self.known: set[int] = set()
        self.writer = mcap_writer.McapWriter(write, _has_checksum(source))

    def run(self, progress: Callable[[int], object]) -> None:
        """Write the whole file."""
        start = end = len(MAGIC)
        ended = False
        first = next(heads(self.source, start, self.source.size), None)
        if first is None or first[0] != records.HEADER_OP:
            self.writer.write(mcap_writer.record(records.HEADER_OP, bytes(8)))
        for op, at, size in sound_heads(self.source, end, self.source.size, self._skip):
            progress(at)
            is_loose = op == MESSAGE_OP or (op in (SCHEMA_OP, CHANNEL_OP) and not ended)
            is_next = is_loose and at == end
            if start < end and (not is_next or at + size - start > records.GROUP):
                self._loose(start, end)
                start = end = at
            if is_loose:
                start, end = (start if start < end else at), at + size
                continue
            if op == records.FOOTER_OP:
                if self.facts.loose is None:  # as a walk ends; a summary is at the end anyway
                    break
                continue
            ended |= op == records.DATA_END_OP
            self._record(op, at, size)
        if start < end:
            self._loose(start, end)
        for number in self.facts.channels:
            self._define(CHANNEL_OP, number)
        for number in self.facts.schemas:
            self._define(SCHEMA_OP, number)
        self.writer.close()
        progress(self.source.size)

    def check(self, facts: FileStatistics) -> None:
        """Add it to the damage if other numbers of messages were written than are counted."""
        if self.damage:
            return
        for number, own in facts.channels.items():
            counted, count = facts.counts.get(number, 0), self.writer.counts.get(number, 0)
            if counted != count:
                self.damage.add(wrong_count(own.topic, counted, count))

    def topics(self) -> RewrittenTopics:
        """Return the fate of each definition of each topic."""
        topics: RewrittenTopics = {}
        for number, own in self.facts.channels.items():
            count, size = (by.get(number, 0) for by in (self.writer.counts, self.writer.sizes))
            key = own.topic, _key(self.facts.schemas.get(own.schema))
            change = self.plan.changed.get(number)
            is_converted = bool(change and change.convert)
            topics[key] = topics.get(key, RewrittenTopic()).plus(count, size, is_converted)
        return topics

    def _record(self, op: int, at: int, size: int) -> None:
        """Write a record that is by itself, unless it is damaged."""
        try:
            if op == records.CHUNK_OP:
                self._chunk(at, size)
            elif op not in (*DERIVED, SCHEMA_OP, CHANNEL_OP):
                self._other(op, at, size)
        except DamageError as error:
            self.damage.add(error.message, at, at + size)

    def _skip(self, start: int, stop: int) -> None:
        """Write the chunks that a summary lists in a part without records.

        Without any, the part is damage, unless it is the end of a summary.
        """
        first, last = (bisect_left(self._places, at) for at in (start, stop))
        for at in self._places[first:last]:
            size = self._chunks[at].size
            try:
                self._chunk(at, size, is_proof_needed=True)
            except DamageError as error:
                self.damage.add(error.message, at, at + size)
        if first < last:
            return
        if stop < self.source.size or not self.facts.is_ended:
            self.damage.add("there are no records", start, stop)

    def _loose(self, start: int, end: int) -> None:
        """Write records outside of chunks."""
        self._check_size(end - start)
        content = mcap_writer.Content(self.source.view(start, end - start), self.room)
        self._define_channels(content)
        edits = self._edits(content, self.known)
        self.writer.add(mcap_writer.Content(_edited(content.data, edits)) if edits else content)

    def _decompressed(self, head: ChunkHead) -> tuple[memoryview, memoryview]:
        """Return the content of a chunk as it is stored, and decompressed."""
        self.room.reserve(max(head.size, head.stored))
        stored = self.source.view(head.start, head.stored)
        if not head.compression and head.size == head.stored:
            return stored, stored
        data = memoryview(bytearray(head.size))
        compression.decompress(stored, head.compression, data)
        return stored, data

    def _chunk(self, at: int, size: int, is_proof_needed: bool = False) -> None:
        """Write a chunk, compressed anew only if something in it changes."""
        head = records.read_chunk_head(self.source, at, size)
        if is_proof_needed and not head.crc:
            raise DamageError(f"there is no chunk at byte {at}, although an index lists one")
        try:
            stored, data = self._decompressed(head)
        except DamageError:
            proven = records.proven_head(self.source, head)
            if proven is None or self.damage.is_strict:
                raise
            head = proven
            stored, data = self._decompressed(head)
        crc = head.crc
        if crc and zlib.crc32(data) != crc:
            raise DamageError(f"the checksum of the chunk at byte {at} is wrong")
        is_cut = False
        try:
            content = mcap_writer.Content(data, self.room)
        except DamageError as error:
            if crc:
                raise
            # without a checksum, the messages before the damage are as good as any
            is_cut = True
            self.damage.add(error.message, at, at + size)
            content = mcap_writer.Content(memoryview(self._salvaged(at, data)), self.room)
        self._define_channels(content)
        edits = self._edits(content, set())
        if edits or is_cut:
            new = _edited(content.data, edits)
            self._check_size(len(new))
            content, crc = mcap_writer.Content(new), zlib.crc32(new)
            stored = memoryview(compression.compress(new, head.compression))
        self.writer.add_chunk(content, head.compression, stored, crc)

    @cached_property
    def _chunks(self) -> dict[int, Chunk]:
        """The known chunks, by their places."""
        every = self.facts.chunks
        return {chunk.at: chunk for chunk in every if chunk.compression is not None}

    @cached_property
    def _places(self) -> list[int]:
        return sorted(self._chunks)

    def _salvaged(self, at: int, data: memoryview) -> bytes:
        """Return the records of a damaged chunk before the damage, and messages in its indexes."""
        sound = size = records.sound_size(data)
        parts: list[Raw] = [data[:sound]]
        chunk = self._chunks.get(at)
        if chunk is not None:
            indexed = indexed_messages(self.source, chunk, data, self.facts.channels)
            walked = set(mcap_writer.Content(data[:sound], self.room).places.tolist())
            for start, stop in sorted(indexed):
                # messages of damaged sizes may overlap
                if start not in walked and size + stop - start <= 2 * len(data):
                    parts.append(data[start:stop])
                    size += stop - start
        return b"".join(parts)

    def _other(self, op: int, at: int, size: int) -> None:
        """Copy a record, of any size."""
        if op in (records.ATTACHMENT_OP, records.METADATA_OP):
            length = size - HEAD.size
            head = self.source.view(at + HEAD.size, min(length, BLOCK))
            self.writer.index_other(op, head, length)
        for start in range(at, at + size, BLOCK):
            self.writer.write(self.source.view(start, min(BLOCK, at + size - start)))

    def _check_size(self, size: int) -> None:
        most = compression.MOST_IN_A_CHUNK
        if size > most:
            what = f"messages that are together take {size:,} bytes, more than {most:,}"
            raise RecordingError(what)

    def _define_channels(self, content: mcap_writer.Content) -> None:
        """Write definitions that only come later, or only the summary has."""
        inside = {own.number for own in content.definitions if own.op == CHANNEL_OP}
        for number in content.by_channel.keys() - inside:
            self._define(CHANNEL_OP, number)

    def _define(self, op: int, number: int) -> None:
        """Write a definition, unless there is one already, or it is gone."""
        content = self.plan.contents.get((op, number))
        is_gone = op == SCHEMA_OP and number in self.plan.gone
        if content is None or is_gone or (op, number) in self.writer.definitions:
            return
        if op == CHANNEL_OP:
            self._define(SCHEMA_OP, int.from_bytes(content[2:4], "little"))
        else:
            self.known.add(number)
        self.writer.add(mcap_writer.Content(mcap_writer.record(op, content)))

    def _edits(self, content: mcap_writer.Content, known: set[int]) -> list[BytesEdit]:
        """Return the changes of records; `known` are the schemas that need no definition."""
        edits: list[BytesEdit] = []
        for op, at, number, data in content.definitions:
            if (op, number) not in self.facts.raws:
                if self.facts.loose is not None or not self.damage:
                    raise _UnlistedError
                edits.append((at, at + HEAD.size + len(data), b""))  # it is damaged
                continue
            is_sound = self._is_sound(op, data)
            new = self._definition(op, number, known)
            if new is None and not is_sound:
                new = mcap_writer.record(op, self.plan.contents[op, number])
            end = at + HEAD.size + len(data)
            if new is not None and new != content.data[at:end]:
                edits.append((at, end, new))
        edits += self._messages(content)
        return sorted(edits)

    def _is_sound(self, op: int, data: memoryview) -> bool:
        """Return whether a definition is the known one; if it is damaged, that takes its place."""
        try:
            self.facts.add(op, data)
        except DamageError as error:
            self.damage.add(error.message)
        except RecordingError as error:
            if self.facts.loose is None and not self.damage:  # nothing says which one is right
                raise
            self.damage.add(error.message)
        else:
            return True
        return False

    def _definition(self, op: int, number: int, known: set[int]) -> bytes | None:
        """Return what takes the place of a definition, None if it stays."""
        plan = self.plan
        if op == SCHEMA_OP:
            if number in plan.gone:
                return b""
            known.add(number)
            is_new = plan.contents[op, number] != self.facts.raws[op, number]
            return mcap_writer.record(op, plan.contents[op, number]) if is_new else None
        if number not in plan.changed:
            return None
        new, own = mcap_writer.record(op, plan.contents[op, number]), plan.schemas[number]
        if own not in known:
            known.add(own)
            is_new = plan.contents[SCHEMA_OP, own] != self.facts.raws.get((SCHEMA_OP, own))
            if is_new or (SCHEMA_OP, own) not in self.writer.definitions:
                new = mcap_writer.record(SCHEMA_OP, plan.contents[SCHEMA_OP, own]) + new
        return new

    def _messages(self, content: mcap_writer.Content) -> Iterator[BytesEdit]:
        """Yield the messages with new payloads, and those of channels without a definition."""
        for number in content.by_channel.keys() - self.facts.channels.keys():
            mine = content.by_channel[number]
            starts = content.places[mine]
            stops = starts + HEAD.size + content.heads["size"][mine].astype(np.int64)
            for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
                yield start, stop, b""
        by_topic: dict[tuple[str, DefinitionKey | None], list[Any]] = {}
        for number, mine in content.by_channel.items():
            change = self.plan.changed.get(number)
            if change is not None and change.convert:
                key = self.facts.channels[number].topic, change.old
                by_topic.setdefault(key, []).append(mine)
        for (topic, _), parts in by_topic.items():
            mine = np.sort(np.concatenate(parts))
            starts, times = content.places[mine], content.heads["log"][mine].tolist()
            stops = (starts + HEAD.size + content.heads["size"][mine].astype(np.int64)).tolist()
            places, data = starts.tolist(), content.data
            pairs = zip(places, stops, strict=True)
            raws = [data[place + MESSAGE.itemsize : stop] for place, stop in pairs]
            number = int(content.heads["channel"][mine[0]])
            payloads = converted(topic, self.plan.changed[number], raws, times, self.room)
            for place, stop, payload in zip(places, stops, payloads, strict=True):
                size = MESSAGE.itemsize - HEAD.size + len(payload)
                head = data[place + HEAD.size : place + MESSAGE.itemsize]
                yield place, stop, b"".join((HEAD.pack(MESSAGE_OP, size), head, payload))


def _edited(data: memoryview, edits: list[BytesEdit]) -> bytes:
    parts: list[Raw] = []
    at = 0
    for start, stop, new in edits:
        parts += data[at:start], new
        at = stop
    return b"".join((*parts, data[at:]))


def _has_checksum(source: FileSource) -> bool:
    """Return whether the data section of a file has a checksum."""
    end = source.size - FOOTER.size - len(MAGIC)
    if end < len(MAGIC):
        return False
    start = FOOTER.unpack(source.view(end, FOOTER.size))[2] or end
    at = start - HEAD.size - 4
    if not len(MAGIC) <= at <= end:
        return False
    op, size, crc = Struct("<BQI").unpack(source.view(at, HEAD.size + 4))
    return (op, size) == (records.DATA_END_OP, 4) and crc != 0


def rewrite_mcap(
    place: Path,
    file: BinaryIO,
    conversions: Conversions,
    recorded: dict[str, Recorded],
    index: bool,
    progress: Callable[[int, int], object],
    damage: DamageList,
) -> RewrittenTopics:
    """Write an MCAP file with conversions of topics; `index` is that of `read_facts`.

    `recorded` has what other files of the recording have of a topic, and is added to. What is
    damaged is left out.
    """
    source = FileSource(place)
    every: list[FileStatistics] = []
    with of_file(source.name), source.opened():
        for use_index in dict.fromkeys((index, False)):
            facts = read_facts(source, damage, use_index)
            every.append(facts)
            file.seek(0)
            file.truncate()
            plan = RewritePlan(facts, conversions, recorded)
            rewriting = Rewriting(source, facts, plan, file.write, damage)
            try:
                rewriting.run(lambda done: progress(done, source.size))
            except _UnlistedError:
                continue
            source.check_unchanged()
            for earlier in every:
                rewriting.check(earlier)
            return rewriting.topics()
        raise RecordingError("it was changed while it was read", "read it again")
