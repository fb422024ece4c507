"""The names of ROS 2 on DDS: topics and types of its entities, and entities of what others tell.

A topic `/a` is `rt/a`; a service `/a` is two topics, `rq/aRequest` and `rr/aReply`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from idlc.robot.dds import info, wire
from idlc.robot.dds.discovery import Endpoint
from idlc.robot.dds.shared import Received
from idlc.robot.keys import Entity, Kind
from idlc.robot.names import ros_type

#: The last byte of the id of a writer and of a reader.
WRITER, READER = b"\x03", b"\x04"
#: The ends of the names and types of a service's topics.
HALVES = {"rq": ("Request", "Request_"), "rr": ("Reply", "Response_")}
#: The node of an endpoint that no node owns, as rcl calls it.
_UNKNOWN = "_NODE_NAME_UNKNOWN_"
#: Endpoints whose entities are not made again after each change.
_MOST_CACHED = 2**14
#: The kinds of endpoints; a service and a client are shown as their readers.
_KINDS = {
    ("rt", True): Kind.PUBLISHER,
    ("rt", False): Kind.SUBSCRIPTION,
    ("rq", False): Kind.SERVICE,
    ("rr", False): Kind.CLIENT,
}


def guid_of(prefix: bytes, number: int, kind: bytes) -> bytes:
    """Return the GUID of an own endpoint."""
    return prefix + (number & 0xFFFFFF).to_bytes(3, "big") + kind


def own_nodes(prefix: bytes, entities: Iterable[Entity]) -> Iterator[info.NodeInfo]:
    """Yield the own nodes with their endpoints."""
    nodes: dict[tuple[str, str], tuple[list[bytes], list[bytes]]] = {}
    for entity in entities:
        readers, writers = nodes.setdefault((entity.namespace, entity.node), ([], []))
        if entity.kind in (Kind.SUBSCRIPTION, Kind.SERVICE, Kind.CLIENT):
            readers.append(guid_of(prefix, entity.id + 1, READER))
        if entity.kind in (Kind.PUBLISHER, Kind.SERVICE, Kind.CLIENT):
            writers.append(guid_of(prefix, entity.id + 1, WRITER))
    for names, (readers, writers) in nodes.items():
        yield info.NodeInfo(*names, tuple(readers), tuple(writers))


class RemoteNodes:
    """What other participants tell of their nodes."""

    def __init__(self, domain: int) -> None:
        self._domain = domain
        self._nodes: dict[bytes, tuple[info.NodeInfo, ...]] = {}

    def learn(self, received: Received) -> bool:
        """Take a message of `ros_discovery_info`; return whether it is valid."""
        try:
            guid, nodes = info.parse_info(received.payload)
        except wire.WireError:
            return False
        # nobody speaks for another participant
        if guid[: wire.PREFIX] != received.writer[: wire.PREFIX]:
            return False
        self._nodes[guid[: wire.PREFIX]] = nodes
        return True

    def entities(
        self,
        prefixes: Iterable[bytes],
        endpoints: Iterable[Endpoint],
        hashes: Mapping[tuple[str, str], str],
    ) -> Iterator[Entity]:
        """Yield the entities of the participants that exist; forget what others told.

        DDS tells no hash of a service: `hashes` has those of the own ones by name and type.
        """
        self._nodes = {each: self._nodes[each] for each in prefixes if each in self._nodes}
        owners: dict[bytes, _Owner] = {}
        for prefix, nodes in self._nodes.items():
            for number, node in enumerate(nodes):
                owner = _Owner(self._domain, number, node.namespace, node.name)
                if entity := _entity(prefix, owner, number, Kind.NODE):
                    yield entity
                owners |= dict.fromkeys((*node.readers, *node.writers), owner)
        unknown = _Owner(self._domain, 0, "/", _UNKNOWN)
        for end in endpoints:
            if entity := _endpoint(end, owners.get(end.guid, unknown), hashes.get(_names(end), "")):
                yield entity


class _Owner(NamedTuple):
    """The node of an endpoint."""

    domain: int
    number: int
    namespace: str
    name: str


def _names(end: Endpoint) -> tuple[str, str]:
    """Return the names of an endpoint and of its type in ROS 2; the latter may be empty."""
    half, _, name = end.topic.partition("/")
    type_ = end.type
    if half in HALVES:
        name, type_ = map(str.removesuffix, (name, type_), HALVES[half])
    return f"/{name}", ros_type(type_) or ""


@lru_cache(_MOST_CACHED)
def _endpoint(end: Endpoint, owner: _Owner, service: str) -> Entity | None:
    """Return what ROS 2 shows of an endpoint; `None` if it shows nothing.

    `service` is the hash of a service if the participant tells none.
    """
    half = end.topic.partition("/")[0]
    kind, hash_ = _KINDS.get((half, end.is_writer)), end.hash
    if kind is None:
        return None
    if half in HALVES and not end.guid.startswith(wire.VENDOR):
        hash_ = service  # it told the hash of the request or of the response
    number = int.from_bytes(end.guid[12:15], "big")
    name, type_ = _names(end)
    more = {"name": name, "type": type_, "hash": hash_, "qos": end.qos}
    return _entity(end.guid[: wire.PREFIX], owner, number, kind, **more)


def _entity(prefix: bytes, owner: _Owner, number: int, kind: Kind, **more: Any) -> Entity | None:
    """Return an entity of another participant; `None` if its type has no valid name."""
    try:
        return Entity(
            domain=owner.domain,
            session=prefix.hex(),
            node_id=owner.number,
            id=number,
            kind=kind,
            namespace=owner.namespace,
            node=owner.name,
            **more,
        )
    except ValueError:
        return None
