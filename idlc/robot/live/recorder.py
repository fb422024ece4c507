"""Recording topics of a robot into an MCAP file, as rosbag2 writes it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from enum import IntEnum
from functools import partial
from itertools import chain
from queue import Empty, SimpleQueue
from struct import pack
from threading import Thread
from typing import BinaryIO

from msgspec.structs import asdict

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.source import INCOMPLETE
from idlc.diagnostics.text import including
from idlc.recordings.containers.file import MSG
from idlc.recordings.containers.mcap_writer import ChunkWriter, channel, schema
from idlc.recordings.containers.records import CHANNEL_OP, MESSAGE_OP, SCHEMA_OP
from idlc.recordings.definitions import RecordedDefinition
from idlc.robot.keys import Entity, EntityKind, parse_attachment
from idlc.robot.live.connect import TICK, Inbox, place_of, robot_entities
from idlc.robot.live.traffic import subscribe
from idlc.robot.live.types import TypeKey, definitions
from idlc.robot.qos import QoSProfile
from idlc.robot.session import Session

#: Seconds between two looks at the graph, after which a chunk is written in any case.
LOOK = 1.0
#: Numbers of channels and schemas have two bytes, and schema 0 means none.
MOST_CHANNELS = (1 << 16) - 1
#: Bytes of messages that wait for definitions; more are written without these.
MOST_HELD = 128 << 20
#: Seconds that definitions have at the end.
LAST = 0.2
#: Topics that a report names.
NAMED = 5


class Recorder:
    """Writes the messages of a robot into a file; all topics, or the named ones.

    Topics that appear later are added. Threads ask for definitions, so that no node delays the
    messages of others: these wait in memory until the definition of their type is there. If the
    process is killed, the file lacks the last second and the index.
    """

    def __init__(
        self,
        session: Session,
        file: BinaryIO,
        topics: set[str],
        report: Report,
        include: tuple[str, ...] = (),
    ) -> None:
        self._session = session
        self._writer = ChunkWriter(file)
        self._topics = topics
        self._report = report
        self._include = include
        self._inbox = Inbox()
        #: The name, type and hash of each channel, and the type and hash of each schema.
        self._channels: dict[tuple[str, str, str], int] = {}
        self._schemas: dict[TypeKey, int] = {}
        #: By type and hash, the channels whose definition is not there, each as its record.
        self._undefined: dict[TypeKey, dict[int, Callable[[int], bytes]]] = {}
        #: Messages of these channels.
        self._held: dict[int, list[bytes]] = {}
        self._held_size = 0
        self._replies: SimpleQueue[tuple[TypeKey, RecordedDefinition | None]] = SimpleQueue()
        self._declared = ExitStack()
        #: The time at which the robot disappeared, in ns.
        self._gone = 0

    def run(self, is_over: Callable[[], bool]) -> None:
        """Record until `is_over()`, which is called several times a second."""
        looked = 0.0
        while not is_over():
            if time.monotonic() - looked >= LOOK:
                self._add_topics()
                self._writer.flush()
                looked = time.monotonic()
            self._define(0)
            self._write(TICK / 10 if self._undefined else TICK / 2)

    def close(self) -> dict[str, int]:
        """Write what has arrived, and the index; return the number of messages by topic."""
        self._declared.close()
        end = time.monotonic() + LAST
        while self._undefined and (left := end - time.monotonic()) > 0:
            self._define(left)
        for key in [*self._undefined]:
            self._add_schema(key, None)
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
        publishers = robot_entities(self._session, EntityKind.PUBLISHER)
        self._note_gap(bool(publishers))
        for end in publishers:
            key = end.name, end.type, end.hash
            wanted = end.name in self._topics if self._topics else place_of(end)[0] == "topic"
            is_new = wanted and key not in self._channels
            if is_new and len(self._channels) + len(new) < MOST_CHANNELS:
                new.setdefault(key, []).append(end)
        asked = []
        for key, ends in new.items():
            # from 1, as other writers do: rosbags 0.11.0 reads no channel 0
            number = self._channels[key] = len(self._channels) + 1
            profiles = dict.fromkeys(end.qos for end in ends)
            offered = "\n".join(chain.from_iterable(map(qos_lines, profiles))).encode()
            metadata = {b"offered_qos_profiles": offered, b"topic_type_hash": key[2].encode()}
            record = partial(_channel, number, key[0], metadata)
            if key[1:] in self._schemas:
                self._writer.append(CHANNEL_OP, record(self._schemas[key[1:]]))
            else:
                asked += [] if key[1:] in self._undefined else ends
                self._undefined.setdefault(key[1:], {})[number] = record
                self._held[number] = []
            subscribe(self._session, ends, self._inbox, number, self._declared)
        if asked:
            Thread(target=self._ask, args=(asked,), daemon=True).start()

    def _ask(self, ends: list[Entity]) -> None:
        """Put the definitions of what endpoints use into the queue; runs on a thread."""
        keys = {(end.type, end.hash) for end in ends}
        with suppress(Exception):  # the session is closed
            for read in definitions(self._session, "", ends, whole=True, include=self._include):
                key = read.topic.type, read.topic.hash or ""
                keys.discard(key)
                self._replies.put((key, read))
        for key in keys:
            self._replies.put((key, None))

    def _define(self, timeout: float) -> None:
        """Add the definitions that arrive; wait for at most one."""
        with suppress(Empty):
            key, read = self._replies.get(timeout=timeout) if timeout else self._replies.get(False)
            while True:
                self._add_schema(key, read)
                key, read = self._replies.get(block=False)

    def _add_schema(self, key: TypeKey, read: RecordedDefinition | None) -> None:
        """Add a schema with the channels and the messages that wait for it."""
        channels = self._undefined.pop(key, {})
        if not channels:
            return
        definition = read.topic.schema if read else None
        problem = read.problem if read else "idlc did not wait for it any longer"
        numbers = {number: name for (name, *_), number in self._channels.items()}
        names = first_few([f"`{numbers[number]}`" for number in channels], NAMED)
        text = definition.text if definition else ""
        if not text:
            message = f"{names} recorded without the definition of {key[0]}: {problem}"
            hint = f"{including('DIR')}, where DIR contains the package's sources"
            self._report.add(codes.MISSING_DEFINITION.of("", message, hint=hint))
        elif INCOMPLETE in text:
            message = f"{names}: constants, default values and comments of {key[0]} may be missing"
            self._report.add(codes.MISSING_DEFINITION.of("", message))
        elif not key[1]:
            note = f"{names} recorded with this machine's definition of {key[0]}"
            self._report.notes.append(f"{note}, since the robot announces no type hash")
        schema_number = self._schemas[key] = len(self._schemas) + 1
        encoding = MSG if text else ""
        self._writer.append(SCHEMA_OP, schema(schema_number, key[0], encoding, text))
        for number, channel_of in channels.items():
            self._writer.append(CHANNEL_OP, channel_of(schema_number))
            for content in self._held.pop(number):
                self._held_size -= len(content)
                self._writer.append(MESSAGE_OP, content)

    def _note_gap(self, is_there: bool) -> None:
        """Note the time in which no publisher was to be seen, in the file as well."""
        if not is_there:
            self._gone = self._gone or (time.time_ns() if self._channels else 0)
        elif self._gone:
            gone, back = self._gone, time.time_ns()
            self._gone = 0
            times = {b"from": str(gone).encode(), b"to": str(back).encode()}
            self._writer.add_metadata("idlc gap", times)
            seconds = (back - gone) / 1e9
            self._report.notes.append(
                f"the robot was not there for {seconds:.0f} seconds; its messages are missing"
            )

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
        message = head + arrival.sample.payload
        if arrival.number not in self._held:
            self._writer.append(MESSAGE_OP, message)
            return True
        self._held[arrival.number].append(message)
        self._held_size += len(message)
        if self._held_size > MOST_HELD:
            self._add_schema(next(iter(self._undefined)), None)
        return True


def _channel(number: int, name: str, metadata: dict[bytes, bytes], schema_number: int) -> bytes:
    return channel(number, schema_number, name.encode(), b"cdr", metadata)


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
