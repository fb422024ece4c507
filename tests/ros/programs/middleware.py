"""Readers and writers of C message memory, as a middleware has them: for tests only.

`Walker` goes by the introspection members, as rmw_cyclonedds_cpp does. `Official` is the C++ code
that rosidl generated for the same type. Both turn memory into CDR and back, without header.
"""

import ctypes
import os
import sys
from ctypes import CFUNCTYPE, POINTER, c_bool, c_char, c_char_p, c_size_t, c_uint32, c_void_p

from trees import class_of

from idlc.generate.native.platforms import LAYOUTS
from idlc.project.prefixes import distribution

LAYOUT = LAYOUTS.get(distribution().name, LAYOUTS["jazzy"])


class Member(ctypes.Structure):
    _fields_ = (
        ("name", c_char_p),
        ("type_id", ctypes.c_uint8),
        ("string_upper_bound", c_size_t),
        ("members", c_void_p),
        ("is_key", c_bool),
        ("is_array", c_bool),
        ("array_size", c_size_t),
        ("is_upper_bound", c_bool),
        ("offset", c_uint32),
        ("default_value", c_void_p),
        *((name, c_void_p) for name in ("size", "get_const", "get", "fetch", "assign", "resize")),
        *([("is_rosidl_buffer", c_bool)] if LAYOUT.member > LAYOUTS["jazzy"].member else []),
    )


class Members(ctypes.Structure):
    _fields_ = (
        ("namespace", c_char_p),
        ("name", c_char_p),
        ("count", c_uint32),
        ("size_of", c_size_t),
        ("has_any_key_member", c_bool),
        ("members", POINTER(Member)),
        ("init", c_void_p),
        ("fini", c_void_p),
    )


class TypeSupport(ctypes.Structure):
    _fields_ = (("identifier", c_char_p), ("data", c_void_p), ("func", c_void_p))


FIND = CFUNCTYPE(c_void_p, c_void_p, c_char_p)
IDENTIFIER = b"rosidl_typesupport_introspection_c"


def members_of(handle):
    """Return the members behind a type support, asked for as a middleware does."""
    found = FIND(TypeSupport.from_address(handle).func)(handle, IDENTIFIER)
    assert TypeSupport.from_address(found).identifier == IDENTIFIER
    return Members.from_address(TypeSupport.from_address(found).data)


def table(members):
    """Return all that members say, nested ones included, but not where the functions are."""
    return (
        members.namespace,
        members.name,
        members.size_of,
        [
            (
                *(getattr(member, name) for name, _ in Member._fields_[:3]),
                *(getattr(member, name) for name, _ in Member._fields_[4:9]),
                table(members_of(member.members)) if member.members else None,
            )
            for member in members.members[: members.count]
        ],
    )


def words(address, count):
    return list((c_size_t * count).from_address(address))


class Walker:
    """Lets walker.c, which WALKER names, walk over memory by introspection members.

    Meanwhile this thread keeps Python's lock.
    """

    def __init__(self, handle):
        self.members = ctypes.addressof(members_of(handle))
        self.library = ctypes.PyDLL(os.environ["WALKER"])

    def _walk(self, memory, data, filling):
        size = c_size_t(len(data))
        place = c_void_p(memory)
        members = c_void_p(self.members)
        result = self.library.walk(members, place, data, ctypes.byref(size), c_bool(filling))
        if result < 0:
            sys.exit("a function waits for Python's lock")
        assert result == 1
        return size.value

    def read(self, memory, room):
        """Return the CDR of what is in memory, at most `room` bytes."""
        data = ctypes.create_string_buffer(room)
        size = self._walk(memory, data, filling=False)
        return data.raw[:size]

    def write(self, data, memory):
        """Fill memory from CDR."""
        self._walk(memory, ctypes.create_string_buffer(data, len(data)), filling=True)


class Official:
    """The serializer and deserializer that rosidl_typesupport_fastrtps_c generated for a type."""

    def __init__(self, name):
        package, kind, short = name.split("/")
        prefix = "rosidl_typesupport_fastrtps_c"
        library = ctypes.CDLL(f"lib{package}__{prefix}.so")
        symbol = f"{prefix}__get_message_type_support_handle__{package}__{kind}__{short}"
        function = getattr(library, symbol)
        function.restype = c_void_p
        callbacks = words(TypeSupport.from_address(function()).data, 4)
        self.serialize = CFUNCTYPE(c_bool, c_void_p, c_void_p)(callbacks[2])
        self.deserialize = CFUNCTYPE(c_bool, c_void_p, c_void_p)(callbacks[3])
        self.library = ctypes.CDLL("libfastcdr.so.2")

    def _method(self, name, result, *arguments):
        return CFUNCTYPE(result, *arguments)((f"_ZN8eprosima7fastcdr{name}", self.library))

    def _cdr(self, data):
        """Return a `Cdr` over a ctypes buffer, little endian, XCDR version 1."""
        self.buffer = ctypes.create_string_buffer(1024)
        cdr = ctypes.create_string_buffer(1024)
        new_buffer = self._method("10FastBufferC1EPcm", None, c_void_p, c_void_p, c_size_t)
        new_buffer(self.buffer, data, len(data))
        name = "3CdrC1ERNS0_10FastBufferENS1_10EndiannessENS0_10CdrVersionE"
        new_cdr = self._method(name, None, c_void_p, c_void_p, c_char, ctypes.c_int)
        new_cdr(cdr, self.buffer, 1, 2)
        return cdr

    def read(self, memory, room):
        """Return the CDR of what is in memory; more than `room` bytes end the process."""
        data = ctypes.create_string_buffer(room)
        cdr = self._cdr(data)
        assert self.serialize(memory, cdr)
        position = self._method("3Cdr20get_current_positionEv", c_void_p, c_void_p)(cdr)
        return data.raw[: position - ctypes.addressof(data)]

    def write(self, data, memory):
        kept = ctypes.create_string_buffer(data, len(data))
        assert self.deserialize(self._cdr(kept), memory)


def official_handle(name):
    """Return the introspection type support that rosidl generated."""
    package, kind, short = name.split("/")
    prefix = "rosidl_typesupport_introspection_c"
    library = ctypes.CDLL(f"lib{package}__{prefix}.so")
    symbol = f"{prefix}__get_message_type_support_handle__{package}__{kind}__{short}"
    function = getattr(library, symbol)
    function.restype = c_void_p
    return function()


def interface_of(name):
    """Return a message class by its full name."""
    return class_of(*name.split("/"))
