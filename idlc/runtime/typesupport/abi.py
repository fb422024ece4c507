"""The C structures of this ROS 2: their layout is measured with a type of its own, never assumed.

Versions differ in what a middleware reads from introspection tables and in the size of
sequences, and nothing in them tells which version they are of. So before the first type
support of a process, the tables of two messages that are wherever rclpy is are compared
with all that is known of these messages. What is not exactly as in a known layout is
refused: a wrong one would end the process, or change what is received.
"""

from __future__ import annotations

import ctypes
import os
from ctypes import PYFUNCTYPE, c_void_p
from functools import cache
from struct import unpack_from
from typing import NamedTuple

from . import c

_INTROSPECTION = "rosidl_typesupport_introspection_c"
_ADVICE = (
    "idlc's type support does not know this version of ROS 2: look for a newer idlc, or "
    "build the interface package with colcon"
)


class Abi(NamedTuple):
    """Sizes and offsets in bytes, of structures of rosidl."""

    members: int  #: the offset of `members_` in MessageMembers
    member: int  #: the size of a MessageMember
    is_array: int  #: the offset of `is_array_` in it
    sequence: int  #: the size of a sequence of numbers
    strings: int  #: the size of a sequence of strings


#: What has been seen: each has the offset of `members_`, the size of a member and the
#: offset of its `is_array_`. Sequences are measured apart, by two sizes of each.
_TABLES = ((32, 112, 32), (40, 112, 33), (40, 120, 33))
_SEQUENCES = (24, 32)


class _Member(NamedTuple):
    """A field: its name, the id of its type, and its size; a sequence has none."""

    name: bytes
    type_id: int
    size: int = 0


_STRING = 16
#: Messages of rcl_interfaces that have been the same ever since.
_MESSAGES = {
    "ParameterValue": (
        _Member(b"type", 8, 1),
        _Member(b"bool_value", 6, 1),
        _Member(b"integer_value", 15, 8),
        _Member(b"double_value", 2, 8),
        _Member(b"string_value", _STRING, 24),
        _Member(b"byte_array_value", 7),
        _Member(b"bool_array_value", 6),
        _Member(b"integer_array_value", 15),
        _Member(b"double_array_value", 2),
        _Member(b"string_array_value", _STRING),
    ),
    "ListParametersResult": (_Member(b"names", _STRING), _Member(b"prefixes", _STRING)),
}


class _UnknownError(Exception):
    """The tables are not those of any known version."""


class _Reader:
    """Reads memory that may not be there.

    The system copies it into a pipe, and refuses where the process would be ended.
    """

    def __init__(self) -> None:
        self._out, self._in = os.pipe()
        self._write = ctypes.CDLL(None, use_errno=True).write
        self._write.argtypes = (ctypes.c_int, c_void_p, ctypes.c_size_t)
        self._write.restype = ctypes.c_ssize_t

    def close(self) -> None:
        os.close(self._out)
        os.close(self._in)

    def read(self, address: int, size: int) -> bytes:
        """Return memory; raises _UnknownError where there is none."""
        if not address or address >> 63 or self._write(self._in, address, 1) != 1:
            raise _UnknownError(f"no memory at {address:#x}")
        os.read(self._out, 1)
        written = self._write(self._in, address, size)
        data = os.read(self._out, written) if written > 0 else b""
        if len(data) != size:
            raise _UnknownError(f"no memory at {address + size:#x}")
        return data

    def words(self, address: int, count: int) -> tuple[int, ...]:
        """Return 64-bit words."""
        return unpack_from(f"={count}Q", self.read(address, 8 * count))

    def demand_text(self, address: int, text: bytes) -> None:
        """Raise _UnknownError unless there is this text, with a zero after it."""
        content = self.read(address, len(text) + 1)
        if content != text + b"\0":
            raise _UnknownError(f"{content!r} where {text!r} should be")


def _demand(actual: object, expected: object, subject: str) -> None:
    if actual != expected:
        raise _UnknownError(f"{subject} is {actual}, not {expected}")


def measure(*handles: int) -> Abi:
    """Return the layout that the introspection type support of known messages has.

    `handles` are the addresses of the `rosidl_message_type_support_t` of ParameterValue and
    of ListParametersResult. Raises ImportError if they are not exactly as one of the known
    layouts has them.
    """
    reader = _Reader()
    reasons, layouts = [], []
    try:
        for table in _TABLES:
            try:
                offsets = [
                    _offsets(reader, handle, name, fields, *table)
                    for handle, (name, fields) in zip(
                        handles, _MESSAGES.items(), strict=True
                    )
                ]
                layouts.append(Abi(*table, *_sequences(offsets)))
            except _UnknownError as reason:
                reasons.append(f"{'/'.join(map(str, table))}: {reason}")
    finally:
        reader.close()
    if len(layouts) != 1:
        seen = "; ".join(reasons) or "several layouts fit"
        raise ImportError(f"{_ADVICE} (introspection tables, {seen})")
    return layouts[0]


def _offsets(
    reader: _Reader,
    handle: int,
    message: str,
    fields: tuple[_Member, ...],
    members: int,
    member: int,
    is_array: int,
) -> list[int]:
    """Return where a message's fields begin, and its size, if its tables fit a layout."""
    identifier, data, function = reader.words(handle, 3)
    reader.demand_text(identifier, _INTROSPECTION.encode())
    reader.read(function, 1)
    namespace, name, count, size, *rest = reader.words(data, members // 8 + 3)
    reader.demand_text(namespace, b"rcl_interfaces__msg")
    reader.demand_text(name, message.encode())
    _demand(count & 0xFFFF_FFFF, len(fields), "the number of members")
    *key, rows, init, fini = rest
    _demand(any(key), False, "whether there is a key")
    for code in (init, fini):
        reader.read(code, 1)
    table = reader.read(rows, member * len(fields))
    parts = [table[at : at + member] for at in range(0, len(table), member)]
    for part, field in zip(parts, fields, strict=True):
        _check_member(reader, part, field, is_array)
    return [*(unpack_from("=I", part, 52)[0] for part in parts), size]


def _check_member(reader: _Reader, part: bytes, field: _Member, is_array: int) -> None:
    """Raise _UnknownError unless a member says what is known of its field."""
    name, _, bound, nested = unpack_from("=4Q", part)
    reader.demand_text(name, field.name)
    _demand(part[8], field.type_id, f"the type of {field.name!r}")
    _demand((bound, nested), (0, 0), f"bound and type of {field.name!r}")
    flags = bytearray(8)
    flags[is_array - 32] = not field.size
    _demand(part[32:40], bytes(flags), f"whether {field.name!r} is an array")
    size, bounded = unpack_from("=QB", part, 40)
    default, *functions = unpack_from("=7Q", part, 56)
    _demand((size, bounded, default), (0, 0, 0), f"the bounds of {field.name!r}")
    if field.size:
        _demand(any(functions), False, f"whether {field.name!r} has functions")
    for function in functions:
        if function:
            reader.read(function, 1)
    if len(part) > 112:  # whether it may be a buffer of another kind
        _demand(part[112] in (0, 1), True, f"whether {field.name!r} has a flag")


def _sequences(offsets: list[list[int]]) -> tuple[int, int]:
    """Return the sizes of both kinds of sequences, by which fields begin where they do."""
    for sequence in _SEQUENCES:
        for strings in _SEQUENCES:
            expected = [
                _laid_out(fields, sequence, strings) for fields in _MESSAGES.values()
            ]
            if expected == offsets:
                return sequence, strings
    raise _UnknownError(f"fields begin at {offsets}")


def _laid_out(fields: tuple[_Member, ...], sequence: int, strings: int) -> list[int]:
    """Return where fields begin, and where the last one ends."""
    offsets, end = [], 0
    for field in fields:
        end += -end % min(field.size or 8, 8)
        offsets.append(end)
        end += field.size or (strings if field.type_id == _STRING else sequence)
    return [*offsets, end]


@cache
def abi() -> Abi:
    """Return the layout of this process's ROS 2; raises ImportError if it is unknown."""
    library = c.load_library(f"librcl_interfaces__{_INTROSPECTION}.so")
    prefix = f"{_INTROSPECTION}__get_message_type_support_handle__rcl_interfaces__msg__"
    try:
        getters = [PYFUNCTYPE(c_void_p)((prefix + name, library)) for name in _MESSAGES]
    except AttributeError as error:
        raise ImportError(f"{_ADVICE} ({error})") from error
    return measure(*(getter() or 0 for getter in getters))


@cache
def has_hashes() -> bool:
    """Return whether this ROS 2 knows type hashes, and with them events of services."""
    runtime = c.load_library("librosidl_runtime_c.so")
    return hasattr(runtime, "rosidl_stringify_type_hash")
