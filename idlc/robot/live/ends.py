"""The graph of a robot in the form in which `idlc breaking` compares graphs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from idlc.compare.graph import Answer, Endpoint, Entity, Question, Role
from idlc.diagnostics.report import Report
from idlc.robot.keys import Kind
from idlc.robot.live.connect import connected, robot_entities
from idlc.robot.live.types import ask
from idlc.robot.names import action_part
from idlc.robot.session import Session

_ROLES: dict[Kind, Role] = {
    Kind.PUBLISHER: "publisher",
    Kind.SUBSCRIPTION: "subscription",
    Kind.SERVICE: "server",
    Kind.CLIENT: "client",
}


class RobotGraph:
    """The graph that a session sees."""

    #: Endpoints of services announce the hash of the whole service.
    has_hashes_of_services = True

    def __init__(self, session: Session) -> None:
        self._session = session

    def endpoints(self, patience: float) -> tuple[Endpoint, ...]:
        """Return all ends of topics, services and actions, after waiting for the first one."""
        self._session.graph.wait_for(lambda graph: graph.entities(), patience)
        return tuple(sorted(set(self._endpoints())))

    def _endpoints(self) -> Iterator[Endpoint]:
        for end in robot_entities(self._session, *_ROLES):
            part, is_service = action_part(end.name), end.kind in (Kind.SERVICE, Kind.CLIENT)
            entity: Entity = "action" if part else "service" if is_service else "topic"
            role, name = _ROLES[end.kind], part[0] if part else end.name
            sends = end.kind in (Kind.PUBLISHER, Kind.CLIENT)
            if part and not is_service:
                role = "server" if sends else "client"
            for suffix, direction in (("_Request", sends), ("_Response", not sends)):
                structure = f"{end.type}{suffix}" if is_service else end.type
                yield Endpoint(
                    end.node_name,
                    entity,
                    name,
                    role,
                    direction if is_service else sends,
                    structure,
                    end.hash,
                )

    def ask(self, questions: Iterable[Question], patience: float) -> dict[Question, Answer]:
        """Return the nodes' answers within `patience` seconds; each question has one."""
        return ask(self._session, questions, patience)


@contextmanager
def join_robot(address: str, report: Report, patience: float) -> Iterator[RobotGraph | None]:
    """Yield the graph of a robot; reports IDL642 if it does not answer."""
    with connected(address, report, patience) as session:
        yield RobotGraph(session) if session else None
