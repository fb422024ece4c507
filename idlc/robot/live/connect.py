"""Sessions for commands, the endpoints that they announce, and reports on robots."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import did_you_mean, one_line
from idlc.robot.errors import RobotError
from idlc.robot.keys import Entity, Kind
from idlc.robot.qos import QoSProfile
from idlc.robot.session import Session, open_session
from idlc.robot.transport import Closeable

#: Seconds that commands wait for a connection, and for a name to appear.
CONNECTING = 5.0
APPEARING = 1.0
_TOPICS = (Kind.PUBLISHER, Kind.SUBSCRIPTION)


@contextmanager
def connected(
    address: str, report: Report, timeout: float = CONNECTING
) -> Iterator[Session | None]:
    """Yield a session with a robot; reports IDL642, and yields `None`, without an answer."""
    try:
        session = open_session(address, timeout=timeout)
    except RobotError as error:
        report.add(codes.NO_ANSWER.of("", error.message, hint=error.hint))
        yield None
        return
    with session:
        yield session


def robot_entities(session: Session, *kinds: Kind, name: str | None = None) -> list[Entity]:
    """Return the entities of other sessions, sorted by name."""
    entities = (session.graph.entities(kind, name=name) for kind in kinds or Kind)
    return sorted(
        (end for some in entities for end in some if end.session != session.id),
        key=lambda end: (end.name, end.node_name, end.token),
    )


def find_endpoints(
    session: Session, name: str, kinds: tuple[Kind, ...], report: Report
) -> list[Entity]:
    """Return the endpoints of a topic or service; reports IDL655 if there are none."""
    name = name if name.startswith("/") else f"/{name}"

    def present(_: object) -> list[Entity]:
        return robot_entities(session, *kinds, name=name)

    endpoints = session.graph.wait_for(present, APPEARING)
    if not endpoints:
        noun = "topic" if kinds == _TOPICS else "service"
        names = list(dict.fromkeys(end.name for end in robot_entities(session, *kinds)))
        hint = did_you_mean(name, names) or f"`idlc show` lists the {noun}s"
        report.add(codes.NO_SUCH_TOPIC.of("", f"no {noun} `{one_line(name)}`", hint=hint))
    return endpoints


def own_endpoint(session: Session, like: Entity, kind: Kind, qos: QoSProfile) -> Entity:
    """Return an endpoint of a hidden node of idlc's, for what another endpoint uses."""
    return Entity(
        domain=session.domain,
        session=session.id,
        node_id=0,
        id=session.next_id() + 1,
        kind=kind,
        node=f"_idlc_{os.getpid()}",
        name=like.name,
        type=like.type,
        hash=like.hash,
        qos=qos,
    )


def announce(session: Session, endpoint: Entity) -> Closeable:
    """Announce an endpoint, so that publishers that wait for subscriptions begin."""
    return session.transport.announce(endpoint.token)


def now() -> int:
    """Return the time that attachments contain, in nanoseconds."""
    return time.time_ns()
