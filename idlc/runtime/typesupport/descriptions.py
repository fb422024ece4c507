"""Type information for ROS 2: hash, description and source text of each type.

The facts are JSON in `type_data.py` beside this module, written with the package and
read only when rclpy asks for type support:

    {"package": "pkg",
     "descriptions": {"pkg/msg/Name": individual description as in ROS 2's own Name.json},
     "hashes": {"pkg/msg/Name": "RIHS01_…"},
     "sources": {"pkg/msg/Name": "text of the interface file"}}

`descriptions` and `hashes` hold every structure of the package, derived ones and the
pseudo-structures of services and actions included, and all that these refer to;
`sources` holds the files among them. A type id is a base plus 48 for a fixed array, 96
for a bounded, 144 for an unbounded sequence (rosidl's
`type_description_interfaces/msg/FieldType`).
"""

from __future__ import annotations

import ctypes
import os
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ..on_demand import typeinfo
from . import c

NESTED, UINT8, BOOL, BYTE, WSTRING = 1, 3, 15, 16, 18
SCALAR, ARRAY, BOUNDED_SEQUENCE, SEQUENCE = range(4)


class Field(NamedTuple):
    """A field as described; `capacity` is an array's size or a sequence's bound."""

    name: str
    type_id: int
    capacity: int
    string_capacity: int
    nested_type_name: str
    default_value: str

    @property
    def base(self) -> int:
        """The type id of one element."""
        return self.type_id % 48

    @property
    def shape(self) -> int:
        """SCALAR, ARRAY, BOUNDED_SEQUENCE or SEQUENCE."""
        return self.type_id // 48


class Types(NamedTuple):
    """The facts about a package's types; fields by type."""

    package: str
    types: dict[str, list[Field]]
    hashes: dict[str, str]
    sources: dict[str, str]


@cache
def load() -> Types:
    """Return the facts about this package's types."""
    data = typeinfo.types()
    types = {
        name: [
            Field(field["name"], **field["type"], default_value=field["default_value"])
            for field in description["fields"]
        ]
        for name, description in data["descriptions"].items()
    }
    return Types(data["package"], types, data["hashes"], data["sources"])


@cache
def references(name: str) -> frozenset[str]:
    """Return all types that `name` refers to, directly or not, itself excluded."""
    direct = {
        field.nested_type_name for field in load().types[name] if field.nested_type_name
    }
    return frozenset(direct.union(*map(references, direct)))


def _field(field: Field) -> c.Field:
    kind = c.FieldType(
        field.type_id,
        field.capacity,
        field.string_capacity,
        c.string(field.nested_type_name),
    )
    return c.Field(c.string(field.name), kind, c.string(field.default_value))


@cache
def _individual(name: str) -> c.IndividualDescription:
    fields = [_field(field) for field in load().types[name]]
    return c.IndividualDescription(c.string(name), c.sequence(fields, c.Field))


def _installed_text(name: str) -> str | None:
    """Return another package's interface file, where ROS 2 has installed it."""
    package, kind, short = name.split("/")
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    for prefix in filter(None, [*prefixes, sys.prefix]):
        path = Path(prefix, "share", package, kind, f"{short}.{kind}")
        if path.is_file():
            return path.read_text(encoding="utf-8")
    return None


def _source(name: str) -> c.Source:
    """Return a type's source; derived types have none, and ROS 2 calls that implicit."""
    own = name.startswith(f"{load().package}/")
    text = load().sources.get(name) if own else _installed_text(name)
    encoding = "implicit" if text is None else name.split("/")[1]
    return c.Source(c.string(name), c.string(encoding), c.string(text or ""))


def _type_hash(name: str) -> c.TypeHash:
    digest = bytes.fromhex(load().hashes[name].removeprefix("RIHS01_"))
    return c.TypeHash(1, (ctypes.c_uint8 * 32)(*digest))


@cache
def about(name: str) -> c.About:
    """Return functions that never fail and never return NULL, as rcl demands."""
    others = sorted(references(name))
    individuals = c.sequence([_individual(n) for n in others], c.IndividualDescription)
    description = c.Description(_individual(name), individuals)
    sources = c.sequence([_source(n) for n in (name, *others)], c.Source)
    values = (_type_hash(name), description, sources)
    return c.About(*(c.constant(c.pointer(value)) for value in values))
