"""The meaning of interface files, as immutable values.

References are names, never pointers; "no bound" is `None`, never 0; a type that failed is
`Unknown`, which later passes skip in silence so that one cause gives one error. Spans are
`None` where there is no text (derived messages, the catalogue).
"""

from __future__ import annotations

import re
from collections.abc import Hashable
from typing import Literal, NamedTuple, TypeAlias

import msgspec

from idlc.diagnostics.source import Source, Span

Kind: TypeAlias = Literal["msg", "srv", "action"]
KINDS: tuple[Kind, ...] = ("msg", "srv", "action")
Scalar: TypeAlias = bool | int | float | str
Value: TypeAlias = Scalar | tuple[Scalar, ...]

#: The member that rosidl adds to a structure without fields, and that travels on the wire.
DUMMY_FIELD = "structure_needs_at_least_one_member"


class TypeName(NamedTuple):
    """The full name of a structure or interface, such as std_msgs/msg/Header."""

    package: str
    kind: Kind
    name: str

    def __str__(self) -> str:
        return f"{self.package}/{self.kind}/{self.name}"

    @property
    def file(self) -> str:
        """The name of an interface's file within the package, such as `msg/RobotCommand.msg`."""
        return f"{self.kind}/{self.name}.{self.kind}"

    @classmethod
    def parse(cls, text: str) -> TypeName:
        """Return the name that `text` spells as package/kind/Name; raise ValueError otherwise."""
        package, kind, name = text.split("/")
        if kind not in KINDS:
            raise ValueError(f"not an interface kind: {kind!r}")
        return cls(package, kind, name)


class PrimitiveInfo(NamedTuple):
    """The facts of one primitive: IDL spelling, RIHS type id, wire format and value range.

    `code` is the struct format character; `low` and `high` are `None` for bool and floats.
    Source: language 2.
    """

    idl: str
    type_id: int
    code: str
    size: int
    low: int | None = None
    high: int | None = None

    @property
    def dtype(self) -> str:
        """Numpy's name of it."""
        return {"float": "float32", "double": "float64"}.get(self.idl, self.idl)


PRIMITIVES: dict[str, PrimitiveInfo] = {
    "bool": PrimitiveInfo("boolean", 15, "?", 1),
    "byte": PrimitiveInfo("octet", 16, "B", 1, 0, 0xFF),
    "char": PrimitiveInfo("uint8", 3, "B", 1, 0, 0xFF),
    "int8": PrimitiveInfo("int8", 2, "b", 1, -(1 << 7), (1 << 7) - 1),
    "uint8": PrimitiveInfo("uint8", 3, "B", 1, 0, (1 << 8) - 1),
    "int16": PrimitiveInfo("int16", 4, "h", 2, -(1 << 15), (1 << 15) - 1),
    "uint16": PrimitiveInfo("uint16", 5, "H", 2, 0, (1 << 16) - 1),
    "int32": PrimitiveInfo("int32", 6, "i", 4, -(1 << 31), (1 << 31) - 1),
    "uint32": PrimitiveInfo("uint32", 7, "I", 4, 0, (1 << 32) - 1),
    "int64": PrimitiveInfo("int64", 8, "q", 8, -(1 << 63), (1 << 63) - 1),
    "uint64": PrimitiveInfo("uint64", 9, "Q", 8, 0, (1 << 64) - 1),
    "float32": PrimitiveInfo("float", 10, "f", 4),
    "float64": PrimitiveInfo("double", 11, "d", 8),
}


class Primitive(msgspec.Struct, frozen=True, tag="primitive"):
    """A bool, byte, char, integer or float; `name` as in .msg files, a key of PRIMITIVES."""

    name: str

    @property
    def info(self) -> PrimitiveInfo:
        """The facts of this primitive."""
        return PRIMITIVES[self.name]


class String(msgspec.Struct, frozen=True, tag="string"):
    """A string or wstring; `bound` in code points on the Python side, `None` for no bound."""

    wide: bool = False
    bound: int | None = None


class Ref(msgspec.Struct, frozen=True, tag="ref"):
    """A structure by name. Files can only name messages; derived ones name srv and action types."""

    target: TypeName


class Unknown(msgspec.Struct, frozen=True, tag="unknown"):
    """The poison type: already reported, skipped by later passes."""


Element: TypeAlias = Primitive | String | Ref | Unknown


class Array(msgspec.Struct, frozen=True, tag="array"):
    """Exactly `size` elements."""

    element: Element
    size: int


class Sequence(msgspec.Struct, frozen=True, tag="sequence"):
    """Any number of elements, at most `bound` unless it is `None`."""

    element: Element
    bound: int | None = None


FieldType: TypeAlias = Element | Array | Sequence


class Default(msgspec.Struct, frozen=True):
    """A declared default.

    `value` is the value in Python (a tuple for arrays); `text` is the annotation's `str()` as
    type descriptions have it (language 6).
    """

    value: Value
    text: str


class Field(msgspec.Struct, frozen=True, kw_only=True):
    """A field. `comment` is condensed (language 1.4) but not yet escaped; `unit` likewise.

    `optional`: it is marked `@optional`, which has no effect (language 10).
    """

    name: str
    type: FieldType
    default: Default | None = None
    comment: tuple[str, ...] = ()
    unit: str | None = None
    optional: bool = False
    name_span: Span | None = None
    type_span: Span | None = None
    default_span: Span | None = None


class Constant(msgspec.Struct, frozen=True, kw_only=True):
    """A constant. `type` is a primitive or an unbounded (w)string."""

    name: str
    type: Primitive | String
    value: Scalar
    comment: tuple[str, ...] = ()
    unit: str | None = None
    name_span: Span | None = None
    value_span: Span | None = None


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """A structure: a .msg file, a section of a service or action, or one derived from them.

    `fields` never holds the dummy member; see `wire_fields`.
    """

    name: TypeName
    fields: tuple[Field, ...] = ()
    constants: tuple[Constant, ...] = ()
    comment: tuple[str, ...] = ()
    unit: str | None = None
    source: Source | None = None

    @property
    def wire_fields(self) -> tuple[Field, ...]:
        """The fields as hashed and sent: a dummy member where there are none (language 5, 8.6)."""
        return self.fields or (Field(name=DUMMY_FIELD, type=Primitive("uint8")),)

    @property
    def holders(self) -> tuple[tuple[Field, TypeName], ...]:
        """The fields whose types name structures, each with that structure, in order."""
        elements = ((field, element_of(field.type)) for field in self.fields)
        return tuple(
            (field, element.target) for field, element in elements if isinstance(element, Ref)
        )

    @property
    def references(self) -> tuple[TypeName, ...]:
        """The structures that the fields' types name, once for each field, in order."""
        return tuple(target for _, target in self.holders)


class Service(msgspec.Struct, frozen=True, kw_only=True):
    """A .srv file, or one of the two services of an action."""

    name: TypeName
    request: Message
    response: Message
    source: Source | None = None


class Action(msgspec.Struct, frozen=True, kw_only=True):
    """A .action file."""

    name: TypeName
    goal: Message
    result: Message
    feedback: Message
    source: Source | None = None


Interface: TypeAlias = Message | Service | Action


def path_of(interface: Interface) -> str:
    """Return the path of an interface's text, or its name if there is none."""
    return interface.source.path if interface.source else str(interface.name)


def element_of(type_: FieldType) -> Element:
    """Return the element of an array or sequence, or the type itself."""
    return type_.element if isinstance(type_, (Array, Sequence)) else type_


_NUMBER = r"[+-]?(?:\d+(?:\.\d+)?(?:[eE][+-]?\d+)?|\d*(?:pi|π)(?:/\d+)?|inf|∞)%?"
_RANGE = re.compile(
    rf"\s*(?:{_NUMBER}\s*(?:\.\.\.?|…|-|\u2013|to)\s*{_NUMBER}|(?:[<>]=?|≤|≥)\s*{_NUMBER})\s*"
)


def spell(type_: FieldType, package: str = "") -> str:
    """Return a type as written in a file of `package`, such as `string<=10[<=3]`."""
    match type_:
        case Array():
            return f"{spell(type_.element, package)}[{type_.size}]"
        case Sequence():
            bound = "" if type_.bound is None else f"<={type_.bound}"
            return f"{spell(type_.element, package)}[{bound}]"
        case Primitive():
            return type_.name
        case String():
            bound = "" if type_.bound is None else f"<={type_.bound}"
            return f"{'w' * type_.wide}string{bound}"
        case Ref():
            name = type_.target
            return name.name if name.package == package else f"{name.package}/{name.name}"
        case Unknown():
            return "?"


def spell_value(value: Value) -> str:
    """Return a value as a person would write it."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(spell_value, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)


def is_range(unit: str) -> bool:
    """Return whether the text in the brackets of a comment is a range, and no unit."""
    return _RANGE.fullmatch(unit) is not None


_PLACES = frozenset({"source", "name_span", "type_span", "default_span", "value_span"})
_CHAR, _UINT8 = Primitive("char"), Primitive("uint8")


def meaning(interface: Interface) -> Hashable:
    """Return a value that is equal for two interfaces exactly when they mean the same.

    Comments and units count, spans and sources do not.
    """
    return _plain(interface)


def content(interface: Interface) -> Hashable:
    """Return a value that is equal for two interfaces if they differ in comments only.

    Facts that IDL does not have are ignored, too: units, except of fields, and `char`.
    """
    return _plain(interface, bare=True)


def _plain(value: object, *, bare: bool = False) -> Hashable:
    if isinstance(value, msgspec.Struct):
        left_out = _PLACES
        if bare:
            left_out |= {"comment"} if isinstance(value, Field) else {"comment", "unit"}
            value = _UINT8 if value == _CHAR else value
        fields = (name for name in value.__struct_fields__ if name not in left_out)
        inside = ((name, _plain(getattr(value, name), bare=bare)) for name in fields)
        return type(value).__name__, *inside
    if isinstance(value, tuple):
        return tuple(_plain(item, bare=bare) for item in value)
    # NaN is not equal to itself, 1 is to 1.0 and True
    return type(value).__name__, repr(value)
