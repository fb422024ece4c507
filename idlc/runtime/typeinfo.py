"""Types at run time, from a package's `_type_data.py`: messages are checked and read by them.

It serves all but the fast path: `validate`, `to_dict` and `from_dict`, the words of errors,
`SLOT_TYPES` and rclpy's type descriptions.
"""

from __future__ import annotations

import json
import math
from array import array
from collections.abc import Callable
from difflib import get_close_matches
from functools import cache, cached_property
from importlib import import_module
from struct import Struct
from types import SimpleNamespace
from typing import Any, NamedTuple

from .cdr import NATIVE, order_of
from .errors import (
    DecodeError,
    FieldRangeError,
    FieldTypeError,
    ValidationError,
    importing,
)
from .names import public_name, slot_name, wire_name


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
STRING_IDS = {17, 18, 21, 22}
WIDE_IDS = {18, 22}
DUMMY = "structure_needs_at_least_one_member"


class FieldInfo(NamedTuple):
    """A field's type.

    Exactly one of `primitive`, `text` and `nested` is set. An array has `size`, a sequence
    `is_sequence` and perhaps `bound`; `text_bound` is a string's own limit.
    """

    name: str
    primitive: Primitive | None
    text: bool
    wide: bool
    text_bound: int | None
    nested: Structure | None
    size: int | None
    is_sequence: bool
    bound: int | None

    @property
    def slot(self) -> str:
        """The slot that holds the value."""
        return slot_name(self.name)

    @property
    def public(self) -> str:
        """The attribute's public name."""
        return public_name(self.name)

    @property
    def is_list(self) -> bool:
        """True if the value holds elements."""
        return self.is_sequence or self.size is not None

    @property
    def is_numeric(self) -> bool:
        """True if an element is an integer or float."""
        return self.primitive is not None and self.primitive.code not in "?c"


class Types:
    """What a package says of types, its own and all that they refer to, in `_type_data.py`.

    Packages may describe types of one name in different ways, so nothing is kept by names alone.
    """

    def __init__(self, module: Any) -> None:
        content = json.loads(module.JSON)
        self.home: str = module.__package__.removesuffix("._idlc")
        self.package: str = content["package"]
        #: The prefix of other packages' modules, relative to this one if it begins with a dot.
        self.around: str = content.get("around", "")
        self.descriptions: dict[str, Any] = content["descriptions"]
        self.hashes: dict[str, str] = content["hashes"]
        self.sources: dict[str, str] = content["sources"]
        self._structures: dict[str, Structure] = {}

    def __getitem__(self, name: str) -> Structure:
        """Return a type by its full name, package/kind/Name; it is always the same object."""
        structure = self._structures.get(name)
        if structure is None:
            structure = self._structures.setdefault(name, Structure(self, name))
        return structure


class Structure:
    """A type that has fields; a service or action has one for each of its parts."""

    def __init__(self, types: Types, name: str) -> None:
        self.types = types
        self.name = name
        #: The members as ROS 2 describes them, a dummy one included.
        self.members: list[dict[str, Any]] = types.descriptions[name]["fields"]

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
    def fields(self) -> tuple[FieldInfo, ...]:
        """The fields, the dummy member left out."""
        return tuple(
            self._field(member) for member in self.members if member["name"] != DUMMY
        )

    def _field(self, member: dict[str, Any]) -> FieldInfo:
        type_ = member["type"]
        shape, element = divmod(type_["type_id"], 48)
        nested = type_["nested_type_name"]
        return FieldInfo(
            name=member["name"],
            primitive=PRIMITIVES.get(element),
            text=element in STRING_IDS,
            wide=element in WIDE_IDS,
            text_bound=type_["string_capacity"] or None,
            nested=self.types[nested] if nested else None,
            size=type_["capacity"] if shape == 1 else None,
            is_sequence=shape > 1,
            bound=type_["capacity"] if shape == 2 else None,
        )

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
        package, kind, short = self.name.split("/")
        root = self.types.home if self.is_own else self.types.around + package
        with importing():
            module = import_module(f"{root}.{kind}", self.types.home)
            return getattr(module, public_name(short))


_types_of = cache(Types)


def structure_of(kind: type) -> Structure:
    """Return the type of a generated class, or of a class that a user derives from one.

    The class's module says which package describes it, wherever this module comes from.
    """
    return _structure_of(getattr(type(kind), "_message", None) or kind)


@cache
def _structure_of(owner: type) -> Structure:
    home, kind, _ = owner.__module__.rsplit(".", 2)
    try:
        data = import_module(f"{home}._type_data")
    except ModuleNotFoundError:
        data = import_module(f"{home}._idlc.type_data")  # as before version 0.2
    types = _types_of(data)
    return types[f"{types.package}/{kind}/{wire_name(owner.__name__)}"]


def type_name(kind: type) -> str:
    """Return a generated class's full name, package/kind/Name."""
    return structure_of(kind).name


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


def _slot_type(definition: Any, field: FieldInfo) -> Any:
    element: Any
    if field.nested:
        package, kind, short = field.nested.name.split("/")
        element = definition.NamespacedType([package, kind], short)
    elif field.text and field.text_bound is not None:
        bounded = definition.BoundedWString if field.wide else definition.BoundedString
        element = bounded(field.text_bound)
    elif field.text:
        element = (
            definition.UnboundedWString()
            if field.wide
            else definition.UnboundedString()
        )
    else:
        assert field.primitive is not None
        names = {
            "bool": "boolean",
            "byte": "octet",
            "float32": "float",
            "float64": "double",
        }
        element = definition.BasicType(
            names.get(field.primitive.name, field.primitive.name)
        )
    if field.size is not None:
        return definition.Array(element, field.size)
    if field.bound is not None:
        return definition.BoundedSequence(element, field.bound)
    return definition.UnboundedSequence(element) if field.is_sequence else element


def spelling_hint(name: str, names: list[str]) -> str:
    """Return the name closest to a misspelled one, in words that follow a statement."""
    matches = get_close_matches(name, names, 1)
    return f"; did you mean {matches[0]!r}?" if matches else ""


# checking values


def validate(message: Any, *, wire_only: bool = False) -> None:
    """Raise ValidationError for the first value that its field cannot hold.

    `wire_only` leaves out what the wire does not enforce: the bounds of strings.
    """
    _message(message, structure_of(type(message)), "", wire_only)


def validate_field(value: Any, field: FieldInfo) -> None:
    """Raise ValidationError if a field, which is named by its path, cannot hold a value."""
    check = _list if field.is_list else _element
    check(value, field, field.public, wire_only=True)


def validate_element(value: Any, field: FieldInfo) -> None:
    """Raise ValidationError if a field, or a list in it, cannot hold a value."""
    _element(value, field, field.public, wire_only=False)


def validate_count(values: Any, field: FieldInfo) -> None:
    """Raise ValidationError if a field cannot hold so many values."""
    _count(values, field, field.public)


def _message(message: Any, structure: Structure, path: str, wire_only: bool) -> None:
    for field in structure.fields:
        place = inner_path(path, field.public)
        if not hasattr(message, field.slot):
            raise ValidationError(path or "message", f"a {structure.name}", message)
        value = getattr(message, field.slot)
        if field.is_list:
            _list(value, field, place, wire_only)
        else:
            _element(value, field, place, wire_only)


def _list(values: Any, field: FieldInfo, path: str, wire_only: bool) -> None:
    if isinstance(values, (str, dict)) or not hasattr(values, "__len__"):
        raise ValidationError(path, "a sequence", values)
    _count(values, field, path)
    if field.primitive is not None and _holds(values, field.primitive):
        return
    for index, value in enumerate(values):
        _element(value, field, f"{path}[{index}]", wire_only)


def _count(values: Any, field: FieldInfo, path: str) -> None:
    if field.size is not None and len(values) != field.size:
        problem = f"has {counted(len(values), 'element')}, needs {field.size}"
        raise ValidationError(path, f"{field.size} elements", values, problem)
    if field.bound is not None and len(values) > field.bound:
        _too_many(path, "element", len(values), field.bound, values)


def _holds(values: Any, primitive: Primitive) -> bool:
    """Return whether an array's own type already says that all elements fit."""
    if primitive.code in "?c":
        return isinstance(values, (bytes, bytearray))
    if isinstance(values, array):
        return values.typecode == primitive.code
    dtype = getattr(values, "dtype", None)
    return dtype is not None and dtype.name == primitive.name and values.ndim == 1


def _element(value: Any, field: FieldInfo, path: str, wire_only: bool) -> None:
    if field.nested:
        _message(value, field.nested, path, wire_only)
    elif field.text:
        _text(value, field, path, wire_only)
    else:
        assert field.primitive is not None
        _primitive(value, field.primitive, path)


def _text(value: Any, field: FieldInfo, path: str, wire_only: bool) -> None:
    if not isinstance(value, str):
        raise ValidationError(path, "a str", value)
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValidationError(path, "a str without lone surrogates", value) from None
    if not wire_only and field.text_bound is not None and len(value) > field.text_bound:
        _too_many(path, "character", len(value), field.text_bound, value)


def _too_many(path: str, what: str, count: int, bound: int, value: object) -> None:
    problem = f"has {counted(count, what)}, at most {bound} are allowed"
    raise ValidationError(path, f"at most {counted(bound, what)}", value, problem)


def inner_path(path: str, name: object) -> str:
    """Return the path of a field or key in what is at a path."""
    return f"{path}.{name}" if path else str(name)


def counted(count: int, what: str) -> str:
    """Return a number of things in words."""
    return f"{count} {what}{'s' * (count != 1)}"


def _primitive(value: Any, primitive: Primitive, path: str) -> None:
    if primitive.code == "?":
        number = isinstance(value, (int, float)) and value in (0, 1)
        if not number and type(value).__name__ not in {"bool_", "bool"}:
            raise ValidationError(path, primitive.allowed, value)
    elif primitive.code == "c":
        if not isinstance(value, bytes) or len(value) != 1:
            raise ValidationError(path, primitive.allowed, value)
    elif primitive.code in "fd":
        _float(value, primitive, path)
    else:
        _integer(value, primitive, path)


def _integer(value: Any, primitive: Primitive, path: str) -> None:
    try:
        number = value.__index__()
    except (AttributeError, TypeError):
        raise ValidationError(path, primitive.allowed, value) from None
    assert primitive.low is not None
    assert primitive.high is not None
    if not primitive.low <= number <= primitive.high:
        raise ValidationError(path, primitive.allowed, value)


def _float(value: Any, primitive: Primitive, path: str) -> None:
    try:
        number = float(value) if not isinstance(value, (str, bytes)) else None
    except (TypeError, ValueError, OverflowError):
        number = None
    if number is None:
        raise ValidationError(path, f"a number ({primitive.name})", value)
    if primitive.high is None or not math.isfinite(number):
        return
    if abs(number) > primitive.high:
        raise ValidationError(path, primitive.allowed, value)


def refused(
    name: str, kind: str, size: int | None, values: Any, error: Exception
) -> ValidationError:
    """Return the error for values that a field of numbers does not take.

    `kind` is the name of their type, or its code in `struct`. `error` is what Python or
    numpy said, and one of its kind is returned: rosidl's classes raise that.
    """
    primitive = next(
        candidate
        for candidate in PRIMITIVES.values()
        if kind in (candidate.code, candidate.name)
    )
    field = FieldInfo(
        name, primitive, False, False, None, None, size, size is None, None
    )
    failure = ValidationError(
        name, f"numbers ({primitive.name})", values, f"{error} ({primitive.name})"
    )
    if isinstance(values, (bytes, bytearray)) and size is None:
        problem = (
            f"has {counted(len(values), 'byte')}, needs a multiple of {primitive.size}"
        )
        failure = ValidationError(name, "whole numbers of bytes", values, problem)
    elif (
        isinstance(values, (list, tuple))
        or getattr(values, "ndim", 0) == 1
        or not hasattr(values, "__len__")
    ):
        try:
            _list(values, field, name, wire_only=True)
        except ValidationError as exact:
            failure = exact
    raised = ValidationError
    if isinstance(error, OverflowError):
        raised = FieldRangeError
    elif isinstance(error, TypeError) or isinstance(values, (str, dict)):
        raised = FieldTypeError
    return failure.at(failure.path, raised)  # type: ignore[no-any-return]


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

    return _Reader(data, order_of(data), make).message(structure, "")


def check_buffer(structure: Structure, data: bytes) -> None:
    """Raise DecodeError, as `deserialize` does, unless `data` is a message of a type.

    No class is needed, so that those of other packages need not be installed.
    """
    _Reader(data, order_of(data), lambda _: SimpleNamespace()).message(structure, "")


def least_element(field: FieldInfo) -> int:
    """Return the fewest bytes that a value of a field, or an element of it, can take."""
    if field.nested:
        return field.nested.least
    return 4 if field.primitive is None else field.primitive.size


class _Reader:
    """Goes over a buffer and never further than it has bytes for.

    `make` returns what takes the values of a structure.
    """

    def __init__(
        self, data: bytes, order: str, make: Callable[[Structure], Any]
    ) -> None:
        self.data = data
        self.order = order
        self.make = make
        self.at = 4

    def message(self, structure: Structure, path: str) -> Any:
        """Read a structure."""
        message = self.make(structure)
        if not structure.fields:
            self.take(1, 1, path or structure.name)
        for field in structure.fields:
            place = inner_path(path, field.public)
            setattr(message, field.slot, self.field(field, place))
        return message

    def field(self, field: FieldInfo, path: str) -> Any:
        """Read a field."""
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
            return self.numbers(field, count, path)
        return [self.element(field, f"{path}[{index}]") for index in range(count)]

    def numbers(self, field: FieldInfo, count: int, path: str) -> Any:
        """Read an array of numbers."""
        assert field.primitive is not None
        size = field.primitive.size
        result = array(field.primitive.code)
        if count:
            result.frombytes(self.take(count * size, size, path))
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
        return raw.removesuffix(b"\0").decode("utf-8", "replace")

    def wide(self, count: int, path: str) -> str:
        """Read a wstring, whose units must be UTF-16."""
        at = self.at
        units = array("I", self.take(4 * count, 4, path, f"{count} units of text"))
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

    def take(self, size: int, align: int, path: str, what: str = "") -> bytes:
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
