"""The packets to send: their bytes, always little-endian, and what the ends of a participant share.

The ends share the time, the packets to send, and the room for samples. Requests and replies refer
to each other in the forms of Fast DDS and of Cyclone DDS.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

from idlc.robot.dds import wire

#: The protocol, its version 2.3, and the vendor.
_HEAD = b"RTPS\x02\x03" + wire.VENDOR
#: The encapsulation of a list of parameters.
LIST = b"\x00\x03\x00\x00"
#: The IP address and the port of a socket.
Address: TypeAlias = tuple[str, int]
#: The parameters by which Fast DDS names the request of a reply; the second is its older one.
_RELATED = (0x83, 0x800F)
#: Offsets in a request or reply of Cyclone DDS: of the client and the number, and of the message.
_NAMED, _REST = 4, 20
#: Bytes of all samples that cannot be delivered yet.
MOST_WAITING = 512 << 20
#: Bytes that the questions of a participant draw at once, and in a second; those that a packet
#: costs besides; and the participants for which that is remembered.
_MOST_DRAWN, _DRAWN, _PACKET, _MOST_KNOWN = 4 << 20, 64 << 20, 1024, 4096


def format_packet(prefix: bytes, parts: Iterable[bytes]) -> bytes:
    """Return a packet of a participant."""
    return b"".join((_HEAD, prefix, *parts))


def _part(kind: int, flags: int, *content: bytes) -> bytes:
    size = sum(map(len, content))
    # 0 means up to the end of the packet
    head = struct.pack("<BBH", kind, flags | wire.LITTLE, size if size < 2**16 else 0)
    return b"".join((head, *content))


def format_number(number: int) -> bytes:
    """Return a sequence number."""
    return struct.pack("<iI", number >> 32, number & 0xFFFFFFFF)


def for_participant(prefix: bytes) -> bytes:
    """Return the part that says for which participant the next ones are."""
    return _part(wire.DESTINATION, 0, prefix)


def at_time(nanoseconds: int) -> bytes:
    """Return the part that tells when the next samples were sent."""
    seconds, rest = divmod(nanoseconds, 10**9)
    return _part(wire.TIMESTAMP, 0, struct.pack("<II", seconds & 0xFFFFFFFF, (rest << 32) // 10**9))


def format_data(reader: bytes, writer: bytes, number: int, inline: bytes, payload: bytes) -> bytes:
    """Return a sample; without a payload it says by its parameters what ended."""
    flags = (wire.INLINE if inline else 0) | (wire.PAYLOAD if payload else 0)
    head = b"\0\0\x10\0" + reader + writer + format_number(number)
    return _part(wire.DATA, flags, head, inline, payload)


def format_fragment(
    reader: bytes, writer: bytes, number: int, inline: bytes, payload: bytes, first: int, size: int
) -> bytes:
    """Return one fragment of a sample."""
    flags = wire.INLINE if inline else 0
    head = b"\0\0\x1c\0" + reader + writer + format_number(number)
    head += struct.pack("<IHHI", first, 1, size, len(payload))
    return _part(wire.FRAGMENT, flags, head, inline, payload[(first - 1) * size : first * size])


def format_heartbeat(reader: bytes, writer: bytes, first: int, last: int, count: int) -> bytes:
    """Return a heartbeat that asks for an answer."""
    numbers = format_number(first) + format_number(last) + struct.pack("<I", count)
    return _part(wire.HEARTBEAT, 0, reader, writer, numbers)


def _set(base: int, members: Sequence[int]) -> bytes:
    """Return a set of ascending numbers, of 256 from `base`."""
    size = members[-1] - base + 1 if members else 0
    words = [0] * ((size + 31) // 32)
    for member in members:
        words[(member - base) // 32] |= 1 << (31 - (member - base) % 32)
    return struct.pack(f"<I{len(words)}I", size, *words)


def format_acknack(
    reader: bytes, writer: bytes, base: int, missing: list[int], count: int, *, is_final: bool
) -> bytes:
    """Return what a reader lacks, of the next 256 numbers from `base`; a final one ends a talk."""
    members = _set(base, missing)
    tail = format_number(base) + members + struct.pack("<I", count)
    return _part(wire.ACKNACK, wire.FINAL if is_final else 0, reader, writer, tail)


def format_gap(reader: bytes, writer: bytes, numbers: list[int]) -> bytes:
    """Return that these numbers, of 256 from the first one, never come."""
    base, others = numbers[0] + 1, numbers[1:]
    ends = format_number(numbers[0]) + format_number(base)
    return _part(wire.GAP, 0, reader, writer, ends, _set(base, others))


def format_nack_fragment(
    reader: bytes, writer: bytes, number: int, missing: list[int], count: int
) -> bytes:
    """Return the fragments that a reader lacks, of 256 from the first missing one."""
    base = missing[0]
    members = _set(base, missing)
    tail = format_number(number) + struct.pack("<I", base) + members + struct.pack("<I", count)
    return _part(wire.NACK_FRAGMENT, 0, reader, writer, tail)


def parameter(name: int, value: bytes) -> bytes:
    """Return a parameter, padded to four bytes."""
    padded = value + bytes(-len(value) % 4)
    return struct.pack("<HH", name, len(padded)) + padded


def parameter_list(parameters: Iterator[tuple[int, bytes]]) -> bytes:
    """Return parameters and their end."""
    return b"".join((*(parameter(*each) for each in parameters), parameter(wire.SENTINEL, b"")))


def is_cyclone(guid: bytes) -> bool:
    """Return whether an end is of Cyclone DDS, with which GUIDs there begin."""
    return guid.startswith(b"\x01\x10")


# Fast DDS names the request by inline parameters. Requests and replies of rmw_cyclonedds begin with
# 8 bytes that the client chose, and a number.


def _related(parameters: wire.Parameters) -> tuple[bytes, int] | None:
    """Return the writer and the number of the request that a reply answers."""
    for name in _RELATED:
        for value in parameters.get(name, ()):
            if len(value) >= 24:
                high, low = struct.unpack_from("<iI", value, wire.GUID)
                return value[: wire.GUID], high << 32 | low
    return None


def format_related(writer: bytes, number: int) -> bytes:
    """Return the inline parameters that name a request."""
    value = writer + format_number(number)
    return parameter_list((name, value) for name in _RELATED)


def _order(payload: bytes) -> str:
    return "<" if payload[1] & 1 else ">"


def wrap(payload: bytes, inline: bytes) -> bytes:
    """Return a request or reply for Cyclone DDS; `inline` names the request."""
    named = _related(wire.parse_parameters(inline, 0, "<")[0])
    if named is None:
        return payload
    client, number = named
    (client_id,) = struct.unpack_from("<8xQ", client)
    head = struct.pack(_order(payload) + "Qq", client_id, number)
    return payload[:_NAMED] + head + payload[_NAMED:]


def unwrap(received: wire.Data, start: bytes) -> tuple[bytes, tuple[bytes, int] | None]:
    """Return the payload of a request or reply, and the client and number that it names.

    Of a client of Cyclone DDS, the name is 8 bytes, which follow `start`.
    """
    payload = received.payload
    if not is_cyclone(received.writer):
        return payload, _related(received.parameters)
    if len(payload) < _REST:
        return payload, None
    client_id, number = struct.unpack_from(_order(payload) + "Qq", payload, _NAMED)
    name = start + struct.pack("<Q", client_id)
    return payload[:_NAMED] + payload[_REST:], (name, number)


class Outgoing(NamedTuple):
    """Parts of a packet for a participant at an address."""

    address: Address
    prefix: bytes
    parts: tuple[bytes, ...]


class Remote:
    """The other end of a connection."""

    def __init__(self, guid: bytes, address: Address, reliable: bool) -> None:
        self.guid = guid
        self.prefix, self.id = guid[: wire.PREFIX], guid[wire.PREFIX :]
        self.address = address
        self.reliable = reliable


class Shared:
    """The state that the endpoints of a participant share: time, packets to send, room for samples.

    `fragment` returns the most bytes of a fragment for a host. Of the room, a participant gets at
    most as much as is left for the others.
    """

    def __init__(self, fragment: Callable[[str], int]) -> None:
        self.fragment = fragment
        self.now = 0.0
        #: What the ends have to do, and when.
        self.due: dict[Callable[[], None], float] = {}
        #: The readers of each matched writer.
        self.matched: dict[bytes, list[Any]] = {}
        self._packets: list[Outgoing] = []
        self._used: Counter[bytes] = Counter()
        #: The bytes that participants may draw, and when that was so.
        self._drawn: dict[bytes, tuple[int, float]] = {}

    def send(self, end: Remote, *parts: bytes) -> None:
        """Send parts of a packet to an end."""
        self._packets.append(Outgoing(end.address, end.prefix, parts))

    def tick(self) -> None:
        """Do what is due."""
        for action in [action for action, time in self.due.items() if time <= self.now]:
            del self.due[action]
            action()

    def collect(self) -> list[Outgoing]:
        """Return the packets to send, once."""
        packets, self._packets = self._packets, []
        return packets

    def may_draw(self, prefix: bytes, size: int) -> bool:
        """Return whether a participant that asks for it gets a sample of this size now."""
        room, at = self._drawn.pop(prefix, (_MOST_DRAWN, self.now))
        room = min(_MOST_DRAWN, room + int((self.now - at) * _DRAWN))
        is_free = room > 0
        self._drawn[prefix] = room - (size + _PACKET if is_free else 0), self.now
        if len(self._drawn) > _MOST_KNOWN:
            del self._drawn[next(iter(self._drawn))]
        return is_free

    def take(self, prefix: bytes, size: int) -> bool:
        """Take bytes for samples of a participant; return whether there was room."""
        if self._used[prefix] + size > MOST_WAITING - self._used.total():
            return False
        self._used[prefix] += size
        return True

    def free(self, prefix: bytes, size: int) -> None:
        """Give bytes back."""
        self._used[prefix] -= size
        if not self._used[prefix]:
            del self._used[prefix]
