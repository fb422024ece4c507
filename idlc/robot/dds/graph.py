"""The graph of ROS 2 on DDS: topics and types of its entities, and entities of what others tell.

A topic `/a` is `rt/a`; a service `/a` is two topics, `rq/aRequest` and `rr/aReply`. The topic
`ros_discovery_info` says which node has which endpoints.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from typing import NamedTuple, TypeAlias

from idlc.robot.dds import wire
from idlc.robot.dds.discovery import EndpointData
from idlc.robot.dds.wire import GUID, WireError
from idlc.robot.keys import Entity, EntityKind
from idlc.robot.names import is_absolute, is_namespace, is_node_name, ros_type
from idlc.robot.nodes.interfaces import standard

#: The topic about nodes, its type, and the most bytes of one message of it and of a name in it:
#: names are keys of caches.
INFO_TOPIC = "ros_discovery_info"
INFO_TYPE = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
#: The hash of this type since Iron; without one, nodes of rmw_cyclonedds print a warning.
INFO_HASH = "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"
_MOST, _MOST_NAME = 2**20, 512
#: The last byte of the id of a writer and of a reader.
WRITER, READER = b"\x03", b"\x04"
#: The ends of the names and types of a service's topics.
HALVES = {"rq": ("Request", "Request_"), "rr": ("Reply", "Response_")}
#: The suffix of the topics on which Lyrical's nodes exchange buffers. idlc receives the messages
#: on the topic without it.
_BUFFERS = "/_buf_cpu"
#: The node of an endpoint that no node owns, as rcl calls it.
_UNKNOWN = "_NODE_NAME_UNKNOWN_"
#: Endpoints whose entities are not made again after each change.
_MOST_CACHED = 2**14
#: Nodes and their endpoints, of all participants.
_MOST_OF_ALL = 2**16
#: The kinds of endpoints; a service and a client are shown as their readers.
_KINDS = {
    ("rt", True): EntityKind.PUBLISHER,
    ("rt", False): EntityKind.SUBSCRIPTION,
    ("rq", False): EntityKind.SERVICE,
    ("rr", False): EntityKind.CLIENT,
}


#: The services that every node has, with the hashes of their requests and responses in Jazzy.
_OF_NODES = """
rcl_interfaces/srv/DescribeParameters
  05dd1c2bc87dec2627105c8070d6f9725c781a4f2ab852975bf105462b82b644
  ad6747319613c6131589e062e095b469a46cc764f7d0f12a001a49e6cd893995
rcl_interfaces/srv/GetParameterTypes
  87d7ec5ef545d4daa289d500025d31fb2437bc8b8365ca367161c4dac4be33fd
  ac1335dce67c478e669434f6ac2fbff34fcd529580f272d3006785ba8b54e47f
rcl_interfaces/srv/GetParameters
  135a9e1c3d7cebef792f6687d7ddf99949b21a0bd9a320d863a9110a3f5cf4d6
  9fa773b46e39cc5d02db6224d8fd520bb9caeeffc2b27c96c1e59431baba9f2a
rcl_interfaces/srv/ListParameters
  a1b0b5d6b967a5b8ac5bc8563c3ea678f349e312a6a4967227c5a96bc5ce38df
  31b937b82de3612426be79f231e386259f97e8dc843e3f2845288b4bfa296bdd
rcl_interfaces/srv/SetParameters
  130d46386b7e84ea9ecf60608a4d83cbe5e5cb7c6cc5b712b7a4e3a6c254e932
  7a0e8140a0b8d98308fa81a5403a766e610af29a239caf54b7553227906fc266
rcl_interfaces/srv/SetParametersAtomically
  db0bd950ed5ed867a0e90b225e44dea382d762c0762ff3e0ee842190042a59e5
  31b1a38c5b0b9d893ee24da45f69638f4561c78461d82d52750f429b534502b8
type_description_interfaces/srv/GetTypeDescription
  470f56ccbcf13d55c78c8b735fb12da03e639e5acded994426c89d94778d9e28
  648c49d976240861a482f961c5621ddd0d2135d8cce6f297a76d4f6376d93b75
""".split()
#: The hashes of these services, by type and the hashes of request and response.
SERVICES: dict[tuple[str, ...], str] = {
    (name, f"RIHS01_{request}", f"RIHS01_{response}"): standard(name).hash
    for name, request, response in zip(*(_OF_NODES[part::3] for part in range(3)), strict=True)
}


class NodeInfo(NamedTuple):
    """A node, and the GUIDs of its endpoints."""

    namespace: str
    name: str
    readers: tuple[bytes, ...]
    writers: tuple[bytes, ...]


class _Cursor:
    """Reads CDR; raises WireError where it ends early or a name is too long."""

    def __init__(self, payload: bytes) -> None:
        self.order = "<" if payload[1:2] == b"\x01" else ">"
        self.data = payload[4:]
        self.at = 0

    def take(self, size: int) -> bytes:
        """Return bytes."""
        if size > len(self.data) - self.at:
            raise WireError("cut off")
        self.at += size
        return self.data[self.at - size : self.at]

    def count(self) -> int:
        """Return a length."""
        self.at += -self.at % 4
        (number,) = struct.unpack(self.order + "I", self.take(4))
        return int(number)

    def text(self) -> str:
        """Return a string, which need not be a valid name."""
        size = self.count()
        if size > _MOST_NAME:
            raise WireError("a long name")
        return self.take(size).rstrip(b"\0").decode("ascii", "replace")

    def gids(self, size: int) -> tuple[bytes, ...]:
        """Return GUIDs."""
        return tuple(self.take(size)[:GUID] for _ in range(self.count()))


def parse_info(payload: bytes) -> tuple[bytes, tuple[NodeInfo, ...]]:
    """Return the GUID of a participant and its nodes; raise WireError.

    The ids have 24 bytes on Humble and 16 since; only one of the two fits the payload.
    """
    if len(payload) > _MOST:
        raise WireError("too large")
    try:
        return _parse(payload, GUID)
    except WireError:
        return _parse(payload, 24)


def _parse(payload: bytes, size: int) -> tuple[bytes, tuple[NodeInfo, ...]]:
    cursor = _Cursor(payload)
    guid = cursor.take(size)[:GUID]
    nodes = tuple(
        NodeInfo(cursor.text(), cursor.text(), cursor.gids(size), cursor.gids(size))
        for _ in range(cursor.count())
    )
    if len(cursor.data) - cursor.at > 3:  # more than the padding
        raise WireError("a rest")
    return guid, nodes


def format_info(prefix: bytes, nodes: Iterable[NodeInfo]) -> bytes:
    """Return the message about the own participant."""
    data = bytearray(prefix + b"\x00\x00\x01\xc1")

    def add_count(number: int) -> None:
        data.extend(bytes(-len(data) % 4) + struct.pack("<I", number))

    nodes = [*nodes]
    add_count(len(nodes))
    for node in nodes:
        for text in (node.namespace, node.name):
            name = text.encode() + b"\0"
            add_count(len(name))
            data.extend(name)
        for guids in (node.readers, node.writers):
            add_count(len(guids))
            data.extend(b"".join(guids))
    return b"\x00\x01\x00\x00" + bytes(data)


def guid_of(prefix: bytes, number: int, kind: bytes) -> bytes:
    """Return the GUID of an own endpoint."""
    return prefix + (number & 0xFFFFFF).to_bytes(3, "big") + kind


def own_nodes(prefix: bytes, entities: Iterable[Entity]) -> Iterator[NodeInfo]:
    """Yield the own nodes with their endpoints."""
    nodes: dict[tuple[str, str], tuple[list[bytes], list[bytes]]] = {}
    for entity in entities:
        readers, writers = nodes.setdefault((entity.namespace, entity.node), ([], []))
        if entity.kind in (EntityKind.SUBSCRIPTION, EntityKind.SERVICE, EntityKind.CLIENT):
            readers.append(guid_of(prefix, entity.id + 1, READER))
        if entity.kind in (EntityKind.PUBLISHER, EntityKind.SERVICE, EntityKind.CLIENT):
            writers.append(guid_of(prefix, entity.id + 1, WRITER))
    for names, (readers, writers) in nodes.items():
        yield NodeInfo(*names, tuple(readers), tuple(writers))


class RemoteNodes:
    """What other participants tell of their nodes."""

    def __init__(self, domain: int) -> None:
        self._domain = domain
        self._nodes: dict[bytes, tuple[NodeInfo, ...]] = {}

    def learn(self, received: wire.Data) -> bool:
        """Take a message of `ros_discovery_info`; return whether it is valid."""
        try:
            guid, nodes = parse_info(received.payload)
        except WireError:
            return False
        prefix = guid[: wire.PREFIX]
        others = sum(_size(each) for name, each in self._nodes.items() if name != prefix)
        # nobody speaks for another participant
        if prefix != received.writer[: wire.PREFIX] or others + _size(nodes) > _MOST_OF_ALL:
            return False
        self._nodes[prefix] = nodes
        return True

    def entities(
        self,
        prefixes: Iterable[bytes],
        endpoints: Iterable[EndpointData],
        hashes: Mapping[tuple[str, str], str],
    ) -> Iterator[Entity]:
        """Yield the entities of the participants that exist; forget what others told.

        Before Lyrical, nodes tell the hashes of requests and responses, but none of a service:
        `hashes` has those of the own ones by name and type.
        """
        self._nodes = {each: self._nodes[each] for each in prefixes if each in self._nodes}
        owners: dict[bytes, Entity | None] = {}
        for prefix, nodes in self._nodes.items():
            for number, node in enumerate(nodes):
                owner = _node(self._domain, prefix, number, node.namespace, node.name)
                if owner is not None:
                    yield owner
                owners |= dict.fromkeys((*node.readers, *node.writers), owner)
        sides = [(end, _side(end)) for end in endpoints]
        halves: dict[_Side, dict[str, str]] = {}
        for end, side in sides:
            halves.setdefault(side, {})[end.topic.partition("/")[0]] = end.hash
        for end, side in sides:
            _, name, type_, _ = side
            told = (halves[side].get(half, "") for half in HALVES)
            own = hashes.get((name, type_))
            service = end.service or own or SERVICES.get((type_, *told), "")
            unknown = _node(self._domain, end.guid[: wire.PREFIX], 0, "/", _UNKNOWN)
            if entity := _endpoint(end, owners.get(end.guid, unknown), service):
                yield entity


def _size(nodes: tuple[NodeInfo, ...]) -> int:
    return sum(1 + len(node.readers) + len(node.writers) for node in nodes)


def _names(end: EndpointData) -> tuple[str, str]:
    """Return the names of an endpoint and of its type in ROS 2; the latter may be empty."""
    half, _, name = end.topic.partition("/")
    type_ = end.type
    if half in HALVES:
        name, type_ = map(str.removesuffix, (name, type_), HALVES[half])
    return f"/{name}", ros_type(type_) or ""


#: A participant, the names of a service and of its type, and whether it is the server.
_Side: TypeAlias = tuple[bytes, str, str, bool]


def _side(end: EndpointData) -> _Side:
    """Return the side of a service that an endpoint is half of."""
    is_request = end.topic.startswith("rq/")
    return end.guid[: wire.PREFIX], *_names(end), is_request is not end.is_writer


@lru_cache(_MOST_CACHED)
def _node(domain: int, prefix: bytes, number: int, namespace: str, name: str) -> Entity | None:
    """Return a node of another participant; `None` if its name is not valid."""
    if not (is_namespace(namespace) and is_node_name(name)):
        return None
    return Entity(
        domain=domain,
        session=prefix.hex(),
        node_id=number,
        id=number,
        kind=EntityKind.NODE,
        namespace=namespace,
        node=name,
    )


@lru_cache(_MOST_CACHED)
def _endpoint(end: EndpointData, owner: Entity | None, service: str) -> Entity | None:
    """Return what ROS 2 shows of an endpoint; `None` if it shows nothing.

    `service` is the hash of the service.
    """
    half = end.topic.partition("/")[0]
    kind, hash_ = _KINDS.get((half, end.is_writer)), end.hash
    name, type_ = _names(end)
    is_hidden = name.endswith(_BUFFERS) or not is_absolute(name)
    if kind is None or owner is None or is_hidden:
        return None
    if half in HALVES:
        hash_ = service  # the endpoint announces the hash of the request or the response
    number = int.from_bytes(end.guid[12:15], "big")
    with suppress(ValueError):  # it is not a type of ROS 2
        return owner.replace(id=number, kind=kind, name=name, type=type_, hash=hash_, qos=end.qos)
    return None
