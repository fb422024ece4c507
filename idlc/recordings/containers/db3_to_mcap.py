"""A .db3 file, with topics of other types, as an MCAP file with all definitions and profiles."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import BinaryIO, TypeAlias

from idlc.recordings.containers import records
from idlc.recordings.containers.compression import DecompressionBudget
from idlc.recordings.containers.conversion import (
    Conversion,
    Conversions,
    Recorded,
    RewrittenTopic,
    RewrittenTopics,
    check,
    converted,
    definition_key,
    selected,
)
from idlc.recordings.containers.db3 import Db3File
from idlc.recordings.containers.file import MSG, Topic, check_count, full_name
from idlc.recordings.containers.mcap_writer import ChunkWriter, channel, record, schema, text_field
from idlc.recordings.containers.records import MESSAGE_HEAD
from idlc.recordings.containers.source import RecordingError, of_file
from idlc.recordings.damage import DamageList

#: The keys of a channel's metadata that rosbag2 reads, and the name and key of a bag's metadata.
PROFILES, HASH = b"offered_qos_profiles", b"topic_type_hash"
MOST_CHANNELS = (1 << 16) - 2
BAG, BAG_KEY = b"rosbag2", b"serialized_metadata"


def as_mcap(metadata: str) -> str:
    """Return a bag's metadata for MCAP files, which are not compressed in rosbag2's ways."""
    metadata = re.sub(r"(?m)^(\s*storage_identifier:).*$", r"\1 mcap", metadata)
    metadata = re.sub(r"(?m)^(\s*compression_(?:format|mode):).*$", r'\1 ""', metadata)
    return re.sub(r"\.(db3|mcap)(\.zstd)?\b", ".mcap", metadata)


class _Channels:
    """Writes the schemas and channels of a file, each before its first message."""

    def __init__(self, file: Db3File, writer: ChunkWriter, conversions: Conversions) -> None:
        self._writer = writer
        self._schemas: dict[tuple[str, str, str], int] = {}
        self.topics: dict[int, tuple[Topic, Conversion | None]] = {}
        #: The numbers of channels, by those of topics.
        self.numbers: dict[int, int] = {}
        if len(file.topics) > MOST_CHANNELS:
            raise RecordingError(f"it has more than {MOST_CHANNELS:,} topics")
        for topic, number in file.topics:
            key = definition_key(topic.type, topic.schema)
            conversion = selected(conversions, topic.name, key)
            self.topics[number] = topic, conversion
            # from 1: rosbags 0.11 reads no message of channel 0
            self.numbers[number] = len(self.numbers) + 1
            self._add(self.numbers[number], topic, conversion)

    def _add(self, number: int, topic: Topic, new: Conversion | None) -> None:
        kind, encoding, text, digest = topic.type, MSG, "", topic.hash or ""
        if topic.schema is not None:
            encoding, text = topic.schema.encoding, topic.schema.text
        if new is not None:
            kind, encoding, text, digest = new[:4]
        key = full_name(kind), encoding, text
        if key not in self._schemas:
            self._schemas[key] = len(self._schemas) + 1
            self._writer.append(records.SCHEMA_OP, schema(self._schemas[key], *key))
        metadata = {PROFILES: topic.qos.encode()}
        if digest:
            metadata[HASH] = digest.encode()
        names = topic.name.encode(), topic.encoding.encode()
        content = channel(number, self._schemas[key], *names, metadata)
        self._writer.append(records.CHANNEL_OP, content)


#: Messages: their topics, times and contents.
RowBatch: TypeAlias = list[tuple[int, int, bytes]]


class _Conversion:
    """The conversion of a file, group by group."""

    def __init__(
        self, file: Db3File, target: BinaryIO, conversions: Conversions, room: DecompressionBudget
    ) -> None:
        self.writer = ChunkWriter(target)
        self.channels = _Channels(file, self.writer, conversions)
        self._room = room
        self.counts = dict.fromkeys(self.channels.topics, 0)
        self.sizes = dict.fromkeys(self.channels.topics, 0)

    def add(self, rows: RowBatch) -> None:
        """Write messages."""
        by_topic: dict[int, list[int]] = {}
        raws: list[bytes] = []
        for at, (number, time, raw) in enumerate(rows):
            if time < 0:
                raise RecordingError("a message has a time before 1970")
            by_topic.setdefault(number, []).append(at)
            raws.append(raw)
        for number, mine in by_topic.items():
            topic, conversion = self.channels.topics[number]
            if conversion is not None and conversion.convert is not None:
                times, old = [rows[at][1] for at in mine], [raws[at] for at in mine]
                new = converted(topic.name, conversion, old, times, self._room)
                for at, payload in zip(mine, new, strict=True):
                    raws[at] = payload
            self.counts[number] += len(mine)
            self.sizes[number] += sum(len(raws[at]) for at in mine)
        for (number, time, _), raw in zip(rows, raws, strict=True):
            head = MESSAGE_HEAD.pack(self.channels.numbers[number], 0, time, time)
            self.writer.append(records.MESSAGE_OP, head + raw)

    def close(self, metadata: str) -> None:
        """Write the bag's metadata, if there is any, and the summary."""
        self.writer.flush()
        if metadata:
            pair = text_field(BAG_KEY) + text_field(as_mcap(metadata).encode())
            content = text_field(BAG) + text_field(pair)
            self.writer.index_other(records.METADATA_OP, memoryview(content), len(content))
            self.writer.write(record(records.METADATA_OP, content))
        self.writer.close()

    def topics(self) -> RewrittenTopics:
        """Return the fate of each definition of each topic."""
        result: RewrittenTopics = {}
        for number, (topic, conversion) in self.channels.topics.items():
            key = topic.name, definition_key(topic.type, topic.schema)
            count, size = self.counts[number], self.sizes[number]
            is_converted = bool(conversion and conversion.convert)
            result[key] = result.get(key, RewrittenTopic()).plus(count, size, is_converted)
        return result


def convert_db3(
    path: Path,
    target: BinaryIO,
    conversions: Conversions,
    recorded: dict[str, Recorded],
    progress: Callable[[int, int], object],
    strict: bool = False,
) -> tuple[RewrittenTopics, DamageList]:
    """Write a .db3 file as MCAP, with conversions of topics.

    `recorded` has what other files of the recording have of a topic, and is added to. Messages that
    are compressed by themselves are not any more: in MCAP files, no player reads them. What is
    damaged is left out, or an error if `strict`.
    """
    with closing(Db3File(path, strict=strict)) as file, of_file(file.name):
        for topic, _ in file.topics:
            key = definition_key(topic.type, topic.schema)
            if conversion := selected(conversions, topic.name, key):
                check(topic.name, topic.encoding, (topic.type, topic.schema), conversion, recorded)
        room = DecompressionBudget(path.stat().st_size)
        conversion_of_file = _Conversion(file, target, conversions, room)
        total, done = sum(topic.count for topic, _ in file.topics), 0
        for rows in file.rows():
            conversion_of_file.add(rows)
            done += len(rows)
            progress(done, total)
        for topic, number in file.topics if not file.damage else ():
            check_count(topic.name, topic.count, conversion_of_file.counts[number])
        conversion_of_file.close(file.metadata())
    return conversion_of_file.topics(), file.damage
