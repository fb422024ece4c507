"""What participants tell of themselves and of their endpoints, as values and on the wire."""

from __future__ import annotations

import re
import socket
import struct
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from idlc.robot.dds import formats, wire
from idlc.robot.dds.formats import Address
from idlc.robot.qos import (
    INFINITE,
    MOST_DEPTH,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
    incompatible_policies,
)

#: The writer and the reader of announcements of participants.
SPDP_WRITER, SPDP_READER = b"\x00\x01\x00\xc2", b"\x00\x01\x00\xc7"
#: The writers and readers of announcements of publications and of subscriptions.
SEDP = {
    True: (b"\x00\x00\x03\xc2", b"\x00\x00\x03\xc7"),
    False: (b"\x00\x00\x04\xc2", b"\x00\x00\x04\xc7"),
}
SEDP_QOS = QoSProfile(durability=DurabilityPolicy.TRANSIENT_LOCAL, history=HistoryPolicy.KEEP_ALL)

# the standard's ids of parameters
_LEASE, _TOPIC, _TYPE, _VERSION, _VENDOR, _RELIABILITY = 0x02, 0x05, 0x07, 0x15, 0x16, 0x1A
_LIVELINESS, _DURABILITY, _DEADLINE, _LIFESPAN, _USER_DATA = 0x1B, 0x1D, 0x23, 0x2B, 0x2C
_HISTORY = 0x40
_ENDPOINT_ADDRESS, _DEFAULT_ADDRESS, _META_ADDRESS = 0x2F, 0x31, 0x32
_PARTICIPANT, _BUILTIN, _ENDPOINT, KEY, STATUS = 0x50, 0x58, 0x5A, 0x70, 0x71
#: Announcer and detector of participants, publications and subscriptions.
_BUILTINS = 0x3F
PARTICIPANT_ID = b"\x00\x00\x01\xc1"
#: Seconds until a participant that sends nothing is gone: our own, and bounds of others.
LEASE = 20.0
_LEASES = (1.0, 600.0)
#: The longest name of a topic or a type, and the longest user data.
_MOST_TEXT = 1024
_UDP4 = 1
#: The address that a peer announces is only used if its packets come from it.
_MULTICAST = range(224, 240)
_HASH = rb"(?:^|;)%s=(RIHS\d{2}_[0-9a-f]{1,128});"
_ENDED = struct.pack(">I", 3)


class ParticipantData(NamedTuple):
    """A participant as it announces itself: its name, and ports; 0 if it offers no UDP."""

    prefix: bytes
    meta_port: int
    default_port: int
    lease: float


class EndpointData(NamedTuple):
    """A writer or a reader as its participant announces it; `port` is 0 if it has no own one.

    `hash` is the type hash of the message. `service` is the type hash of its service, which nodes
    announce since Lyrical.
    """

    guid: bytes
    topic: str
    type: str
    qos: QoSProfile
    hash: str = ""
    service: str = ""
    port: int = 0

    @property
    def is_writer(self) -> bool:
        """True for a writer."""
        return self.guid[-1] & 0x0F in (2, 3)

    @property
    def id(self) -> bytes:
        """Its id within its participant."""
        return self.guid[wire.PREFIX :]


class Peer:
    """Another participant; `is_known` after it has named this one."""

    def __init__(self, about: ParticipantData, host: str, now: float) -> None:
        self.prefix = about.prefix
        self.about = about
        self.host = host
        self.seen = now
        self.is_known = False
        self.endpoints: dict[bytes, EndpointData] = {}

    @property
    def meta(self) -> Address:
        """Where it receives announcements."""
        return self.host, self.about.meta_port

    def address(self, end: EndpointData) -> Address:
        """Return where an endpoint of it receives."""
        return self.host, end.port or self.about.default_port


def fits(end: EndpointData, other: EndpointData) -> bool:
    """Return whether two endpoints are connected."""
    writer, reader = (end, other) if end.is_writer else (other, end)
    if writer.is_writer == reader.is_writer or writer[1:3] != reader[1:3]:
        return False
    return not incompatible_policies(writer.qos, reader.qos)


def _first(parameters: wire.Parameters, name: int, size: int) -> bytes | None:
    values = parameters.get(name)
    return values[0] if values and len(values[0]) >= size else None


def _port(parameters: wire.Parameters, name: int, order: str) -> int:
    """Return the first port of UDP over IPv4; other kinds and multicast are left out."""
    for value in parameters.get(name, ()):
        if len(value) >= 24:
            kind, port = struct.unpack_from(order + "iI", value)
            if kind == _UDP4 and 0 < port < 2**16 and value[20] not in _MULTICAST:
                return int(port)
    return 0


def _text(parameters: wire.Parameters, name: int, order: str) -> str:
    value = _first(parameters, name, 5)
    if value is None:
        raise wire.WireError("no name")
    (size,) = struct.unpack_from(order + "I", value)
    if not 0 < size <= min(len(value) - 4, _MOST_TEXT):
        raise wire.WireError("a text of the wrong length")
    try:
        return value[4 : 3 + size].decode("ascii")
    except UnicodeDecodeError:
        raise wire.WireError("a name that is not ASCII") from None


def _duration(value: bytes | None, order: str, at: int = 0) -> int:
    """Return nanoseconds."""
    if value is None or len(value) < at + 8:
        return INFINITE
    seconds, fraction = struct.unpack_from(order + "iI", value, at)
    if seconds in (-1, 2**31 - 1):
        return INFINITE
    return max(1, int(seconds) * 10**9 + -(-int(fraction) * 10**9 >> 32))


def _profile(parameters: wire.Parameters, order: str, is_writer: bool) -> QoSProfile:
    def word(name: int, default: int) -> int:
        value = _first(parameters, name, 4)
        return default if value is None else int(struct.unpack_from(order + "I", value)[0])

    kept = _first(parameters, _HISTORY, 8)
    kind, depth = struct.unpack_from(order + "Ii", kept) if kept else (0, 0)
    history = (HistoryPolicy.KEEP_LAST, HistoryPolicy.KEEP_ALL)[kind % 2]
    reliable = word(_RELIABILITY, 2 if is_writer else 1) == 2
    manual = word(_LIVELINESS, 0) == 2
    return QoSProfile(
        history=history if kept else HistoryPolicy.UNKNOWN,
        depth=max(depth, 0),
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if word(_DURABILITY, 0) else DurabilityPolicy.VOLATILE
        ),
        deadline=_duration(_first(parameters, _DEADLINE, 8), order),
        lifespan=_duration(_first(parameters, _LIFESPAN, 8), order),
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC if manual else LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=_duration(_first(parameters, _LIVELINESS, 12), order, 4),
    )


def parse_participant(payload: bytes) -> ParticipantData:
    """Return the participant of an announcement; raise WireError."""
    parameters, order = wire.parse_list(payload)
    guid = _first(parameters, _PARTICIPANT, wire.GUID)
    if guid is None:
        raise wire.WireError("no name")
    lease = _duration(_first(parameters, _LEASE, 8), order) / 1e9
    meta, default = (_port(parameters, name, order) for name in (_META_ADDRESS, _DEFAULT_ADDRESS))
    bounded = min(max(lease, _LEASES[0]), _LEASES[1])
    return ParticipantData(guid[: wire.PREFIX], meta, default or meta, bounded)


def _hash(user: bytes, name: bytes) -> str:
    match = re.search(_HASH % name, user)
    return match[1].decode() if match else ""


def parse_endpoint(payload: bytes) -> EndpointData:
    """Return the endpoint of an announcement; raise WireError."""
    parameters, order = wire.parse_list(payload)
    guid = _first(parameters, _ENDPOINT, wire.GUID) or _first(parameters, KEY, wire.GUID)
    if guid is None:
        raise wire.WireError("no name")
    guid = guid[: wire.GUID]
    user = (_first(parameters, _USER_DATA, 4) or b"")[4 : 4 + _MOST_TEXT]
    is_writer = guid[-1] & 0x0F in (2, 3)
    return EndpointData(
        guid,
        _text(parameters, _TOPIC, order),
        _text(parameters, _TYPE, order),
        _profile(parameters, order, is_writer),
        _hash(user, b"typehash"),
        _hash(user, b"sertypehash"),
        _port(parameters, _ENDPOINT_ADDRESS, order),
    )


def ended(part: wire.Data) -> bytes | None:
    """Return the GUID of what a sample says is gone; `None` if it says something else."""
    status = _first(part.parameters, STATUS, 4)
    if status is None or not status[3] & 3:
        return None
    if (key := _first(part.parameters, KEY, wire.GUID)) is not None:
        return key[: wire.GUID]
    try:
        parameters, _ = wire.parse_list(part.payload)
    except wire.WireError:
        return None
    return _first(parameters, _ENDPOINT, wire.GUID) or _first(parameters, _PARTICIPANT, wire.GUID)


# what idlc announces


def _string(text: str) -> bytes:
    return _octets(text.encode() + b"\0")


def _octets(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def _locator(address: Address) -> bytes:
    return struct.pack("<iI12x", _UDP4, address[1]) + socket.inet_aton(address[0])


def _span(nanoseconds: int) -> bytes:
    if nanoseconds >= INFINITE - 1 or nanoseconds >= MOST_DEPTH * 10**9:
        return struct.pack("<iI", 2**31 - 1, 2**32 - 1)
    seconds, rest = divmod(nanoseconds, 10**9)
    return struct.pack("<iI", seconds, (rest << 32) // 10**9)


def format_participant(prefix: bytes, addresses: Iterable[Address]) -> bytes:
    """Return the announcement of the own participant."""

    def parameters() -> Iterator[tuple[int, bytes]]:
        yield _VERSION, b"\x02\x03"
        yield _VENDOR, wire.VENDOR
        yield _PARTICIPANT, prefix + PARTICIPANT_ID
        for address in addresses:
            yield _META_ADDRESS, _locator(address)
            yield _DEFAULT_ADDRESS, _locator(address)
        yield _LEASE, _span(int(LEASE * 1e9))
        yield _BUILTIN, struct.pack("<I", _BUILTINS)
        yield _USER_DATA, _octets(b"enclave=/;")

    return formats.LIST + formats.parameter_list(parameters())


def _user_data(end: EndpointData) -> str:
    """Return the type hashes, and for services and clients an id that both endpoints share.

    A server of rmw_cyclonedds waits until it knows both endpoints of a client by this id.
    """
    half = end.topic[:3]
    hashes = {"typehash": end.hash, "sertypehash": end.service}
    words = [f"{name}={each};" for name, each in hashes.items() if each]
    if half in ("rq/", "rr/"):
        role = "clientid" if end.is_writer is (half == "rq/") else "serviceid"
        words.append(f"{role}={end.guid[:-1].hex()};")
    return "".join(words)


def format_endpoint(end: EndpointData) -> bytes:
    """Return the announcement of an own endpoint."""
    qos = end.qos
    reliability = 2 if qos.is_reliable else 1
    liveliness = 2 if qos.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC else 0

    def parameters() -> Iterator[tuple[int, bytes]]:
        yield _ENDPOINT, end.guid
        yield _PARTICIPANT, end.guid[: wire.PREFIX] + PARTICIPANT_ID
        yield _TOPIC, _string(end.topic)
        yield _TYPE, _string(end.type)
        yield _RELIABILITY, struct.pack("<I", reliability) + _span(100_000_000)
        yield _DURABILITY, struct.pack("<I", int(qos.is_latched))
        # others leave it out, and read it
        yield _HISTORY, struct.pack("<Ii", qos.history is HistoryPolicy.KEEP_ALL, qos.depth)
        yield _DEADLINE, _span(qos.deadline)
        yield _LIVELINESS, struct.pack("<I", liveliness) + _span(qos.liveliness_lease_duration)
        if end.is_writer:
            yield _LIFESPAN, _span(qos.lifespan)
        yield _VERSION, b"\x02\x03"
        yield _VENDOR, wire.VENDOR
        if user := _user_data(end):
            yield _USER_DATA, _octets(user.encode())

    return formats.LIST + formats.parameter_list(parameters())


def format_end(guid: bytes) -> bytes:
    """Return the inline parameters that say that something is gone."""
    return formats.parameter_list(iter([(KEY, guid), (STATUS, _ENDED)]))
