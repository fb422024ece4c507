"""The packets of RTPS 2.3 as values: bounded parsers of what arrives.

Everything that arrives belongs to an attacker: each length is compared with what is there before
anything is read, made or looped over. A submessage of an unknown kind is skipped, as the standard
asks, and a malformed one ends its packet.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeAlias

#: The id of idlc as a vendor, with which its participants' names begin, too.
VENDOR = b"\x01\xee"
#: The bytes of a participant's name, which begins each GUID, and of an endpoint in it.
PREFIX = 12
GUID = 16
#: The names of all participants, and of all readers.
ALL, ALL_READERS = bytes(PREFIX), bytes(GUID - PREFIX)
#: A list of parameters in one payload has at most these.
_MOST_PARAMETERS = 256
#: The most bits of a set of numbers.
MOST_BITS = 256
#: Fragments of one sample; 64 MiB of the smallest that idlc sends.
MOST_FRAGMENTS = 50_000
SENTINEL = 1
#: The encapsulations of lists of parameters: big-endian and little-endian.
_LISTS = {b"\x00\x02": ">", b"\x00\x03": "<"}

# the kinds of submessages, and their flags
DATA, FRAGMENT, HEARTBEAT, ACKNACK, GAP, NACK_FRAGMENT = 0x15, 0x16, 7, 6, 8, 0x12
DESTINATION, TIMESTAMP, SOURCE = 0x0E, 9, 0x0C
LITTLE, INLINE, PAYLOAD, KEY, FINAL = 1, 2, 4, 8, 2

#: The values of parameters by their ids; a list, as some repeat.
Parameters: TypeAlias = Mapping[int, list[bytes]]
#: No parameters.
NONE: Parameters = {}


class WireError(ValueError):
    """A packet that is not RTPS, or is cut off."""


class Data(NamedTuple):
    """A sample; without a payload, or with only a key, it says that an instance ended.

    Callbacks of readers get it with the GUID of the writer.
    """

    reader: bytes
    writer: bytes
    number: int
    parameters: Parameters
    payload: bytes
    is_key: bool
    time: int


class Fragment(NamedTuple):
    """Consecutive parts of a sample of `total` bytes, each of `size`, counted from 1."""

    reader: bytes
    writer: bytes
    number: int
    parameters: Parameters
    first: int
    size: int
    total: int
    payload: bytes
    time: int


class Heartbeat(NamedTuple):
    """The samples that a writer has; unless it is final, a reader has to answer."""

    reader: bytes
    writer: bytes
    first: int
    last: int
    beat: int
    is_final: bool


class AckNack(NamedTuple):
    """A reader has all below `base`, and lacks the numbers in `missing`."""

    reader: bytes
    writer: bytes
    base: int
    missing: tuple[int, ...]
    beat: int


class Gap(NamedTuple):
    """The numbers from `first` up to `base`, and those in `others`, never come."""

    reader: bytes
    writer: bytes
    first: int
    base: int
    others: tuple[int, ...]


class NackFragment(NamedTuple):
    """A reader lacks these fragments of a sample."""

    reader: bytes
    writer: bytes
    number: int
    missing: tuple[int, ...]


Submessage: TypeAlias = "Data | Fragment | Heartbeat | AckNack | Gap | NackFragment"


class Packet(NamedTuple):
    """The sender of a packet, and its parts with the participant that each is for, or zeros."""

    prefix: bytes
    vendor: bytes
    parts: tuple[tuple[bytes, Submessage], ...]


def parse_packet(data: bytes) -> Packet:
    """Return the parts of a packet up to a malformed one; raise WireError if it is not RTPS."""
    size = len(data)
    if size < 20 or data[:4] != b"RTPS" or data[4] != 2:
        raise WireError("not RTPS")
    parts: list[tuple[bytes, Submessage]] = []
    destination, time, at = ALL, 0, 20
    while at + 4 <= size:
        kind, flags = data[at], data[at + 1]
        order = "<" if flags & LITTLE else ">"
        (length,) = struct.unpack_from(order + "H", data, at + 2)
        end = at + 4 + length if length or kind in (TIMESTAMP, 1) else size
        content = data[at + 4 : end]
        # one from another participant was forwarded, which nobody does for idlc
        if end > size or kind == SOURCE:
            break
        try:
            if (parse := _PARSERS.get(kind)) is not None:
                parts.append((destination, parse(content, order, flags, time)))
            elif kind == TIMESTAMP:
                time = 0 if flags & 2 else _nanoseconds(content, order)
            elif kind == DESTINATION:
                (destination,) = struct.unpack_from("12s", content)
        except (struct.error, WireError):
            break
        at = end
    return Packet(data[8:20], data[6:8], tuple(parts))


def _nanoseconds(data: bytes, order: str) -> int:
    seconds, fraction = struct.unpack_from(order + "II", data)
    nanoseconds: int = seconds * 10**9 + (fraction * 10**9 >> 32)
    return nanoseconds


def _number(high: int, low: int) -> int:
    """Return a sequence number; raise WireError if it is below 0."""
    if high < 0:
        raise WireError("a negative number")
    return high << 32 | low


def _bits(data: bytes, order: str, at: int, base: int) -> tuple[tuple[int, ...], int]:
    """Return the members of a set that begins at `base`, and the position after it."""
    (count,) = struct.unpack_from(order + "I", data, at)
    if count > MOST_BITS:
        raise WireError("a set of too many numbers")
    words = struct.unpack_from(f"{order}{(count + 31) // 32}I", data, at + 4)
    members = (base + n for n in range(count) if words[n // 32] >> (31 - n % 32) & 1)
    return tuple(members), at + 4 + 4 * len(words)


def _content(
    data: bytes, order: str, flags: int, offset: int, least: int
) -> tuple[Parameters, bytes]:
    """Return the inline parameters and the payload, which begin at an offset."""
    at = 4 + offset
    if offset < least or at > len(data):
        raise WireError("cut off")
    parameters = NONE
    if flags & INLINE:
        parameters, at = parse_parameters(data, at, order)
    return parameters, data[at:]


def _data(data: bytes, order: str, flags: int, time: int) -> Data:
    offset, reader, writer, high, low = struct.unpack_from(order + "2xH4s4siI", data)
    parameters, payload = _content(data, order, flags, offset, 16)
    if not flags & (PAYLOAD | KEY):
        payload = b""
    number, is_key = _number(high, low), not flags & PAYLOAD
    return Data(reader, writer, number, parameters, payload, is_key, time)


def _fragment(data: bytes, order: str, flags: int, time: int) -> Fragment:
    offset, reader, writer, high, low, first, count, size, total = struct.unpack_from(
        order + "2xH4s4siIIHHI", data
    )
    parameters, payload = _content(data, order, flags, offset, 28)
    last = first + count - 1
    if not (first and count and size) or (last - 1) * size >= total or last > MOST_FRAGMENTS:
        raise WireError("fragments outside of the sample")
    if len(payload) < min(count * size, total - (first - 1) * size):
        raise WireError("cut off")
    ids = reader, writer, _number(high, low)
    return Fragment(*ids, parameters, first, size, total, payload, time)


def _heartbeat(data: bytes, order: str, flags: int, _time: int) -> Heartbeat:
    reader, writer, high, low, top, rest, count = struct.unpack_from(order + "4s4siIiII", data)
    first, last = _number(high, low), _number(top, rest)
    if first == 0 or last < first - 1:
        raise WireError("numbers in the wrong order")
    return Heartbeat(reader, writer, first, last, count, bool(flags & FINAL))


def _acknack(data: bytes, order: str, _flags: int, _time: int) -> AckNack:
    reader, writer, high, low = struct.unpack_from(order + "4s4siI", data)
    base = _number(high, low)
    missing, at = _bits(data, order, 16, base)
    (count,) = struct.unpack_from(order + "I", data, at)
    return AckNack(reader, writer, base, missing, count)


def _gap(data: bytes, order: str, _flags: int, _time: int) -> Gap:
    reader, writer, high, low, top, rest = struct.unpack_from(order + "4s4siIiI", data)
    first, base = _number(high, low), _number(top, rest)
    if first == 0 or base < first:
        raise WireError("numbers in the wrong order")
    return Gap(reader, writer, first, base, _bits(data, order, 24, base)[0])


def _nack_fragment(data: bytes, order: str, _flags: int, _time: int) -> NackFragment:
    reader, writer, high, low, base = struct.unpack_from(order + "4s4siII", data)
    missing, _ = _bits(data, order, 20, base)
    return NackFragment(reader, writer, _number(high, low), missing)


_PARSERS: Mapping[int, Callable[[bytes, str, int, int], Submessage]] = {
    DATA: _data,
    FRAGMENT: _fragment,
    HEARTBEAT: _heartbeat,
    ACKNACK: _acknack,
    GAP: _gap,
    NACK_FRAGMENT: _nack_fragment,
}


def parse_parameters(data: bytes, at: int, order: str) -> tuple[Parameters, int]:
    """Return a list of parameters, and the position after it; raise WireError if it is cut off."""
    parameters: dict[int, list[bytes]] = {}
    for _ in range(_MOST_PARAMETERS):
        if at + 4 > len(data):
            break
        name, size = struct.unpack_from(order + "HH", data, at)
        at += 4
        if name == SENTINEL:
            return parameters, at
        if at + size > len(data):
            break
        parameters.setdefault(name, []).append(data[at : at + size])
        at += size
    raise WireError("a list of parameters without an end")


def parse_list(payload: bytes) -> tuple[Parameters, str]:
    """Return the parameters in a payload, and their byte order; raise WireError."""
    order = _LISTS.get(payload[:2])
    if order is None:
        raise WireError("not a list of parameters")
    return parse_parameters(payload, 4, order)[0], order
