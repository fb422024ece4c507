"""Messages of a robot: subscribing to topics, calling services, and both as text."""

from __future__ import annotations

import csv
import io
import json
import math
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from threading import Condition
from typing import Any, NamedTuple

from msgspec.structs import replace as replaced

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, Severity
from idlc.diagnostics.text import did_you_mean, one_line
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.load import type_of
from idlc.robot.keys import Entity, Kind, pack_attachment
from idlc.robot.live.connect import announce, now, own_endpoint, robot_entities
from idlc.robot.live.types import PATIENCE, definitions
from idlc.robot.names import action_part
from idlc.robot.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from idlc.robot.session import Session
from idlc.robot.transport import Closeable, Sample
from idlc.runtime.names import ValidationError
from idlc.runtime.typeinfo import FieldInfo, Structure, structure_of

#: Bytes of messages that wait to be printed or written; more are lost.
MOST_WAITING = 64 << 20
#: Bytes that a message takes besides its payload.
_OVERHEAD = 200
#: The line after each YAML document.
BETWEEN = "---\n"
TOPICS = (Kind.PUBLISHER, Kind.SUBSCRIPTION)


class Arrival(NamedTuple):
    """A message, the number of its channel, and the time of its arrival in nanoseconds."""

    channel: int
    sample: Sample
    time: int


class Inbox:
    """Messages in the order of their arrival, from any thread; `lost` counts those without room."""

    def __init__(self, most: int = MOST_WAITING) -> None:
        self.lost = 0
        self._room = most
        self._arrivals: deque[Arrival] = deque()
        self._changed = Condition()

    def put(self, channel: int, sample: Sample) -> None:
        """Add a message, if there is room."""
        size = len(sample.payload) + _OVERHEAD
        with self._changed:
            if size > self._room:
                self.lost += 1
                return
            self._room -= size
            self._arrivals.append(Arrival(channel, sample, now()))
            self._changed.notify()

    def get(self, timeout: float) -> Arrival | None:
        """Return the next message; `None` if none arrives within `timeout` seconds."""
        with self._changed:
            if not self._arrivals:
                self._changed.wait(timeout)
            if not self._arrivals:
                return None
            arrival = self._arrivals.popleft()
            self._room += len(arrival.sample.payload) + _OVERHEAD
            return arrival


def subscribe(
    session: Session, ends: Sequence[Entity], inbox: Inbox, channel: int
) -> tuple[Closeable, ...]:
    """Subscribe to one version of a topic as its publishers offer it, and announce that."""
    offered = [end.qos for end in ends if end.kind is Kind.PUBLISHER]
    reliable = any(qos.reliability is ReliabilityPolicy.RELIABLE for qos in offered)
    latched = any(qos.is_latched for qos in offered)
    qos = QoSProfile(
        depth=max((qos.depth for qos in offered), default=10),
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
    own = own_endpoint(session, ends[0], Kind.SUBSCRIPTION, qos)
    subscription = session.transport.subscriber(
        own.key, qos, lambda sample: inbox.put(channel, sample)
    )
    return subscription, announce(session, own)


def interface_class(
    session: Session, address: str, end: Entity, report: Report, patience: float = PATIENCE
) -> Any:
    """Return the class of what an endpoint sends; `None` after reporting IDL652."""
    part = action_part(end.name)
    ends = [end]
    if part and end.type != "action_msgs/msg/GoalStatusArray":
        ends = [e for e in robot_entities(session) if (action_part(e.name) or "")[:1] == part[:1]]
    read = [
        definition
        for definition in definitions(session, address, ends, patience=patience)
        if (definition.topic.type, definition.topic.hash or "") == (end.type, end.hash)
    ]
    problem = read[0].problem if read else "it is a part of an action"
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            kind = type_of(read[0].topic).kind if read else None
        report.notes += [str(warning.message) for warning in caught]
    except RecordingError:
        kind = None
    if kind is None:
        message = f"the type of `{end.name}`, {end.type}, is unknown"
        hint = "`idlc show ADDRESS` lists the types" if not problem else f"the robot: {problem}"
        missing = codes.MISSING_DEFINITION.of("", message, hint=hint)
        report.add(replaced(missing, severity=Severity.ERROR))
    return kind


def version_of(ends: Sequence[Entity], report: Report) -> list[Entity]:
    """Return the endpoints of the version that most publishers or services have."""
    versions: dict[tuple[str, str], list[Entity]] = {}
    for end in ends:
        versions.setdefault((end.type, end.hash), []).append(end)
    chosen = max(
        versions.values(),
        key=lambda some: sum(end.kind in (Kind.PUBLISHER, Kind.SERVICE) for end in some),
    )
    if len(versions) > 1:
        report.notes.append(
            f"`{ends[0].name}` has {len(versions)} versions; idlc uses the version of "
            f"`{chosen[0].node_name}`, {chosen[0].type} {chosen[0].hash}"
        )
    return chosen


def messages(
    session: Session, ends: Sequence[Entity], kind: Any, count: int | None, report: Report
) -> Iterator[Any]:
    """Yield messages of a topic as they arrive, until there are `count`.

    Malformed and lost ones are noted.
    """
    inbox, done, malformed = Inbox(), 0, 0
    declared = subscribe(session, ends, inbox, 0)
    try:
        while count is None or done < count:
            arrival = inbox.get(0.5)
            if arrival is None:
                continue
            try:
                message = kind.deserialize(arrival.sample.payload)
            except ValueError:
                malformed += 1
                continue
            done += 1
            yield message
    finally:
        for each in declared:
            each.close()
        for number, adjective in ((malformed, "malformed"), (inbox.lost, "lost")):
            if number:
                report.notes.append(f"{number} {adjective} messages of `{ends[0].name}`")


def call(session: Session, service: Entity, request: Any, timeout: float) -> bytes | None:
    """Return the payload of the first reply; `None` if there is none within `timeout` seconds."""
    client = own_endpoint(session, service, Kind.CLIENT, QoSProfile(depth=10))
    announced = announce(session, client)
    replies: deque[bytes | None] = deque()
    changed = Condition()

    def receive(sample: Sample | None) -> None:
        with changed:
            replies.append(sample.payload if sample else None)
            changed.notify()

    attachment = pack_attachment(1, now(), client.gid)
    session.transport.call(service.key, request.serialize(), attachment, receive, timeout=timeout)
    end = time.monotonic() + timeout + 1
    with changed:
        while not replies and (left := end - time.monotonic()) > 0:
            changed.wait(min(left, 0.5))
    announced.close()
    return replies[0] if replies else None


# values


class FieldError(ValueError):
    """A word of the command line that is not the value of a field."""


def request_of(kind: Any, words: Sequence[str]) -> Any:
    """Return a message with fields from words such as `pose.x=1.5`; raises FieldError."""
    values: dict[str, Any] = {}
    for word in words:
        path, equals, text = word.partition("=")
        if not equals:
            raise FieldError(f"`{one_line(word)}` is not a value; write `FIELD=VALUE`")
        *parents, last = path.split(".")
        structure, place = structure_of(kind), values
        for parent in parents:
            field = _field(structure, parent, path)
            if field.nested is None or field.is_list:
                raise FieldError(f"`{one_line(path)}`: `{one_line(parent)}` has no fields")
            structure, place = field.nested, place.setdefault(parent, {})
            if not isinstance(place, dict):
                raise FieldError(f"`{one_line(path)}` is set twice")
        if last in place:
            raise FieldError(f"`{one_line(path)}` is set twice")
        place[last] = _value(_field(structure, last, path), text, path)
    try:
        return kind.from_dict(values)
    except (ValidationError, TypeError, OverflowError) as error:
        raise FieldError(str(error)) from None


def _field(structure: Structure, name: str, path: str) -> FieldInfo:
    fields = {field.name: field for field in structure.fields}
    if name not in fields:
        hint = did_you_mean(name, fields) or f"the fields are {', '.join(fields) or 'none'}"
        raise FieldError(f"{structure.name} has no field `{one_line(path)}`; {hint}")
    return fields[name]


def _value(field: FieldInfo, text: str, path: str) -> Any:
    """Return the value in a word; lists and nested messages are JSON, strings as they are."""
    if field.text and not field.is_list:
        return text
    if field.primitive and field.primitive.code == "?" and not field.is_list:
        if text.lower() in ("true", "false", "1", "0"):
            return text.lower() in ("true", "1")
        raise FieldError(f"{path}: must be true or false, not `{one_line(text)}`")
    try:
        if field.primitive and field.primitive.code in "fd" and not field.is_list:
            return float(text)
        if field.primitive and not field.is_list:
            return int(text, 0)
        return json.loads(text)
    except (ValueError, RecursionError):
        noun = "a JSON value" if field.is_list or field.nested else "a number"
        raise FieldError(f"{path}: must be {noun}, not `{one_line(text)}`") from None


def field_names(structure: Structure, word: str) -> list[str]:
    """Return the paths of fields that a word begins, for completion."""
    *parents, last = word.split(".")
    for parent in parents:
        nested = next((f.nested for f in structure.fields if f.name == parent), None)
        if nested is None:
            return []
        structure = nested
    before = "".join(f"{parent}." for parent in parents)
    return [
        f"{before}{field.name}{'.' if field.nested and not field.is_list else '='}"
        for field in structure.fields
        if field.name.startswith(last)
    ]


# text


def formatter(style: str, kind: Any) -> Callable[[Any], str]:
    """Return the function that formats messages as YAML documents, JSON lines or CSV rows."""
    if style == "json":
        return lambda message: f"{json_text(message.to_dict())}\n"
    if style == "yaml":
        return _yaml
    columns = _columns(structure_of(kind))
    is_first = True

    def row(message: Any) -> str:
        nonlocal is_first
        text = _csv(columns) if is_first else ""
        is_first = False
        return text + _csv([_cell(message.to_dict(), column) for column in columns])

    return row


def json_text(values: Any) -> str:
    """Return values as JSON, in which numbers that are not finite are null."""
    try:
        return json.dumps(values, allow_nan=False)
    except ValueError:
        return json.dumps(_finite(values))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(own) for name, own in value.items()}
    if isinstance(value, list):
        return [_finite(own) for own in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _yaml(message: Any) -> str:
    import yaml

    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    options = {"sort_keys": False, "default_flow_style": None, "allow_unicode": True, "width": 100}
    text: str = yaml.dump(message.to_dict(), Dumper=dumper, **options)
    return text + BETWEEN


def _columns(structure: Structure) -> list[str]:
    columns: list[str] = []
    for field in structure.fields:
        if field.nested and not field.is_list:
            columns += (f"{field.name}.{own}" for own in _columns(field.nested))
        else:
            columns.append(field.name)
    return columns


def _cell(values: Mapping[str, Any], column: str) -> Any:
    value: Any = values
    for part in column.split("."):
        value = value[part]
    return json_text(value) if isinstance(value, list) else value


def _csv(cells: Sequence[Any]) -> str:
    row = io.StringIO()
    csv.writer(row, lineterminator="\n").writerow(cells)
    return row.getvalue()
