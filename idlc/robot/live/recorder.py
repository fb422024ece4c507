"""Recording topics of a robot into an MCAP file, as rosbag2 writes it."""

from __future__ import annotations

import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from struct import pack
from typing import BinaryIO, NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import did_you_mean
from idlc.recordings.containers.compression import compress
from idlc.recordings.containers.mcap_writer import (
    Content,
    McapWriter,
    channel,
    record,
    schema,
    text_field,
)
from idlc.recordings.containers.records import CHANNEL_OP, HEADER_OP, MESSAGE_OP, SCHEMA_OP
from idlc.robot.keys import Entity, Kind, parse_attachment
from idlc.robot.live.connect import APPEARING, robot_entities
from idlc.robot.live.traffic import Arrival, Inbox, subscribe
from idlc.robot.live.types import definitions
from idlc.robot.names import action_part
from idlc.robot.qos import QoSProfile
from idlc.robot.session import Session
from idlc.version import __version__

#: Bytes of messages in a chunk, and seconds after which one is written in any case.
CHUNK = 1 << 20
AGE = 1.0
#: Seconds between two looks at the graph, and at the end.
LOOK = 0.5
#: Numbers of channels and schemas have two bytes, and schema 0 means none.
MOST_CHANNELS = (1 << 16) - 1
_SECOND = 10**9
_HEAD = "<HIQQ"

#: The version of a topic: its name, type and hash.
Key = tuple[str, str, str]


class Recorded(NamedTuple):
    """The result: messages by topic, and messages that found no room in memory."""

    counts: dict[str, int]
    lost: int


def check_topics(session: Session, topics: Sequence[str], report: Report) -> bool:
    """Return whether a robot has these topics; reports IDL655 for each other one."""

    def missing(_: object = None) -> list[str]:
        names = {end.name for end in robot_entities(session, Kind.PUBLISHER, Kind.SUBSCRIPTION)}
        return [topic for topic in topics if topic not in names]

    session.graph.wait_for(lambda graph: not missing(graph), APPEARING)
    names = [end.name for end in robot_entities(session, Kind.PUBLISHER)]
    for topic in missing():
        hint = did_you_mean(topic, names) or "`idlc show` lists the topics"
        report.add(codes.NO_SUCH_TOPIC.of("", f"no topic `{topic}`", hint=hint))
    return not missing()


class Recorder:
    """Writes the messages of a robot into a file; all topics, or the named ones.

    Topics that appear later are added. The file is complete after `close`; if the process is
    killed, it lacks the last chunk and the index.
    """

    def __init__(
        self, session: Session, address: str, file: BinaryIO, topics: Sequence[str], report: Report
    ) -> None:
        self._session = session
        self._address = address
        self._topics = frozenset(topics)
        self._report = report
        self._inbox = Inbox()
        self._channels: dict[Key, int] = {}
        self._schemas: dict[tuple[str, str], int] = {}
        self._names: list[str] = []
        self._counts: dict[str, int] = {}
        self._declared = ExitStack()
        self._chunk = bytearray()
        self._since = 0.0
        try:
            import zstandard  # noqa: F401 - compress needs it

            self._compression = "zstd"
        except ImportError:
            self._compression = ""
        self._writer = McapWriter(file.write)
        library = f"idlc {__version__}".encode()
        self._writer.write(record(HEADER_OP, text_field(b"ros2") + text_field(library)))

    def run(self, is_over: Callable[[], bool]) -> None:
        """Record until `is_over()`, which is called several times a second."""
        looked = 0.0
        while not is_over():
            if time.monotonic() - looked >= LOOK:
                self._add_topics()
                looked = time.monotonic()
            if arrival := self._inbox.get(LOOK / 2):
                self._write(arrival)
            if self._chunk and time.monotonic() - self._since >= AGE:
                self._flush()

    def close(self) -> Recorded:
        """Write what has arrived, and the index; return what was recorded."""
        self._declared.close()
        while arrival := self._inbox.get(0):
            self._write(arrival)
        self._flush()
        self._writer.close()
        return Recorded(self._counts, self._inbox.lost)

    def _add_topics(self) -> None:
        new: dict[Key, list[Entity]] = {}
        for end in robot_entities(self._session, Kind.PUBLISHER):
            key = end.name, end.type, end.hash
            wanted = end.name in self._topics if self._topics else not action_part(end.name)
            if wanted and key not in self._channels:
                new.setdefault(key, []).append(end)
        if not new:
            return
        texts = {
            (read.topic.type, read.topic.hash or ""): (read.topic.schema, read.problem)
            for read in definitions(
                self._session, self._address, _with_actions(self._session, new), whole=True
            )
        }
        for key, ends in new.items():
            if len(self._names) >= MOST_CHANNELS:
                return
            definition, problem = texts.get(key[1:], (None, "it is a part of an action"))
            if definition is None:
                message = f"`{key[0]}` is recorded without the definition of {key[1]}: {problem}"
                self._report.add(codes.MISSING_DEFINITION.of(self._address, message))
            self._define(key, ends, definition.text if definition else "")

    def _define(self, key: Key, ends: Sequence[Entity], text: str) -> None:
        """Write the schema and the channel of a topic, and subscribe."""
        name, type_, hash_ = key
        schema_number = self._schemas.get(key[1:])
        if schema_number is None:
            schema_number = self._schemas[key[1:]] = len(self._schemas) + 1
            self._append(SCHEMA_OP, schema(schema_number, type_, "ros2msg" if text else "", text))
        number = self._channels[key] = len(self._names)
        self._names.append(name)
        self._counts.setdefault(name, 0)
        offered = "\n".join(qos_lines(qos) for qos in dict.fromkeys(end.qos for end in ends))
        metadata = {b"offered_qos_profiles": offered.encode(), b"topic_type_hash": hash_.encode()}
        self._append(CHANNEL_OP, channel(number, schema_number, name.encode(), b"cdr", metadata))
        for declared in subscribe(self._session, ends, self._inbox, number):
            self._declared.callback(declared.close)

    def _write(self, arrival: Arrival) -> None:
        number, sample, log_time = arrival
        attachment = parse_attachment(sample.attachment)
        sequence, published = 0, log_time
        if attachment and attachment.time >= 0:
            sequence, published = attachment.sequence & 0xFFFFFFFF, attachment.time
        head = pack(_HEAD, number, sequence, log_time, published)
        self._append(MESSAGE_OP, head + sample.payload)
        self._counts[self._names[number]] += 1

    def _append(self, op: int, content: bytes) -> None:
        if not self._chunk:
            self._since = time.monotonic()
        self._chunk += record(op, content)
        if len(self._chunk) >= CHUNK:
            self._flush()

    def _flush(self) -> None:
        if not self._chunk:
            return
        data, self._chunk = bytes(self._chunk), bytearray()
        stored = compress(data, self._compression)
        self._writer.add_chunk(Content(data), self._compression, stored, zlib.crc32(data))


def _with_actions(session: Session, new: dict[Key, list[Entity]]) -> Iterator[Entity]:
    """Yield endpoints, and those of the actions that they are parts of, which define the types."""
    for ends in new.values():
        yield from ends
    actions = {part[0] for name, *_ in new if (part := action_part(name))}
    for end in robot_entities(session) if actions else ():
        if (part := action_part(end.name)) and part[0] in actions:
            yield end


def qos_lines(qos: QoSProfile) -> str:
    """Return a profile in YAML as rosbag2 writes it."""

    def duration(nanoseconds: int) -> str:
        seconds, rest = divmod(nanoseconds, _SECOND)
        return f"\n    sec: {seconds}\n    nsec: {rest}"

    return (
        f"- history: {qos.history.name.lower()}\n"
        f"  depth: {qos.depth}\n"
        f"  reliability: {qos.reliability.name.lower()}\n"
        f"  durability: {qos.durability.name.lower()}\n"
        f"  deadline:{duration(qos.deadline)}\n"
        f"  lifespan:{duration(qos.lifespan)}\n"
        f"  liveliness: {qos.liveliness.name.lower()}\n"
        f"  liveliness_lease_duration:{duration(qos.liveliness_lease_duration)}\n"
        "  avoid_ros_namespace_conventions: false"
    )
