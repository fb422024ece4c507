"""Print what type support libraries say as JSON: native_reader.py WHOSE NAME...

WHOSE is "rosidl", or a prefix with idlc's libraries. The tables of both are read in the same way.
"""

import ctypes
import json
import sys
from ctypes import CFUNCTYPE, c_char_p, c_size_t, c_uint8, c_uint64, c_void_p
from functools import cache
from pathlib import Path

from middleware import FIND, Members

C, CPP = "rosidl_typesupport_introspection_c", "rosidl_typesupport_introspection_cpp"
DISPATCH, FAST = "rosidl_typesupport_cpp", "rosidl_typesupport_fastrtps_c"


class Handle(ctypes.Structure):
    _fields_ = (
        ("identifier", c_char_p),
        ("data", c_void_p),
        ("func", c_void_p),
        ("get_hash", c_void_p),
        ("get_description", c_void_p),
        ("get_sources", c_void_p),
    )


class String(ctypes.Structure):
    _fields_ = (("data", c_char_p), ("size", c_size_t), ("capacity", c_size_t))

    def __str__(self):
        return (self.data or b"").decode()


class Sequence(ctypes.Structure):
    _fields_ = (("data", c_void_p), ("size", c_size_t), ("capacity", c_size_t))

    def of(self, element):
        assert self.capacity >= self.size
        return (element * self.size).from_address(self.data) if self.size else []


class Field(ctypes.Structure):
    _fields_ = (
        ("name", String),
        ("type_id", c_uint8),
        ("capacity", c_uint64),
        ("string_capacity", c_uint64),
        ("nested_type_name", String),
        ("default_value", String),
    )


class Individual(ctypes.Structure):
    _fields_ = (("type_name", String), ("fields", Sequence))


class Description(ctypes.Structure):
    _fields_ = (("own", Individual), ("referenced", Sequence))


class Source(ctypes.Structure):
    _fields_ = (("type_name", String), ("encoding", String), ("text", String))


@cache
def text_of(identifier):
    """Return a text of C that stays: a handle that answers carries the asker's own."""
    return identifier.encode()


def found(handle, identifier):
    """Ask a handle as a middleware does; return the handle that answers."""
    return FIND(Handle.from_address(handle).func)(handle, text_of(identifier))


def table(handle, identifier):
    members = Members.from_address(Handle.from_address(handle).data)
    rows = []
    for member in members.members[: members.count]:
        nested = None
        if member.members:
            # some tools look at once into what stands there, others ask it first
            assert found(member.members, identifier) == member.members
            nested = table(member.members, identifier)
        rows.append(
            {
                "name": member.name.decode(),
                "kind": [member.type_id, member.string_upper_bound],
                "many": [member.is_array, member.array_size, member.is_upper_bound],
                "offset": member.offset,
                "else": [member.is_key, member.default_value],
                "nested": nested,
            }
        )
    return {
        "name": [members.namespace.decode(), members.name.decode()],
        "size": members.size_of,
        "key": members.has_any_key_member,
        "members": rows,
    }


def unescaped(text):
    """Return what rosidl's texts stand for: its generator writes bytes as Python shows them."""
    return str(text).encode().decode("unicode_escape").encode("latin-1").decode()


def individual(one, meaning):
    fields = [
        {
            "name": str(field.name),
            "type": [field.type_id, field.capacity, field.string_capacity],
            "nested": str(field.nested_type_name),
            "default": meaning(field.default_value),
        }
        for field in one.fields.of(Field)
    ]
    return {"name": str(one.type_name), "fields": fields}


def about(handle, meaning):
    """Return hash, description and sources; the functions get no handle, as they need none."""
    support = Handle.from_address(handle)
    getters = (support.get_hash, support.get_description, support.get_sources)
    digest, description, sources = (CFUNCTYPE(c_void_p, c_void_p)(one)(None) for one in getters)
    whole = Description.from_address(description)
    return {
        "hash": bytes((c_uint8 * 33).from_address(digest)).hex(),
        "description": individual(whole.own, meaning),
        "referenced": [individual(one, meaning) for one in whole.referenced.of(Individual)],
        "sources": [
            [str(one.type_name), str(one.encoding), meaning(one.text)]
            for one in Sequence.from_address(sources).of(Source)
        ],
    }


@cache
def load(path):
    return ctypes.CDLL(path)


def handle_of(whose, identifier, name):
    package, kind, short = name.split("/")
    file = f"lib{package}__{identifier}.so"
    library = load(file if whose == "rosidl" else str(Path(whose, "lib", file)))
    symbol = f"{identifier}__get_message_type_support_handle__{package}__{kind}__{short}"
    get = getattr(library, symbol)
    get.restype = c_void_p
    return get()


def look_at(whose, name):
    top = handle_of(whose, DISPATCH, name)
    # rosidl's C++ library knows C++ only; idlc's knows C only, and says so of both
    c = handle_of(whose, C, name) if whose == "rosidl" else found(top, C)
    fast = handle_of(whose, FAST, name) if whose == "rosidl" else found(top, FAST)
    cpp = handle_of(whose, CPP, name)
    called = (c_char_p * 2).from_address(Handle.from_address(fast).data)
    meaning = unescaped if whose == "rosidl" else str
    every = (top, c, fast, cpp)
    told = {
        "c": table(c, C),
        "cpp": table(cpp, CPP),
        "called": [text.decode() for text in called],
        "identifiers": [Handle.from_address(one).identifier.decode() for one in every],
        "about": about(top, meaning),
    }
    assert all(about(one, meaning) == told["about"] for one in every)
    return told


def main(whose, *names):
    print(json.dumps({name: look_at(whose, name) for name in names}))


if __name__ == "__main__":
    main(*sys.argv[1:])
