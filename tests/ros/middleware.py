"""Readers and writers of C message memory, as a middleware has them: for tests only.

`Walker` goes by the introspection members, as rmw_cyclonedds_cpp does. `Official` is the C++ code
that rosidl generated for the same type. Both turn memory into CDR and back, without header.
"""

import ctypes
from ctypes import CFUNCTYPE, POINTER, c_bool, c_char, c_char_p, c_size_t, c_uint32, c_void_p
from struct import calcsize, pack, unpack

from trees import class_of

FORMATS = {1: "f", 2: "d", 6: "?", 7: "B", 8: "B", 9: "b", 10: "H", 11: "h", 12: "I", 13: "i"}
FORMATS |= {14: "Q", 15: "q"}
STRING, WSTRING, MESSAGE = 16, 17, 18


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
GET = CFUNCTYPE(c_void_p, c_void_p, c_size_t)
RESIZE = CFUNCTYPE(c_bool, c_void_p, c_size_t)
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


def fixed_size(member):
    """Return whether a member is a fixed array."""
    return member.array_size and not member.is_upper_bound


#: The C names of sequences by type id.
SEQUENCES = dict(
    zip(
        (1, 2, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, STRING, WSTRING),
        "float double boolean octet uint8 int8 uint16 int16 uint32 int32 uint64 int64 "
        "String U16String".split(),
        strict=True,
    )
)


class Runtime:
    """The functions of rosidl_runtime_c that a middleware fills sequences and strings with."""

    def __init__(self):
        self.library = ctypes.CDLL("librosidl_runtime_c.so")

    def call(self, name, *arguments):
        function = getattr(self.library, f"rosidl_runtime_c__{name}")
        function.restype = c_bool
        assert function(*arguments)

    def make_sequence(self, type_id, address, count):
        name = f"{SEQUENCES[type_id]}__Sequence__init"
        self.call(name, c_void_p(address), c_size_t(count))

    def assign(self, address, raw):
        self.call("String__assignn", c_void_p(address), c_char_p(raw), c_size_t(len(raw)))

    def assign_wide(self, address, raw):
        units = ctypes.create_string_buffer(raw + b"\0\0")
        self.call("U16String__assignn", c_void_p(address), units, c_size_t(len(raw) // 2))


def words(address, count):
    return list((c_size_t * count).from_address(address))


class Walker:
    """Walks over memory by introspection members."""

    def __init__(self, handle):
        self.members = members_of(handle)
        self.runtime = Runtime()

    def read(self, memory, _room):
        """Return the CDR of what is in memory."""
        self.out = b""
        self._read_message(self.members, memory)
        return self.out

    def _put(self, data, align):
        self.out += bytes(-len(self.out) % align) + data

    def _read_message(self, members, memory):
        for member in members.members[: members.count]:
            address = memory + member.offset
            if not member.is_array:
                self._read_one(member, address)
                continue
            count, data = member.array_size, address
            if not fixed_size(member):
                data, count, capacity = words(address, 3)
                assert capacity >= count
                self._put(pack("I", count), 4)
            for index in range(count):
                self._read_one(member, self._element(member, address, data, index))

    def _element(self, member, address, data, index):
        if member.type_id == MESSAGE:
            return GET(member.get)(address, index)
        size = 24 if member.type_id in (STRING, WSTRING) else calcsize(FORMATS[member.type_id])
        return data + index * size

    def _read_one(self, member, address):
        if member.type_id == MESSAGE:
            self._read_message(members_of(member.members), address)
        elif member.type_id in (STRING, WSTRING):
            data, size, capacity = words(address, 3)
            assert capacity > size
            if member.type_id == STRING:
                assert ctypes.string_at(data + size, 1) == b"\0"
                self._put(pack("I", size + 1) + ctypes.string_at(data, size + 1), 4)
            else:
                units = unpack(f"{size}H", ctypes.string_at(data, 2 * size))
                self._put(pack(f"I{size}I", size, *units), 4)
        else:
            size = calcsize(FORMATS[member.type_id])
            assert address % size == 0
            self._put(ctypes.string_at(address, size), size)

    def write(self, data, memory):
        """Fill memory from CDR."""
        self.data, self.at = data, 0
        self._write_message(self.members, memory)
        assert self.at == len(data)

    def _take(self, size, align):
        start = self.at + -self.at % align
        self.at = start + size
        return self.data[start : self.at]

    def _count(self):
        return unpack("I", self._take(4, 4))[0]

    def _write_message(self, members, memory):
        for member in members.members[: members.count]:
            address = memory + member.offset
            if not member.is_array:
                self._write_one(member, address)
                continue
            count, start = member.array_size, address
            if not fixed_size(member):
                count = self._count()
                if member.type_id == MESSAGE:
                    # twice, as for memory that is used again
                    assert RESIZE(member.resize)(address, count + 2)
                    assert RESIZE(member.resize)(address, count)
                else:
                    self.runtime.make_sequence(member.type_id, address, count)
                (start,) = words(address, 1)
            for index in range(count):
                self._write_one(member, self._element(member, address, start, index))

    def _write_one(self, member, address):
        if member.type_id == MESSAGE:
            self._write_message(members_of(member.members), address)
        elif member.type_id == STRING:
            self.runtime.assign(address, self._take(self._count(), 1)[:-1])
        elif member.type_id == WSTRING:
            count = self._count()
            units = unpack(f"{count}I", self._take(4 * count, 1))
            self.runtime.assign_wide(address, pack(f"{count}H", *units))
        else:
            size = calcsize(FORMATS[member.type_id])
            ctypes.memmove(address, self._take(size, size), size)


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
