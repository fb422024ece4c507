"""Typed Python names: nothing reaches generated code as a name except through here."""

from __future__ import annotations

import builtins
import keyword
from collections.abc import Container, Iterable, Mapping
from typing import NewType, TypeAlias

from idlc.model import ir
from idlc.model.names import snake_case
from idlc.runtime.names import public_name, slot_name

ModuleName = NewType("ModuleName", str)
ClassName = NewType("ClassName", str)
FieldName = NewType("FieldName", str)
SlotName = NewType("SlotName", str)
LocalName = NewType("LocalName", str)
Modules: TypeAlias = Mapping[ir.TypeName, ModuleName]

#: Names that the emitted codecs use themselves.
CODEC_NAMES = frozenset(
    "array at chars count data decode each encapsulation encode end ended join kind limit listed "
    "message order pad2 pad4 pad8 parts put raw reading size sized small strings struct text "
    "to_str truths unsized view wide_text words".split()
)

#: The methods that a message class inherits; a field of such a name hides the method.
METHODS = frozenset(
    "deserialize deserialize_many from_dict get_fields_and_field_types serialize serialize_many "
    "to_arrow to_columns to_dict validate".split()
)

#: Names that no value of a field should have.
RESERVED = CODEC_NAMES | set(keyword.kwlist) | set(dir(builtins))


def modules(names: Iterable[ir.TypeName]) -> Modules:
    """Return the module that holds each interface, without its package.

    Names that rosidl would put into one module, such as FooBar and FOOBar, get one each.
    """
    taken: dict[tuple[ir.Kind, str], int] = {}
    named: dict[ir.TypeName, ModuleName] = {}
    for name in sorted(names):
        module = f"_{snake_case(name.name)}"
        number = taken[name.kind, module] = taken.get((name.kind, module), 0) + 1
        named[name] = ModuleName(module if number == 1 else f"{module}_{number}")
    return named


def codec_module(module: str) -> ModuleName:
    """Return the module of the codecs of a module; no interface's has two underscores inside."""
    return ModuleName(f"{module}__codec")


def class_(name: ir.TypeName) -> ClassName:
    """Return the class of a structure, service or action."""
    return ClassName(public_name(name.name))


def qualified_class(name: ir.TypeName) -> ClassName:
    """Return a name for another package's class where the plain one is taken."""
    return ClassName(f"{name.package}_{class_(name)}")


def enum(stem: str, taken: Container[str] = ()) -> ClassName:
    """Return the class, within that of a message, for the values of a field of this name."""
    name = "".join(part.capitalize() for part in stem.split("_"))
    while name in taken or keyword.iskeyword(name):
        name += "_"
    return ClassName(name)


def field(name: str) -> FieldName:
    """Return the attribute of a field."""
    return FieldName(public_name(name))


def slot(name: str) -> SlotName:
    """Return the slot of a field."""
    return SlotName(slot_name(name))


class Locals:
    """The local variables of one function: each name is used once."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def new(self, base: str) -> LocalName:
        """Return `base`, or a name like it that is free."""
        name = base
        count = 1
        while name in self._taken:
            count += 1
            name = f"{base}_{count}"
        self._taken.add(name)
        return LocalName(name)

    def field(self, path: str) -> LocalName:
        """Return the variable of a field's value; no field's name can end in an underscore."""
        return self.new(f"{path}_" if path in RESERVED else path)

    def mark(self) -> frozenset[str]:
        """Return a mark with which `reset` forgets all names used from now on."""
        return frozenset(self._taken)

    def reset(self, mark: frozenset[str]) -> None:
        """Forget the names used since `mark`."""
        self._taken = set(mark)
