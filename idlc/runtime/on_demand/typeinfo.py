"""What is known of types at run time, from `type_data.py`: read when first asked for.

It serves what is not on the fast path: `validate`, `to_dict` and `from_dict`, the words of
errors, `SLOT_TYPES` and rclpy's type descriptions.
"""

from __future__ import annotations

import json
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

from ..errors import importing
from ..names import public_name, slot_name, wire_name
from ..objects import owner_of


class Primitive(NamedTuple):
    """A primitive: its name, bytes on the wire, struct code and range."""

    name: str
    size: int
    code: str
    low: float | None = None
    high: float | None = None

    @property
    def allowed(self) -> str:
        """What a field of it takes, in words."""
        if self.code in "?c":
            return "a bool" if self.code == "?" else "bytes of length 1"
        what = "a number" if self.code in "fd" else "an integer"
        limits = "" if self.high is None else f" from {self.low} to {self.high}"
        return f"{what}{limits} ({self.name})"


#: The package that this support package is part of.
OWN = __name__.rsplit(".", 3)[0]

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
    nested: str
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
        """Whether the value holds elements."""
        return self.is_sequence or self.size is not None

    @property
    def is_numeric(self) -> bool:
        """Whether an element is an integer or float."""
        return self.primitive is not None and self.primitive.code not in "?c"


@cache
def types() -> dict[str, Any]:
    """Return the content of `type_data.py`."""
    module = import_module(f"{__name__.rsplit('.', 2)[0]}.type_data")
    content: dict[str, Any] = json.loads(module.JSON)
    return content


def type_name(kind: type) -> str:
    """Return a message class's full name, package/kind/Name."""
    kind = owner_of(kind)
    path = kind.__module__.split(".")
    package = types()["package"] if kind.__module__.startswith(OWN + ".") else path[-3]
    return f"{package}/{path[-2]}/{wire_name(kind.__name__)}"


@cache
def fields_of(name: str) -> tuple[FieldInfo, ...]:
    """Return the fields of a type by its full name, the dummy member left out."""
    found = types()["descriptions"][name]["fields"]
    return tuple(_field(field) for field in found if field["name"] != DUMMY)


def _field(field: dict[str, Any]) -> FieldInfo:
    type_ = field["type"]
    shape, element = divmod(type_["type_id"], 48)
    return FieldInfo(
        name=field["name"],
        primitive=PRIMITIVES.get(element),
        text=element in STRING_IDS,
        wide=element in WIDE_IDS,
        text_bound=type_["string_capacity"] or None,
        nested=type_["nested_type_name"],
        size=type_["capacity"] if shape == 1 else None,
        is_sequence=shape > 1,
        bound=type_["capacity"] if shape == 2 else None,
    )


def class_of(name: str) -> Any:
    """Return the class of a type by its full name, of this package or of another."""
    package, kind, short = name.split("/")
    others = types().get("around", "")  # where other packages are, if not at the top
    root = OWN if package == types()["package"] else others + package
    with importing():
        return getattr(import_module(f"{root}.{kind}"), public_name(short))


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
    return tuple(_slot_type(definition, field) for field in fields_of(type_name(kind)))


def _slot_type(definition: Any, field: FieldInfo) -> Any:
    element: Any
    if field.nested:
        package, kind, short = field.nested.split("/")
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
