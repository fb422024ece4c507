"""Types at run time, from a package's `_type_data.py`: messages are checked and read by them.

It serves all but the fast path: `validate`, `to_dict` and `from_dict`, the words of errors,
`SLOT_TYPES` and rclpy's type descriptions.
"""

from __future__ import annotations

import json
from array import array
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from functools import cache, cached_property
from importlib import import_module
from struct import Struct
from typing import Any, NamedTuple, TypeAlias

from .cdr import NATIVE, order_of
from .names import (
    DecodeError,
    demand_stamp,
    importing,
    public_name,
    slot_name,
    wire_name,
)


class Primitive(NamedTuple):
    """A primitive: its name, bytes on the wire, struct code and range."""

    name: str
    size: int
    code: str
    low: float | None = None
    high: float | None = None

    @property
    def allowed(self) -> str:
        """The values that a field of it takes, in words."""
        if self.code in "?c":
            return "a bool" if self.code == "?" else "bytes of length 1"
        what = "a number" if self.code in "fd" else "an integer"
        limits = "" if self.high is None else f" from {self.low} to {self.high}"
        return f"{what}{limits} ({self.name})"


#: Largest finite float32.
FLOAT32_MAX = 3.4028234663852886e38

PRIMITIVES = {
    2: Primitive("int8", 1, "b", -(1 << 7), (1 << 7) - 1),
    3: Primitive("uint8", 1, "B", 0, (1 << 8) - 1),
    4: Primitive("int16", 2, "h", -(1 << 15), (1 << 15) - 1),
    5: Primitive("uint16", 2, "H", 0, (1 << 16) - 1),
    6: Primitive("int32", 4, "i", -(1 << 31), (1 << 31) - 1),
    7: Primitive("uint32", 4, "I", 0, (1 << 32) - 1),
    8: Primitive("int64", 8, "q", -(1 << 63), (1 << 63) - 1),
    9: Primitive("uint64", 8, "Q", 0, (1 << 64) - 1),
    10: Primitive("float32", 4, "f", -FLOAT32_MAX, FLOAT32_MAX),
    11: Primitive("float64", 8, "d"),
    15: Primitive("bool", 1, "?"),
    16: Primitive("byte", 1, "c"),
}
SCALAR, ARRAY, BOUNDED_SEQUENCE, SEQUENCE = range(4)
DUMMY = "structure_needs_at_least_one_member"


class FieldInfo:
    """A field and its type, from what ROS 2 says of a member; attributes are about one element.

    Exactly one of `primitive`, `text` and `nested` is set; `text_bound` is a string's own limit.
    An array has `size`, a sequence `is_sequence` and perhaps `bound`.
    """

    def __init__(self, member: Mapping[str, Any], nested: Structure | None) -> None:
        kind = member["type"]
        self.name: str = member["name"]
        self.default: str = member["default_value"]
        self.type_id: int = kind["type_id"]
        self.capacity: int = kind["capacity"]
        self.text_bound: int | None = kind["string_capacity"] or None
        #: The type id of an element, and SCALAR, ARRAY, BOUNDED_SEQUENCE or SEQUENCE.
        self.shape, self.base = divmod(self.type_id, 48)
        self.nested = nested
        self.primitive = PRIMITIVES.get(self.base)
        self.text = self.base in {17, 18, 21, 22}
        self.wide = self.base in {18, 22}
        self.size = self.capacity if self.shape == ARRAY else None
        self.is_sequence = self.shape > ARRAY
        self.bound = self.capacity if self.shape == BOUNDED_SEQUENCE else None
        self.slot = slot_name(self.name)
        self.public = public_name(self.name)
        self.is_list = self.shape != SCALAR
        self.is_numeric = self.primitive is not None and self.primitive.code not in "?c"


#: Makes the value of a field of a message, from the bytes of numbers.
Numbers: TypeAlias = Callable[[Any, FieldInfo, Any], Any]


class Types:
    """The types of the package `home`, and all that they refer to, as its `_type_data.py` has them.

    Descriptions are those of ROS 2's own Name.json, those of services and actions and what these
    imply included. A type id is a base plus 48 for an array, 96 or 144 for a sequence.
    Packages may describe types of one name in different ways, so nothing is kept by names alone.
    """

    def __init__(self, content: Mapping[str, Any], home: str = "") -> None:
        self.home = home
        self.package: str = content["package"]
        #: The prefix of other packages' modules, relative to this one if it begins with a dot.
        self.around: str = content.get("around", "")
        self.descriptions: dict[str, Any] = content["descriptions"]
        self.hashes: dict[str, str] = content["hashes"]
        self.sources: dict[str, str] = content["sources"]
        #: The stamps of the package's own classes, and of others that are not standard.
        self.stamps: dict[str, int] = content.get("stamps", {})
        self._structures: dict[str, Structure] = {}

    def __getitem__(self, name: str) -> Structure:
        """Return a type by its full name, package/kind/Name; it is always the same object."""
        structure = self._structures.get(name)
        if structure is None:
            structure = self._structures.setdefault(name, Structure(self, name))
        return structure

    def find_class(self, name: str) -> Any:
        """Return a class by the full name of its type, which need not be described here."""
        package, kind, short = name.split("/")
        root = self.home if package == self.package else self.around + package
        with importing():
            module = import_module(f"{root}.{kind}", self.home)
            return getattr(module, public_name(short))


class Structure:
    """A type that has fields; a service or action has one for each of its parts."""

    def __init__(self, types: Types, name: str) -> None:
        self.types = types
        self.name = name

    @property
    def is_own(self) -> bool:
        """True if it belongs to the package that describes it."""
        return self.name.partition("/")[0] == self.types.package

    @property
    def hash(self) -> str:
        """The hash of the type (RIHS01)."""
        return self.types.hashes[self.name]

    @property
    def vendor(self) -> Any:
        """The module that has the types of other packages, `None` where they are installed."""
        around = self.types.around
        if not around.startswith("."):
            return None
        return import_module(around.removesuffix("."), self.types.home)

    @cached_property
    def members(self) -> tuple[FieldInfo, ...]:
        """The fields as ROS 2 describes them, a dummy one included."""
        return tuple(
            FieldInfo(member, self.types[nested] if nested else None)
            for member in self.types.descriptions[self.name]["fields"]
            for nested in (member["type"]["nested_type_name"],)
        )

    @cached_property
    def fields(self) -> tuple[FieldInfo, ...]:
        """The fields of messages."""
        return tuple(field for field in self.members if field.name != DUMMY)

    @cached_property
    def least(self) -> int:
        """The fewest bytes that a message of it can take."""
        sizes = (
            4 if field.is_sequence else (field.size or 1) * least_element(field)
            for field in self.fields
        )
        return sum(sizes) if self.fields else 1

    def find_class(self) -> Any:
        """Return the class of its messages, of the package that describes it or of another."""
        return self.types.find_class(self.name)


@cache
def _types_in(text: str, home: str) -> Types:
    return Types(json.loads(text), home)


def types_of(kind: type) -> Types:
    """Return what the package of a generated class says of types."""
    home, _, _ = kind.__module__.rsplit(".", 2)
    return _types_in(import_module(f"{home}._type_data").JSON, home)


def structure_of(kind: type) -> Structure:
    """Return the type of a generated class, or of a class that a user derives from one.

    The class's module says which package describes it, wherever this module comes from.
    """
    return _structure_of(getattr(type(kind), "_message", None) or kind)


@cache
def _structure_of(owner: type) -> Structure:
    types = types_of(owner)
    kind = owner.__module__.rsplit(".", 2)[1]
    structure = types[f"{types.package}/{kind}/{wire_name(owner.__name__)}"]
    demand_stamp(owner, types.stamps.get(structure.name))
    _demand_nested(structure)
    return structure


@cache
def _demand_nested(structure: Structure) -> None:
    """Demand the stamps of the classes in a structure, whose fields are read and written, too."""
    stamps = structure.types.stamps
    for field in structure.fields:
        if field.nested and field.nested.name in stamps:
            demand_stamp(field.nested.find_class(), stamps[field.nested.name])
            _demand_nested(field.nested)


def type_hash(kind: type) -> str:
    """Return a generated class's type hash."""
    return structure_of(kind).hash


def is_copy(kind: type, other: type) -> bool:
    """Return whether two generated classes are of one type, as those of two libraries may be."""
    owner, others = (getattr(type(each), "_message", None) for each in (kind, other))
    if owner is None or others is None or owner.__name__ != others.__name__:
        return False
    return type_hash(owner) == type_hash(others)


def slot_types(kind: type) -> tuple[Any, ...]:
    """Return the fields' types as rosidl_parser.definition objects."""
    if "SLOT_TYPES" in kind.__dict__:  # the base of all messages
        return ()
    try:
        definition = import_module("rosidl_parser.definition")
    except ImportError as error:
        raise ImportError(
            f"{kind.__name__}.SLOT_TYPES needs rosidl_parser, which cannot be imported "
            f"({error}): source your ROS 2 installation, or pip install "
            "ros-jazzy-rosidl-parser"
        ) from error
    return tuple(_slot_type(definition, field) for field in structure_of(kind).fields)


#: The names of primitives in rosidl_parser, where these are others.
_BASIC = {"bool": "boolean", "byte": "octet", "float32": "float", "float64": "double"}


def _slot_type(definition: Any, field: FieldInfo) -> Any:
    if field.nested:
        *namespaces, short = field.nested.name.split("/")
        element = definition.NamespacedType(namespaces, short)
    elif field.primitive:
        name = field.primitive.name
        element = definition.BasicType(_BASIC.get(name, name))
    else:
        name = "WString" if field.wide else "String"
        if field.text_bound is None:
            element = getattr(definition, f"Unbounded{name}")()
        else:
            element = getattr(definition, f"Bounded{name}")(field.text_bound)
    if field.size is not None:
        return definition.Array(element, field.size)
    if field.bound is not None:
        return definition.BoundedSequence(element, field.bound)
    return definition.UnboundedSequence(element) if field.is_sequence else element


def spelling_hint(name: str, names: list[str]) -> str:
    """Return the name closest to a misspelled one, in words that follow a statement."""
    matches = get_close_matches(name, names, 1)
    return f"; did you mean {matches[0]!r}?" if matches else ""


def inner_path(path: str, name: object) -> str:
    """Return the path of a field or key in what is at a path."""
    return f"{path}.{name}" if path else str(name)


def counted(count: int, what: str) -> str:
    """Return a number of things in words."""
    return f"{count} {what}{'s' * (count != 1)}"


# reading field by field: the buffers that the fast codecs refuse


def read_carefully(
    kind: type, data: bytes, maker: Callable[[Any], Callable[[], Any]]
) -> Any:
    """Return the message in `data`; raise DecodeError naming the field and the byte.

    It takes what middlewares take although it is not right: text that is not UTF-8, text without
    its terminating zero. `maker` returns the function that makes empty messages of a class.
    """
    structure = structure_of(kind)

    def make(other: Structure) -> Any:
        # what a constructor makes may be larger than the buffer
        return maker(kind if other is structure else other.find_class())()

    return CarefulReader(data, order_of(data), make).message(structure, "")


def least_element(field: FieldInfo) -> int:
    """Return the fewest bytes that a value of a field, or an element of it, can take."""
    if field.nested:
        return field.nested.least
    return 4 if field.primitive is None else field.primitive.size


class CarefulReader:
    """Goes over a buffer and never further than it has bytes for.

    `make` returns what takes the values of a structure, `numbers` what a field holds of numbers.
    """

    def __init__(
        self,
        data: Any,
        order: str,
        make: Callable[[Structure], Any],
        numbers: Numbers | None = None,
    ) -> None:
        self.data = data
        self.order = order
        self.make = make
        self.numbers = numbers or self.copied
        self.at = 4

    def message(self, structure: Structure, path: str) -> Any:
        """Read a structure."""
        message = self.make(structure)
        if not structure.fields:
            self.take(1, 1, path or structure.name)
        for field in structure.fields:
            place = inner_path(path, field.public)
            setattr(message, field.slot, self.field(field, place, message))
        return message

    def field(self, field: FieldInfo, path: str, message: Any) -> Any:
        """Read a field of a message."""
        if not field.is_list:
            return self.element(field, path)
        count = field.size
        if count is None:
            count = self.count(path, "elements")
            if field.bound is not None and count > field.bound:
                problem = f"{count} elements where at most {field.bound} are allowed"
                raise DecodeError(problem, path, self.at - 4)
        self.enough(count * least_element(field), path, f"{count} elements")
        if field.is_numeric and field.primitive is not None:
            size = field.primitive.size
            raw = self.take(count * size, size, path) if count else b""
            return self.numbers(message, field, raw)
        return [self.element(field, f"{path}[{index}]") for index in range(count)]

    def copied(self, _message: Any, field: FieldInfo, raw: bytes) -> Any:
        """Return an array of numbers."""
        assert field.primitive is not None
        result = array(field.primitive.code, raw)
        if self.order != NATIVE:
            result.byteswap()
        if field.is_sequence:
            return result
        import numpy as np

        return np.array(result, field.primitive.name)

    def element(self, field: FieldInfo, path: str) -> Any:
        """Read one value."""
        if field.nested:
            return self.message(field.nested, path)
        if field.primitive is not None:
            size = field.primitive.size
            raw = self.take(size, size, path)
            return Struct(self.order + field.primitive.code).unpack(raw)[0]
        if field.wide:
            return self.wide(self.count(path, "units"), path)
        size = self.count(path, "bytes of text")
        raw = self.take(size, 1, path, f"{size} bytes of text")
        return bytes(raw).removesuffix(b"\0").decode("utf-8", "replace")

    def wide(self, count: int, path: str) -> str:
        """Read a wstring, whose units must be UTF-16."""
        at = self.at
        units = array(
            "I", bytes(self.take(4 * count, 4, path, f"{count} units of text"))
        )
        if self.order != NATIVE:
            units.byteswap()
        for index, unit in enumerate(units):
            if unit > 0xFFFF:
                problem = f"{unit:#x} is not a UTF-16 unit"
                raise DecodeError(problem, path, at + 4 * index)
        raw = b"".join(unit.to_bytes(2, "little") for unit in units)
        return raw.decode("utf-16-le", "replace")

    def count(self, path: str, what: str) -> int:
        """Read a count or size."""
        raw = self.take(4, 4, path, f"the number of {what}")
        return int.from_bytes(raw, "little" if self.order == "<" else "big")

    def take(self, size: int, align: int, path: str, what: str = "") -> Any:
        """Return the bytes of the next value."""
        self.at += (4 - self.at) % align
        self.enough(size, path, what or counted(size, "byte"))
        self.at += size
        return self.data[self.at - size : self.at]

    def enough(self, size: int, path: str, what: str) -> None:
        """Check that `size` bytes are left."""
        left = max(0, len(self.data) - self.at)
        if size > left:
            raise DecodeError(f"{what} expected, {left} bytes left", path, self.at)
