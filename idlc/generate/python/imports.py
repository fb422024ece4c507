"""Import statements, sorted as linters want them."""

from __future__ import annotations

import builtins
import re
from collections import defaultdict
from collections.abc import Collection, Iterable
from typing import NamedTuple

import msgspec

from idlc.model import derive, ir, link, python_names
from idlc.project.templates import Code, Text
from idlc.wire import plan


def natural(name: str) -> list[tuple[int, str]]:
    """Return a key that sorts numbers in names by their value."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


def _order(name: str) -> tuple[bool, list[tuple[int, str]]]:
    is_constant = name.isupper() and len(name) > 1  # as linters see it
    return not is_constant, natural(name)


def statements(module: str, names: Collection[str], indent: int = 0) -> list[str]:
    """Return the lines that import names from a module; `X as Y` has a statement of its own."""
    statements = [(name,) for name in names if " as " in name]
    plain = sorted((name for name in names if " as " not in name), key=_order)
    ordered = sorted([*statements, *([tuple(plain)] if plain else [])])
    return [line for group in ordered for line in _import_from(module, group, " " * indent)]


def _import_from(module: str, names: tuple[str, ...], margin: str) -> list[str]:
    if len(names) == 1:
        return [f"{margin}from {module} import {names[0]}"]
    items = (f"{margin}    {name}," for name in names)
    return [f"{margin}from {module} import (", *items, f"{margin})"]


#: Classes of Python that generated modules name.
_TAKEN = {*dir(builtins), "Any"}


class Surroundings(NamedTuple):
    """The position of what a generated package imports from outside of itself.

    `runtime` is the folder of the runtime, relative to modules of messages. `others` is the prefix
    of other packages' names; one that begins with a dot is relative to the generated package.
    """

    runtime: str = ".."
    others: str = ""

    @property
    def vendors(self) -> bool:
        """True if the types of other packages come with this one."""
        return self.others.startswith(".")

    def module(self, type_: ir.TypeName) -> str:
        """Return the module of another package's type, as modules of messages import it."""
        dot = "." if self.vendors else ""
        return f"{dot}{self.others}{type_.package}.{type_.kind}"


#: A package whose dependencies are on the path.
ALONE = Surroundings()
#: A package that comes with the types that it uses.
VENDORING = Surroundings(others=".vendor.")
#: One of those that come with another package.
VENDORED = Surroundings(runtime="....", others="...vendor.")


class Homes:
    """The module of each structure of a package, without the package and the kind."""

    def __init__(
        self,
        interface: ir.Interface,
        modules: python_names.Modules,
        surroundings: Surroundings = ALONE,
    ) -> None:
        self.modules = modules
        self.surroundings = surroundings
        self.classes = modules[interface.name]
        self.protocol = python_names.protocol_module(self.classes)
        self.sections = {message.name for message in derive.sections(interface)}
        self.derived = {message.name for message in derive.messages(interface)} - self.sections

    def of(self, structure: ir.TypeName) -> python_names.ModuleName:
        """Return the module that defines a structure's class."""
        if structure in self.sections:
            return self.classes
        return self.protocol if structure in self.derived else self.modules[structure]


class References:
    """The names of all classes that a module mentions.

    `own` are the structures that it defines, `others` are in fields and of other packages.
    `direct` are imported with the module; `implied` are others in fields that ROS 2 adds, imported
    when they are used, so that each part of a protocol needs only its own types.
    """

    def __init__(
        self,
        interface: ir.Interface,
        structures: Iterable[ir.Message],
        messages: plan.Messages,
        homes: Homes,
    ) -> None:
        self._homes = homes
        self.surroundings = homes.surroundings
        self.package = interface.name.package
        self.kind = interface.name.kind
        self.own = {message.name for message in structures}
        named = {name for message in structures for name in message.references} - self.own
        self.others = {name for name in named if name.package != self.package}
        is_added = bool(self.own & homes.derived) and not self.surroundings.vendors
        self.implied = self.others if is_added else set()
        self.direct = named - self.implied
        groups = {interface.name, *(service.name for service in derive.services(interface))}
        self._names = self._named(self.own | groups, _closure(self.own, messages))

    def _named(
        self, own: set[ir.TypeName], others: set[ir.TypeName]
    ) -> dict[ir.TypeName, python_names.ClassName]:
        """Return each structure's class; classes that the module defines keep their plain name.

        Others get another name if theirs is taken: by an exception of Python, for example.
        """
        by_class: dict[str, list[ir.TypeName]] = defaultdict(list)
        for name in own | others:
            by_class[python_names.class_(name)].append(name)
        return {
            name: python_names.class_(name)
            if name in own or (len(same) == 1 and class_ not in _TAKEN)
            else python_names.qualified_class(name)
            for class_, same in by_class.items()
            for name in same
        }

    def name(self, type_: ir.TypeName) -> python_names.ClassName:
        """Return the class's name in this module."""
        return self._names[type_]

    def annotation(self, type_: ir.TypeName) -> str:
        """Return the class as annotations and constructors name it."""
        if type_ in self.implied:
            return f"{_module(type_)}.{python_names.class_(type_)}"
        return self.name(type_)

    def knows(self, element: ir.Element) -> bool:
        """Return whether the class of an element is imported with the module."""
        return not (isinstance(element, ir.Ref) and element.target in self.implied)

    def modules(self) -> list[tuple[str, str]]:
        """Return the modules of implied types, with their names in this module."""
        pairs = {(self.surroundings.module(type_), _module(type_)) for type_ in self.implied}
        return sorted(pairs)

    def imports(self, types: Iterable[ir.TypeName], indent: int = 0) -> tuple[list[str], list[str]]:
        """Return import statements of what comes with this package, and of what may be missing.

        Both are sorted; the second are indented by four more columns.
        """
        inside: dict[str, set[str]] = defaultdict(set)
        outside: dict[str, set[str]] = defaultdict(set)
        for type_ in types:
            name: str = python_names.class_(type_)
            if self.name(type_) != name:
                name = f"{name} as {self.name(type_)}"
            if type_.package != self.package:
                group = inside if self.surroundings.vendors else outside
                group[self.surroundings.module(type_)].add(name)
            elif type_.kind == self.kind:
                inside[f".{self._homes.of(type_)}"].add(name)
            else:
                inside[f"..{type_.kind}.{self._homes.of(type_)}"].add(name)
        return (
            [
                line
                for module, names in sorted(inside.items(), key=_nearness)
                for line in statements(module, names, indent)
            ],
            [
                line
                for module, names in sorted(outside.items())
                for line in statements(module, names, indent + 4)
            ],
        )


def _nearness(statement: tuple[str, set[str]]) -> tuple[int, str]:
    module, _ = statement
    return len(module.lstrip(".")) - len(module), module


def _module(type_: ir.TypeName) -> str:
    return f"_{type_.package}_{type_.kind}"


def _closure(own: set[ir.TypeName], messages: plan.Messages) -> set[ir.TypeName]:
    closure: set[ir.TypeName] = set()
    waiting = list(own)
    while waiting:
        for name in messages[waiting.pop()].references:
            if name not in closure:
                closure.add(name)
                waiting.append(name)
    return closure


TITLES: dict[ir.Kind, str] = {"msg": "Messages", "srv": "Services", "action": "Actions"}


class NameView(msgspec.Struct, frozen=True):
    """A class, and the module that it is in."""

    name: Code
    module: Code


class PackageView(msgspec.Struct, frozen=True):
    """A package that imports its modules when a name is asked for."""

    title: Text
    runtime: Code
    imports: tuple[Code, ...]
    names: tuple[NameView, ...]


def exported(interface: ir.Interface, modules: python_names.Modules) -> dict[str, str]:
    """Return the names that an interface's modules offer, with their modules."""
    homes = Homes(interface, modules)
    names: dict[str, str] = {
        python_names.class_(message.name): homes.of(message.name)
        for message in derive.messages(interface)
    }
    for service in derive.services(interface):
        names[python_names.class_(service.name)] = homes.protocol
    names[python_names.class_(interface.name)] = homes.classes
    return names


def package(
    model: link.Model,
    kind: ir.Kind,
    modules: python_names.Modules,
    surroundings: Surroundings = ALONE,
) -> PackageView:
    """Return the view of one kind's package."""
    homes: dict[str, str] = {}
    for interface in model.own:
        if interface.name.kind == kind:
            homes |= exported(interface, modules)
    by_module: dict[str, list[str]] = defaultdict(list)
    for name, module in homes.items():
        by_module[module].append(name)
    return PackageView(
        title=Text(f"{TITLES[kind]} of {model.package}, imported when they are asked for."),
        runtime=Code(surroundings.runtime),
        imports=tuple(
            Code(line)
            for module in sorted(by_module, key=natural)
            for line in statements(f".{module}", by_module[module], 4)
        ),
        names=tuple(NameView(Code(name), Code(homes[name])) for name in sorted(homes, key=natural)),
    )
