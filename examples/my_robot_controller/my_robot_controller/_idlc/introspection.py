"""Types as ROS 2 asks about them: hash, description, source text, members, C structures.

Introspection members are field names, types and C offsets, as a middleware walks them. Both
kinds of type support need them. Fast DDS describes types to its peers from them and never
looks at the memory; introspection-based middlewares read and write the memory that they
describe, which is as rosidl has it, with the functions that stand beside it. These, and those
by which rclpy makes and frees messages, are machine code.
"""

from __future__ import annotations

import ctypes
import os
import sys
from contextlib import closing
from ctypes import PYFUNCTYPE, c_bool, c_char_p, c_size_t, c_uint8, c_uint32, c_void_p
from functools import cache
from itertools import product
from pathlib import Path
from struct import unpack_from
from typing import Any, NamedTuple

from . import c
from .typeinfo import FieldInfo, Structure

IDENTIFIER = "rosidl_typesupport_introspection_c"


@cache
def references(structure: Structure) -> frozenset[Structure]:
    """Return all types that a type refers to, directly or not, itself excluded."""
    direct = {field.nested for field in structure.members if field.nested}
    return frozenset(direct.union(*map(references, direct)))


@cache
def _individual(structure: Structure) -> Any:
    fields = []
    for field in structure.members:
        nested = c.string(field.nested.name if field.nested else "")
        kind = (field.type_id, field.capacity, field.text_bound or 0, nested)
        fields.append(c.Field(c.string(field.name), *kind, c.string(field.default)))
    name = c.string(structure.name)
    return c.IndividualDescription(name, c.sequence(fields, c.Field))


def _installed_text(name: str) -> str | None:
    """Return another package's interface file, where ROS 2 has installed it."""
    package, kind, short = name.split("/")
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    for prefix in filter(None, [*prefixes, sys.prefix]):
        path = Path(prefix, "share", package, kind, f"{short}.{kind}")
        if path.is_file():
            return path.read_text(encoding="utf-8")
    return None


def _source(structure: Structure) -> Any:
    """Return a type's source; derived types have none, and ROS 2 calls that implicit."""
    name, sources = structure.name, structure.types.sources
    text = sources.get(name) if structure.is_own else _installed_text(name)
    encoding = "implicit" if text is None else name.split("/")[1]
    return c.Source(c.string(name), c.string(encoding), c.string(text or ""))


@cache
def about(structure: Structure) -> Any:
    """Return functions that never fail and never return NULL, as rcl demands."""
    others = sorted(references(structure), key=lambda other: other.name)
    individuals = c.sequence(list(map(_individual, others)), c.IndividualDescription)
    description = c.Description(_individual(structure), individuals)
    sources = c.sequence(list(map(_source, (structure, *others))), c.Source)
    digest = bytes.fromhex(structure.hash.removeprefix("RIHS01_"))
    values = (c.TypeHash(1, (c_uint8 * 32)(*digest)), description, sources)
    return c.About(*(c.constant(c.pointer(value)) for value in values))


# the C structures of this ROS 2: their layout is measured, never assumed
#
# Versions differ in what a middleware reads from introspection tables and in the size of
# sequences, and nothing in them tells which version they are of. So before the first type
# support of a process, the tables of two messages that are wherever rclpy is are compared
# with all that is known of these messages. What is not exactly as in a known layout is
# refused: a wrong one would end the process, or change what is received.

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


_STRING = 16
#: Messages of rcl_interfaces that have been the same ever since: the id of each field's type, and
#: its size; a sequence has none.
_MESSAGES = {
    "ParameterValue": {
        b"type": (8, 1),
        b"bool_value": (6, 1),
        b"integer_value": (15, 8),
        b"double_value": (2, 8),
        b"string_value": (_STRING, 24),
        b"byte_array_value": (7, 0),
        b"bool_array_value": (6, 0),
        b"integer_array_value": (15, 0),
        b"double_array_value": (2, 0),
        b"string_array_value": (_STRING, 0),
    },
    "ListParametersResult": {b"names": (_STRING, 0), b"prefixes": (_STRING, 0)},
}


class _UnknownError(Exception):
    """The tables are not those of any known version."""


class _Reader:
    """Reads memory that may not be there: the system copies it into a pipe, or refuses."""

    def __init__(self) -> None:
        self._out, self._in = os.pipe()

    def close(self) -> None:
        os.close(self._out)
        os.close(self._in)

    def read(self, address: int, size: int) -> bytes:
        """Return memory; raises _UnknownError where there is none."""
        try:
            written = os.write(self._in, c.MEMORY[address : address + size])
            data = os.read(self._out, written)
        except OSError:
            data = b""
        if len(data) != size:
            raise _UnknownError(f"no memory at {address + len(data):#x}")
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
    reasons, layouts = [], []
    with closing(_Reader()) as reader:
        for table in _TABLES:
            try:
                offsets = [
                    _offsets(reader, handle, name, *table)
                    for handle, name in zip(handles, _MESSAGES, strict=True)
                ]
                layouts.append(Abi(*table, *_sequences(offsets)))
            except _UnknownError as reason:
                reasons.append(f"{'/'.join(map(str, table))}: {reason}")
    if len(layouts) != 1:
        seen = "; ".join(reasons) or "several layouts fit"
        raise ImportError(f"{_ADVICE} (introspection tables, {seen})")
    return layouts[0]


def _offsets(
    reader: _Reader, handle: int, message: str, members: int, member: int, is_array: int
) -> list[int]:
    """Return where a message's fields begin, and its size, if its tables fit a layout."""
    fields = _MESSAGES[message]
    identifier, data, function = reader.words(handle, 3)
    reader.demand_text(identifier, IDENTIFIER.encode())
    namespace, name, count, size, *rest = reader.words(data, members // 8 + 3)
    reader.demand_text(namespace, b"rcl_interfaces__msg")
    reader.demand_text(name, message.encode())
    _demand(count & 0xFFFF_FFFF, len(fields), "the number of members")
    *key, rows, init, fini = rest
    _demand(any(key), False, "whether there is a key")
    for code in (function, init, fini):
        reader.read(code, 1)
    table = reader.read(rows, member * len(fields))
    parts = [table[at : at + member] for at in range(0, len(table), member)]
    for part, (field, (type_id, width)) in zip(parts, fields.items(), strict=True):
        label, _, text_bound, nested = unpack_from("=4Q", part)
        reader.demand_text(label, field)
        flags = bytearray(8)
        flags[is_array - 32] = not width
        bound, is_bounded = unpack_from("=QB", part, 40)
        default, *functions = unpack_from("=7Q", part, 56)
        actual = (part[8], text_bound, nested, part[32:40], bound, is_bounded, default)
        _demand(actual, (type_id, 0, 0, bytes(flags), 0, 0, 0), f"member {field!r}")
        if width:
            _demand(any(functions), False, f"whether {field!r} has functions")
        for function in filter(None, functions):
            reader.read(function, 1)
        if len(part) > 112:  # whether it may be a buffer of another kind
            _demand(part[112] in (0, 1), True, f"whether {field!r} has a flag")
    return [*(unpack_from("=I", part, 52)[0] for part in parts), size]


def _sequences(offsets: list[list[int]]) -> tuple[int, int]:
    """Return the sizes of both kinds of sequences, by which fields begin where they do."""
    for sequence, strings in product(_SEQUENCES, repeat=2):
        if offsets == [_laid_out(name, sequence, strings) for name in _MESSAGES]:
            return sequence, strings
    raise _UnknownError(f"fields begin at {offsets}")


def _laid_out(message: str, sequence: int, strings: int) -> list[int]:
    """Return where fields begin, and where the last one ends."""
    offsets, end = [], 0
    for type_id, size in _MESSAGES[message].values():
        end += -end % min(size or 8, 8)
        offsets.append(end)
        end += size or (strings if type_id == _STRING else sequence)
    return [*offsets, end]


@cache
def abi() -> Abi:
    """Return the layout of this process's ROS 2; raises ImportError if it is unknown."""
    library = c.load_library(f"librcl_interfaces__{IDENTIFIER}.so")
    prefix = f"{IDENTIFIER}__get_message_type_support_handle__rcl_interfaces__msg__"
    try:
        getters = [PYFUNCTYPE(c_void_p)((prefix + name, library)) for name in _MESSAGES]
    except AttributeError as error:
        raise ImportError(f"{_ADVICE} ({error})") from error
    return measure(*(getter() or 0 for getter in getters))


@cache
def has_hashes() -> bool:
    """Return whether this ROS 2 knows type hashes, and with them events of services."""
    library = c.load_library("librosidl_runtime_c.so")
    return hasattr(library, "rosidl_stringify_type_hash")


# C structures of messages, laid out as rosidl's C generator lays them out

#: Type ids in introspection by those in descriptions: int8 to float64, then bool, byte, texts.
_NUMBER_IDS = dict(enumerate((9, 8, 11, 10, 13, 12, 15, 14, 1, 2), 2))
_TYPE_IDS = _NUMBER_IDS | {15: 6, 16: 7, 17: _STRING, 18: 17, 21: _STRING, 22: 17}
#: Numbers by their size; an array of them is aligned like one.
_NUMBERS = {1: c_uint8, 2: ctypes.c_uint16, 4: c_uint32, 8: ctypes.c_uint64}
_MESSAGE = 18


@cache
def c_structure(structure: Structure) -> type[ctypes.Structure]:
    """Return the C structure that rosidl's C generator would make for a message."""
    fields = [(f"f{i}", _c_type(field)) for i, field in enumerate(structure.members)]
    name = structure.name.replace("/", "__")
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def element_type(field: FieldInfo) -> Any:
    """Return the C type of one element of a field."""
    if field.nested:
        return c_structure(field.nested)
    return _NUMBERS[field.primitive.size] if field.primitive else c.String


def _c_type(field: FieldInfo) -> Any:
    if not field.is_sequence:
        return element_type(field) * field.size if field.size else element_type(field)
    if field.nested:
        return c.Sequence
    size = abi().strings if field.text else abi().sequence
    return c.Sequence if size == ctypes.sizeof(c.Sequence) else c.FlaggedSequence


def placed_fields(structure: Structure) -> list[tuple[FieldInfo, int]]:
    """Return a message's fields and where each begins in the C structure."""
    kind = c_structure(structure)
    fields = enumerate(structure.members)
    return [(field, getattr(kind, f"f{i}").offset) for i, field in fields]


# members


@cache
def _types() -> tuple[Any, Any]:
    """Return MessageMember and MessageMembers of this ROS 2's introspection."""
    member = c.structure(
        "MessageMember",
        name=c_char_p,
        type_id=c_uint8,
        string_upper_bound=c_size_t,
        members=c_void_p,
        flags=c_uint8 * (abi().is_array - 32),  # whether it is a key
        is_array=c_bool,
        array_size=c_size_t,
        is_upper_bound=c_bool,
        offset=c_uint32,
        default_value=c_void_p,
        functions=c_void_p * 6,  # size, get_const, get, fetch, assign, resize
        later=c_uint8 * (abi().member - 112),  # whether it is a buffer
    )
    members = c.structure(
        "MessageMembers",
        namespace=c_char_p,
        name=c_char_p,
        count=c_uint32,
        size_of=c_size_t,
        flags=c_uint8 * (abi().members - 32),  # whether there is a key
        members=c_void_p,
        init_function=c_void_p,
        fini_function=c_void_p,
    )
    return member, members


@cache
def same_handle(kind: str) -> int:
    """Return the function that answers with the handle itself if the identifier fits."""
    runtime = c.load_library("librosidl_runtime_c.so")
    return c.address(getattr(runtime, f"get_{kind}_typesupport_handle_function"))


def _member(field: FieldInfo, offset: int, functional: bool) -> Any:
    """Return the member that describes a field to the middleware."""
    member = _types()[0](
        name=field.name.encode(),
        type_id=_MESSAGE if field.nested else _TYPE_IDS[field.base],
        string_upper_bound=field.text_bound or 0,
        members=handle(field.nested, functional) if field.nested else None,
        is_array=field.is_list,
        array_size=field.capacity,
        is_upper_bound=field.bound is not None,
        offset=offset,
    )
    if field.is_list and functional:
        size = ctypes.sizeof(element_type(field))
        functions = memory_functions(size, element_content(field))
        get = functions["in_array" if field.size else "in_sequence"]
        member.functions[1:3] = get, get
        if field.is_sequence:
            member.functions[0] = functions["length"]
            member.functions[5] = functions["resize"]
    return member


@cache
def handle(structure: Structure, functional: bool) -> int:
    """Return the address of a message's introspection type support.

    `functional`: with the functions by which message memory is written and read.
    """
    identifier, find = c.identifier(IDENTIFIER), same_handle("message")
    placed = placed_fields(structure)
    table = [_member(field, offset, functional) for field, offset in placed]
    size = ctypes.sizeof(c_structure(structure))
    functions = memory_functions(size, content(structure)) if functional else {}
    namespace, name = c.namespace_and_name(structure.name, "__")
    member_type, members_type = _types()
    members = members_type(
        namespace=namespace,
        name=name,
        count=len(table),
        size_of=size,
        members=c.sequence(table, member_type).data,
        fini_function=functions.get("finish"),
    )
    support = (identifier, c.pointer(members), find, about(structure))
    return c.pointer(c.MessageTypeSupport(*support))


# message memory


@cache
def memory_functions(size: int, table: int, converter: object = None) -> dict[str, int]:
    """Return functions, by name, for elements of a size that have a table of what to free.

    `convert_from_py` and `convert_to_py` are the only ones that need Python: they call
    `converter[address] = message` and `converter[address]`.
    """
    words = {
        "allocate": allocator().zero_allocate,
        "deallocate": allocator().deallocate,
        "set_item": c.c_function("PySequence_SetItem"),
        "get_item": c.c_function("PySequence_GetItem"),
        "converter": id(c.keep(converter)),
        "plan": table or _table(),
        "sequence": _table((0, 0, size, table)),
        "size": size,
    }
    return c.machine_code("structs", words)


@cache
def allocator() -> Any:
    """Return the allocator (`rcutils_allocator_t`) that all of rosidl uses."""
    default = c.load_library("librcutils.so").rcutils_get_default_allocator
    default.restype = c.structure(
        "Allocator", "allocate deallocate reallocate zero_allocate state"
    )
    return default()


# A table of words says what must be freed in a structure: how many entries, and for
# each entry an offset, how many elements are there (none: they are in memory of their
# own, as the three words of a sequence or string say), the size of an element, and the
# table of an element (none: there is nothing to free in it).


@cache
def _table(*entries: tuple[int, int, int, int]) -> int:
    words = [len(entries), *(word for entry in entries for word in entry)]
    return ctypes.addressof(c.keep((c_size_t * len(words))(*words)))


@cache
def content(structure: Structure) -> int:
    """Return the table of a type, 0 if there is nothing to free in it."""
    entries = []
    for field, offset in placed_fields(structure):
        inner = element_content(field)
        if inner or field.is_sequence:
            count = 0 if field.is_sequence else field.size or 1
            size = ctypes.sizeof(element_type(field))
            entries.append((offset, count, size, inner))
    return _table(*entries) if entries else 0


def element_content(field: FieldInfo) -> int:
    """Return the table of one element of a field, 0 if there is nothing to free in it."""
    if field.nested:
        return content(field.nested)
    return _table((0, 0, 0, 0)) if field.text else 0
