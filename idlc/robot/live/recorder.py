"""Recording topics of a robot into an MCAP file, as rosbag2 writes it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from enum import IntEnum
from itertools import chain
from struct import pack
from typing import BinaryIO

from msgspec.structs import asdict

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.recordings.containers.file import MSG
from idlc.recordings.containers.mcap_writer import ChunkWriter, channel, schema
from idlc.recordings.containers.records import CHANNEL_OP, MESSAGE_OP, SCHEMA_OP
from idlc.robot.keys import Entity, Kind, parse_attachment
from idlc.robot.live.connect import TICK, Inbox, place_of, robot_entities
from idlc.robot.live.traffic import subscribe
from idlc.robot.live.types import definitions
from idlc.robot.qos import QoSProfile
from idlc.robot.session import Session

#: Seconds between two looks at the graph, after which a chunk is written in any case.
LOOK = 1.0
#: Numbers of channels and schemas have two bytes, and schema 0 means none.
MOST_CHANNELS = (1 << 16) - 1


class Recorder:
    """Writes the messages of a robot into a file; all topics, or the named ones.

    Topics that appear later are added. If the process is killed, the file lacks the last second
    and the index.
    """

    def __init__(self, session: Session, file: BinaryIO, topics: set[str], report: Report) -> None:
        self._session = session
        self._writer = ChunkWriter(file)
        self._topics = topics
        self._report = report
        self._inbox = Inbox()
        #: The name, type and hash of each channel, and the type and hash of each schema.
        self._channels: dict[tuple[str, str, str], int] = {}
        self._schemas: dict[tuple[str, str], int] = {}
        self._declared = ExitStack()

    def run(self, is_over: Callable[[], bool]) -> None:
        """Record until `is_over()`, which is called several times a second."""
        looked = 0.0
        while not is_over():
            if time.monotonic() - looked >= LOOK:
                self._add_topics()
                self._writer.flush()
                looked = time.monotonic()
            self._write(TICK / 2)

    def close(self) -> dict[str, int]:
        """Write what has arrived, and the index; return the number of messages by topic."""
        self._declared.close()
        while self._write(0):
            pass
        self._writer.close()
        if lost := self._inbox.lost:
            self._report.notes.append(f"the disk was too slow: {lost:,} messages were lost")
        counts: dict[str, int] = {}
        for (name, *_), number in self._channels.items():
            counts[name] = counts.get(name, 0) + self._writer.counts.get(number, 0)
        return counts

    def _add_topics(self) -> None:
        new: dict[tuple[str, str, str], list[Entity]] = {}
        for end in robot_entities(self._session, Kind.PUBLISHER):
            key = end.name, end.type, end.hash
            wanted = end.name in self._topics if self._topics else place_of(end)[0] == "topic"
            is_new = wanted and key not in self._channels
            if is_new and len(self._channels) + len(new) < MOST_CHANNELS:
                new.setdefault(key, []).append(end)
        if new:
            self._add_schemas(chain.from_iterable(new.values()))
        for key, ends in new.items():
            # from 1, as other writers do: rosbags 0.11.0 reads no channel 0
            number = self._channels[key] = len(self._channels) + 1
            profiles = dict.fromkeys(end.qos for end in ends)
            offered = "\n".join(chain.from_iterable(map(qos_lines, profiles))).encode()
            metadata = {b"offered_qos_profiles": offered, b"topic_type_hash": key[2].encode()}
            content = channel(number, self._schemas[key[1:]], key[0].encode(), b"cdr", metadata)
            self._writer.append(CHANNEL_OP, content)
            subscribe(self._session, ends, self._inbox, number, self._declared)

    def _add_schemas(self, ends: Iterable[Entity]) -> None:
        for read in definitions(self._session, "", ends, whole=True):
            name, type_, definition = read.topic.name, read.topic.type, read.topic.schema
            if definition is None:
                message = f"`{name}` is recorded without the definition of {type_}: {read.problem}"
                self._report.add(codes.MISSING_DEFINITION.of("", message))
            key = type_, read.topic.hash or ""
            if key not in self._schemas:
                number = self._schemas[key] = len(self._schemas) + 1
                encoding, text = (MSG, definition.text) if definition else ("", "")
                self._writer.append(SCHEMA_OP, schema(number, type_, encoding, text))

    def _write(self, timeout: float) -> bool:
        """Write the next message; return whether there was one."""
        arrival = self._inbox.get(timeout)
        if arrival is None or arrival.sample is None:
            return False
        attachment = parse_attachment(arrival.sample.attachment)
        sequence, published = 0, arrival.time
        if attachment and attachment.time >= 0:
            sequence, published = attachment.sequence & 0xFFFFFFFF, attachment.time
        head = pack("<HIQQ", arrival.number, sequence, arrival.time, published)
        self._writer.append(MESSAGE_OP, head + arrival.sample.payload)
        return True


def qos_lines(qos: QoSProfile) -> Iterator[str]:
    """Yield a profile in YAML as rosbag2 writes it."""
    yield "- avoid_ros_namespace_conventions: false"
    for name, value in asdict(qos).items():
        if isinstance(value, IntEnum):
            yield f"  {name}: {value.name.lower()}"
        elif name == "depth":
            yield f"  depth: {value}"
        else:
            seconds, rest = divmod(value, 10**9)
            yield f"  {name}:\n    sec: {seconds}\n    nsec: {rest}"
