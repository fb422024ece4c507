"""The classes that one module needs from elsewhere: by which name, and where they are imported."""

from __future__ import annotations

import builtins
from collections import defaultdict
from collections.abc import Iterable

from idlc.emit import pynames
from idlc.emit.codec import wire_plan
from idlc.emit.imports import statements
from idlc.model import derive, ir


class Homes:
    """The module of each structure of a package, without the package and the kind.

    Those of other packages are inside of the Python package `around`, if that is not empty.
    """

    def __init__(self, interface: ir.Interface, modules: pynames.Modules, around: str = "") -> None:
        self.modules = modules
        self.around = f"{around}." if around else ""
        self.classes = modules[interface.name]
        self.protocol = pynames.protocol_module(self.classes)
        self.sections = {message.name for message in derive.sections(interface)}
        self.derived = {message.name for message in derive.messages(interface)} - self.sections

    def of(self, structure: ir.TypeName) -> pynames.ModuleName:
        """Return the module that defines a structure's class."""
        if structure in self.sections:
            return self.classes
        return self.protocol if structure in self.derived else self.modules[structure]


class References:
    """The names of all classes that a module mentions.

    `own` are the structures that it defines, `others` those of other packages that their fields
    name. `direct` are imported with the module; `implied` are others of fields that ROS 2 adds,
    imported when they are used, so that each part of a protocol needs only what it holds.
    """

    def __init__(
        self,
        interface: ir.Interface,
        structures: Iterable[ir.Message],
        messages: wire_plan.Messages,
        homes: Homes,
    ) -> None:
        self._homes = homes
        self.package = interface.name.package
        self.kind = interface.name.kind
        self.own = {message.name for message in structures}
        named = {name for message in structures for name in message.references} - self.own
        self.others = {name for name in named if name.package != self.package}
        self.implied = self.others if self.own & homes.derived else set()
        self.direct = named - self.implied
        groups = {interface.name, *(service.name for service in derive.services(interface))}
        self._names = self._named(self.own | groups, _closure(self.own, messages))

    def _named(
        self, own: set[ir.TypeName], others: set[ir.TypeName]
    ) -> dict[ir.TypeName, pynames.ClassName]:
        """Return each structure's class; those that the module defines keep their plain name.

        Others get another one if something else has it: an exception of Python, for example.
        """
        by_class: dict[str, list[ir.TypeName]] = defaultdict(list)
        for name in own | others:
            by_class[pynames.class_(name)].append(name)
        return {
            name: pynames.class_(name)
            if name in own or (len(same) == 1 and not hasattr(builtins, class_))
            else pynames.qualified_class(name)
            for class_, same in by_class.items()
            for name in same
        }

    def name(self, type_: ir.TypeName) -> pynames.ClassName:
        """Return the class's name in this module."""
        return self._names[type_]

    def annotation(self, type_: ir.TypeName) -> str:
        """Return the class as annotations and constructors name it."""
        if type_ in self.implied:
            return f"{_module(type_)}.{pynames.class_(type_)}"
        return self.name(type_)

    def modules(self) -> list[tuple[str, str]]:
        """Return the modules of implied types, with their names in this module."""
        return sorted({(self._outside(type_), _module(type_)) for type_ in self.implied})

    def _outside(self, type_: ir.TypeName) -> str:
        return f"{self._homes.around}{type_.package}.{type_.kind}"

    def imports(self, types: Iterable[ir.TypeName], indent: int = 0) -> tuple[list[str], list[str]]:
        """Return import statements, those of this package and those of others, sorted.

        Those of others are indented by four more columns.
        """
        inside: dict[tuple[int, str], set[str]] = defaultdict(set)
        outside: dict[str, set[str]] = defaultdict(set)
        for type_ in types:
            name: str = pynames.class_(type_)
            if self.name(type_) != name:
                name = f"{name} as {self.name(type_)}"
            if type_.package != self.package:
                outside[self._outside(type_)].add(name)
            elif type_.kind == self.kind:
                inside[1, f".{self._homes.of(type_)}"].add(name)
            else:
                inside[0, f"..{type_.kind}.{self._homes.of(type_)}"].add(name)
        return (
            [
                line
                for (_, module), names in sorted(inside.items())
                for line in statements(module, names, indent)
            ],
            [
                line
                for module, names in sorted(outside.items())
                for line in statements(module, names, indent + 4)
            ],
        )


def _module(type_: ir.TypeName) -> str:
    return f"_{type_.package}_{type_.kind}"


def _closure(own: set[ir.TypeName], messages: wire_plan.Messages) -> set[ir.TypeName]:
    found: set[ir.TypeName] = set()
    waiting = list(own)
    while waiting:
        for name in messages[waiting.pop()].references:
            if name not in found:
                found.add(name)
                waiting.append(name)
    return found
