"""rmw_zenoh's protocol: data keys, liveliness tokens, the QoS part of a token, attachments.

A token announces a node or an endpoint to all sessions. Tokens and attachments that others send
are bounded and checked here, so that an `Entity` contains only valid names.
"""

from __future__ import annotations

import re
import struct
from enum import Enum
from functools import lru_cache
from typing import Any, NamedTuple

import msgspec

from idlc.robot.names import dds_type, full_name, is_absolute, is_namespace, is_node_name, ros_type
from idlc.robot.qos import QoSProfile

#: The longest token that idlc reads.
MOST_TOKEN = 2048
#: The hash of Humble, which has none.
NO_HASH = "TypeHashNotSupported"
GID_SIZE = 16
_SECOND = 10**9
_PREFIX = "@ros2_lv"
#: A node, or a node and an endpoint: names, a type of DDS, a hash and QoS. `/` in names is `%`.
_TOKEN = re.compile(
    rf"{_PREFIX}/(?P<domain>\d{{1,6}})/(?P<session>[0-9a-f]{{1,32}})/(?P<node_id>\d{{1,10}})"
    r"/(?P<id>\d{1,10})/(?:NN|(?P<kind>M[PS]|S[SC]))/(?P<enclave>[^/]+)/(?P<namespace>[^/]+)"
    r"/(?P<node>[^/]+)(?(kind)/(?P<name>[^/]+)/(?P<type>[^/]+)/(?P<hash>\w{1,128})/(?P<qos>[^/]+))"
    r"(?:/|\Z)",
    re.ASCII,
)
_QOS = "{}:{}:{},{}:{},{}:{},{}:{},{},{}"
_QOS_PATTERN = re.compile(_QOS.replace("{}", r"(\d{0,10})"), re.ASCII)


class EntityKind(str, Enum):
    """A kind of entity; the values are those in tokens."""

    NODE = "NN"
    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVICE = "SS"
    CLIENT = "SC"


class Entity(msgspec.Struct, frozen=True, kw_only=True):
    """A node or an endpoint, as its token announces it.

    `session` is the Zenoh id, `id` counts in the session, `node_id` is the `id` of the node.
    `name` is absolute, `type` is such as `std_msgs/msg/String`, and `hash` is empty if the other
    side sends none (Humble); all are empty for a node. `token` is made of the other fields unless
    it was received.
    """

    domain: int
    session: str
    node_id: int
    id: int
    kind: EntityKind
    enclave: str = "/"
    namespace: str = "/"
    node: str
    name: str = ""
    type: str = ""
    hash: str = ""
    qos: QoSProfile = msgspec.field(default_factory=QoSProfile)
    token: str = ""

    def __post_init__(self) -> None:
        """Make the token of an own entity."""
        if not self.token:
            msgspec.structs.force_setattr(self, "token", _make_token(self))

    def replace(self, **changes: Any) -> Entity:
        """Return an entity with other values, and the token that is made of them."""
        return Entity(**{**msgspec.structs.asdict(self), "token": "", **changes})

    @property
    def node_name(self) -> str:
        """The absolute name of the node."""
        return full_name(self.namespace, self.node)

    @property
    def key(self) -> str:
        """The key of the endpoint's messages, or of its requests."""
        name = self.name.strip("/")
        return f"{self.domain}/{name}/{dds_type(self.type)}/{self.hash or NO_HASH}"

    @property
    def gid(self) -> bytes:
        """The id that the endpoint adds to each message."""
        from xxhash import xxh3_128_intdigest

        return xxh3_128_intdigest(self.token.encode()).to_bytes(GID_SIZE, "little")


def all_tokens(domain: int | None) -> str:
    """Return the key expression of all tokens of a domain, or of all domains."""
    return f"{_PREFIX}/{'*' if domain is None else domain}/**"


def _make_token(entity: Entity) -> str:
    names = [entity.enclave, entity.namespace, entity.node]
    end = []
    if entity.kind is not EntityKind.NODE:
        names += (entity.name, dds_type(entity.type), entity.hash or NO_HASH)
        end = [format_qos(entity.qos)]
    head = (_PREFIX, entity.domain, entity.session, entity.node_id, entity.id, entity.kind.value)
    return "/".join([*map(str, head), *(name.replace("/", "%") for name in names), *end])


def parse_token(token: str) -> Entity | None:
    """Return the entity that a token announces; `None` if it is malformed.

    Further parts, which later versions of rmw_zenoh add, are ignored.
    """
    match = _TOKEN.match(token) if len(token) <= MOST_TOKEN else None
    if match is None:
        return None
    parts: dict[str, Any] = match.groupdict("")
    for name in ("enclave", "namespace", "node", "name", "type"):
        parts[name] = parts[name].replace("%", "/")
    type_, qos = ros_type(parts["type"]), parse_qos(parts["qos"])
    is_endpoint = is_absolute(parts["name"]) and type_ and qos
    if not (is_namespace(parts["enclave"]) and is_namespace(parts["namespace"])):
        return None
    if not is_node_name(parts["node"]) or (parts["kind"] and not is_endpoint):
        return None
    parts |= {name: int(parts[name]) for name in ("domain", "node_id", "id")}
    parts["hash"] = "" if parts["hash"] == NO_HASH else parts["hash"]
    parts |= {"kind": EntityKind(parts["kind"] or EntityKind.NODE), "type": type_ or ""}
    return Entity(**parts | {"qos": qos or QoSProfile(), "token": token})


def _numbers(qos: QoSProfile) -> tuple[int, ...]:
    """Return the numbers of a profile in the order of a token."""
    return (
        *(qos.reliability, qos.durability, qos.history, qos.depth),
        *divmod(qos.deadline, _SECOND),
        *divmod(qos.lifespan, _SECOND),
        qos.liveliness,
        *divmod(qos.liveliness_lease_duration, _SECOND),
    )


_DEFAULTS = _numbers(QoSProfile())


def format_qos(qos: QoSProfile) -> str:
    """Return the QoS part of a token, in which defaults are empty."""
    pairs = zip(_numbers(qos), _DEFAULTS, strict=True)
    return _QOS.format(*("" if value == default else int(value) for value, default in pairs))


@lru_cache(1024)
def parse_qos(text: str) -> QoSProfile | None:
    """Return the profile of a token's QoS part; `None` if it is malformed."""
    match = _QOS_PATTERN.fullmatch(text)
    if match is None:
        return None
    pairs = zip(match.groups(), _DEFAULTS, strict=True)
    numbers: Any = [int(number) if number else default for number, default in pairs]
    try:
        return QoSProfile(
            reliability=numbers[0],
            durability=numbers[1],
            history=numbers[2],
            depth=numbers[3],
            deadline=numbers[4] * _SECOND + numbers[5],
            lifespan=numbers[6] * _SECOND + numbers[7],
            liveliness=numbers[8],
            liveliness_lease_duration=numbers[9] * _SECOND + numbers[10],
        )
    except ValueError:
        return None


class Attachment(NamedTuple):
    """The bytes that accompany each message, request and reply.

    `sequence` counts the messages of the sender from 1, `time` is its clock in nanoseconds. A
    reply repeats the `sequence` and the `gid` of its request.
    """

    sequence: int
    time: int
    gid: bytes


#: A number, a time, the length of a gid, and the gid.
ATTACHMENT = struct.Struct(f"<qqB{GID_SIZE}s")


def pack_attachment(sequence: int, time: int, gid: bytes) -> bytes:
    """Return an attachment as bytes."""
    return ATTACHMENT.pack(sequence, time, GID_SIZE, gid)


def parse_attachment(data: bytes) -> Attachment | None:
    """Return the attachment of a message; `None` if it is malformed.

    Further bytes, which a later version may add, are ignored.
    """
    if len(data) < ATTACHMENT.size:
        return None
    sequence, time, size, gid = ATTACHMENT.unpack_from(data)
    return Attachment(sequence, time, gid) if size == GID_SIZE else None
