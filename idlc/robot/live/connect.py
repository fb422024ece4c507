"""Connections for commands: the endpoints of a robot, and what arrives from them."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any, NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import did_you_mean, one_line
from idlc.robot.errors import RobotError
from idlc.robot.keys import Entity, Kind, pack_attachment
from idlc.robot.live.graph import Entity as Noun
from idlc.robot.names import action_part
from idlc.robot.qos import QoSProfile
from idlc.robot.session import Session, open_session
from idlc.robot.transport import Sample

#: Seconds that commands wait for a name to appear.
APPEARING = 1.0
#: Seconds after which a wait is interrupted, because Windows does not interrupt one for Ctrl-C.
TICK = 0.5
#: Requests that wait for replies at a time.
AT_ONCE = 32
TOPICS = (Kind.PUBLISHER, Kind.SUBSCRIPTION)
#: Bytes of samples that wait to be read; more are lost.
MOST_WAITING = 64 << 20
#: Bytes that a sample takes besides its payload.
_OVERHEAD = 200


@contextmanager
def connected(address: str, report: Report, timeout: float = 5.0) -> Iterator[Session | None]:
    """Yield a session with a robot; reports IDL642, and yields `None`, without an answer.

    At the end, it adds a note if endpoints may be missing.
    """
    try:
        session = open_session(address, timeout=timeout)
    except RobotError as error:
        report.add(codes.NO_ANSWER.of("", error.message, hint=error.hint))
        yield None
        return
    with session:
        yield session
        report.notes += session.transport.notes()
        if session.graph.is_full:
            report.notes.append("the robot announces too many endpoints; some are missing")
        if session.graph.is_incomplete:
            report.notes.append("the robot answers too slowly; endpoints may be missing")


def robot_entities(session: Session, *kinds: Kind) -> list[Entity]:
    """Return the entities of other sessions, sorted by name."""
    entities = (end for end in session.graph.entities() if end.session != session.id)
    chosen = [end for end in entities if not kinds or end.kind in kinds]
    return sorted(chosen, key=lambda end: (end.name, end.node_name, end.token))


def place_of(end: Entity) -> tuple[Noun, str, str]:
    """Return the topic, service or action that an endpoint belongs to, and the action's part."""
    if part := action_part(end.name):
        return "action", *part
    return "topic" if end.kind in TOPICS else "service", end.name, ""


def find_endpoints(
    session: Session, names: Sequence[str], kinds: Sequence[Kind], report: Report
) -> list[Entity]:
    """Return the endpoints of topics or services; reports IDL655 for each name without any."""
    names = [f"/{name.removeprefix('/')}" for name in names]

    def is_there(name: str) -> bool:
        return any(session.graph.count(kind, name) for kind in kinds)

    session.graph.wait_for(lambda _: all(map(is_there, names)), APPEARING)
    entities = robot_entities(session, *kinds)
    noun = "topic" if Kind.PUBLISHER in kinds else "service"
    known = {end.name for end in entities}
    for name in sorted({*names} - known):
        hint = did_you_mean(name, known) or f"`idlc show` lists the {noun}s"
        report.add(codes.NO_SUCH_TOPIC.of("", f"no {noun} `{one_line(name)}`", hint=hint))
    return [end for end in entities if end.name in names]


def own_endpoint(session: Session, like: Entity, kind: Kind, qos: QoSProfile) -> Entity:
    """Return an endpoint of a hidden node of idlc's, for what another endpoint uses."""
    hidden = {"namespace": "/", "node": f"_idlc_{os.getpid()}", "node_id": 0}
    own = {"session": session.id, "id": session.next_id() + 1, "kind": kind, "qos": qos}
    return like.replace(enclave="/", **hidden, **own)


class Arrival(NamedTuple):
    """A sample, `None` after the last reply; the number of its source, and its time in ns."""

    number: int
    sample: Sample | None
    time: int


class Inbox:
    """Samples in the order of their arrival, from any thread; `lost` counts those without room."""

    def __init__(self) -> None:
        self.lost = 0
        self._room = MOST_WAITING
        self._lock = Lock()
        self._arrivals: SimpleQueue[tuple[int, Arrival]] = SimpleQueue()

    def put(self, number: int, sample: Sample | None) -> None:
        """Add a sample, if there is room."""
        size = _OVERHEAD + (len(sample.payload) if sample else 0)
        with self._lock:
            if size > self._room:
                self.lost += 1
            else:
                self._room -= size
                self._arrivals.put((size, Arrival(number, sample, time.time_ns())))

    def get(self, timeout: float) -> Arrival | None:
        """Return the next sample; `None` if none arrives within `timeout` seconds."""
        with suppress(Empty):
            size, arrival = self._arrivals.get(timeout=timeout)
            with self._lock:
                self._room += size
            return arrival
        return None


def call(
    session: Session, requests: Iterable[tuple[Entity, Any]], timeout: float
) -> Iterator[tuple[int, bytes]]:
    """Send requests to services, some at a time; yield the number of a request with each reply."""
    inbox, pending, unsent = Inbox(), 0, enumerate(requests)
    end, following = time.monotonic() + timeout, next(unsent, None)
    while (following or pending) and (left := end - time.monotonic()) > 0:
        if following and pending < AT_ONCE:
            number, (service, request) = following
            client = own_endpoint(session, service, Kind.CLIENT, QoSProfile(depth=10))
            gid = session.transport.gid(client)
            attachment = pack_attachment(1, time.time_ns(), gid)
            receive = partial(inbox.put, number)
            payload = request.serialize()
            session.transport.call(client, payload, attachment, receive, timeout=left)
            pending, following = pending + 1, next(unsent, None)
        elif arrival := inbox.get(min(left, TICK)):
            if arrival.sample:
                yield arrival.number, arrival.sample.payload
            else:
                pending -= 1
