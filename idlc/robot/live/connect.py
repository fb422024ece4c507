"""Connections for commands: the endpoints of a robot, and what arrives from them."""

from __future__ import annotations

import os
import time
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from itertools import islice
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any, NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.terminal import counted
from idlc.diagnostics.text import did_you_mean, one_line
from idlc.robot.errors import RobotError
from idlc.robot.keys import Entity, EntityKind, pack_attachment
from idlc.robot.live.graph import Communication as Noun
from idlc.robot.names import action_part
from idlc.robot.qos import QoSProfile
from idlc.robot.session import Session, open_session
from idlc.robot.transport import Sample

#: Seconds that commands wait for a name to appear.
APPEARING = 1.0
#: Seconds after which a wait is interrupted, because Windows does not interrupt one for Ctrl-C.
TICK = 0.5
#: Requests that wait for a service at a time: the queues of services hold ten.
MOST_OPEN = 8
#: Seconds after which a request without a reply counts as dropped.
DROPPED = 1.5
#: Entities of other domains that idlc looks at.
MOST_ENTITIES = 100_000
TOPICS = (EntityKind.PUBLISHER, EntityKind.SUBSCRIPTION)
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
        if not robot_entities(session):
            report.notes.append(where_nodes_are(session))
        if session.graph.is_full:
            report.notes.append("the robot announces too many endpoints; some are missing")
        if session.graph.is_incomplete:
            report.notes.append("the robot answers too slowly; endpoints may be missing")


def where_nodes_are(session: Session) -> str:
    """Return a sentence about a domain without nodes, and about those that have nodes."""
    others: Counter[int] = Counter()
    with suppress(TimeoutError):
        ends = islice(session.transport.entities(None, APPEARING), MOST_ENTITIES)
        others.update(end.domain for end in ends if end.kind is EntityKind.NODE)
    del others[session.domain]
    has = [f"; domain {own} has {counted(number, 'node')}" for own, number in others.most_common(5)]
    advice = "; set ROS_DOMAIN_ID" if has else ""
    return f"there is no node in domain {session.domain}{''.join(has)}{advice}"


def robot_entities(session: Session, *kinds: EntityKind) -> list[Entity]:
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
    session: Session, names: Sequence[str], kinds: Sequence[EntityKind], report: Report
) -> list[Entity]:
    """Return the endpoints of topics or services; reports IDL655 for each name without any."""
    names = [f"/{name.removeprefix('/')}" for name in names]

    def is_there(name: str) -> bool:
        return any(session.graph.count(kind, name) for kind in kinds)

    session.graph.wait_for(lambda _: all(map(is_there, names)), APPEARING)
    entities = robot_entities(session, *kinds)
    noun = "topic" if EntityKind.PUBLISHER in kinds else "service"
    known = {end.name for end in entities}
    for name in sorted({*names} - known):
        hint = did_you_mean(name, known) or f"`idlc show` with this address lists the {noun}s"
        report.add(codes.NO_SUCH_TOPIC.of("", f"no {noun} `{one_line(name)}`", hint=hint))
    return [end for end in entities if end.name in names]


def own_endpoint(session: Session, like: Entity, kind: EntityKind, qos: QoSProfile) -> Entity:
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
    session: Session,
    requests: Iterable[tuple[Entity, Any]],
    timeout: float,
    *,
    again: bool = False,
) -> Iterator[tuple[int, bytes]]:
    """Send requests to services, some at a time; yield the number of a request with each reply.

    With `again`, requests are repeated until there is a reply, since services drop requests.
    """
    calls = _Calls(session, [*requests], time.monotonic() + timeout)
    while (left := calls.end - time.monotonic()) > 0 and calls.waiting:
        calls.send(again=again)
        if arrival := calls.inbox.get(min(left, TICK)):
            number = calls.attempts[arrival.number]
            if arrival.sample:
                calls.waiting.discard(number)
                yield number, arrival.sample.payload
            else:
                calls.close(arrival.number)
                if not again:
                    calls.waiting.discard(number)


class _Calls:
    """Requests, of which `waiting` have no reply; an attempt is open until it ends."""

    def __init__(self, session: Session, requests: list[tuple[Entity, Any]], end: float) -> None:
        self.inbox = Inbox()
        self.end = end
        self.waiting = {*range(len(requests))}
        #: The number of the request of each attempt.
        self.attempts: list[int] = []
        self._session = session
        self._requests = requests
        self._unsent: dict[Entity, deque[int]] = {}
        for number, (service, _) in enumerate(requests):
            self._unsent.setdefault(service, deque()).append(number)
        self._open: dict[int, float] = {}
        self._counts: Counter[Entity] = Counter()
        #: Ended requests, and the time at which each is sent again.
        self._ended: deque[tuple[float, int]] = deque()

    def close(self, attempt: int) -> None:
        """End an attempt; its request may be sent again a little later."""
        if self._open.pop(attempt, None) is not None:
            number = self.attempts[attempt]
            self._counts[self._requests[number][0]] -= 1
            self._ended.append((time.monotonic() + TICK / 2, number))

    def send(self, *, again: bool) -> None:
        """Send what the services have room for."""
        now = time.monotonic()
        for attempt, since in [*self._open.items()] if again else ():
            if now - since < DROPPED:
                break
            self.close(attempt)
        while self._ended and self._ended[0][0] <= now:
            number = self._ended.popleft()[1]
            if again and number in self.waiting:
                self._unsent[self._requests[number][0]].append(number)
        for service, numbers in self._unsent.items():
            while numbers and self._counts[service] < MOST_OPEN:
                self._send(service, numbers.popleft())

    def _send(self, service: Entity, number: int) -> None:
        now = time.monotonic()
        self._counts[service] += 1
        self._open[len(self.attempts)] = now
        receive = partial(self.inbox.put, len(self.attempts))
        self.attempts.append(number)
        client = own_endpoint(self._session, service, EntityKind.CLIENT, QoSProfile(depth=10))
        transport = self._session.transport
        attachment = pack_attachment(1, time.time_ns(), transport.gid(client))
        payload = self._requests[number][1].serialize()
        left = max(0.1, self.end - now)
        transport.call(client, payload, attachment, receive, timeout=left)
