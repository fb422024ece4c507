"""The classes that one module needs from elsewhere: by which name, and where they are imported."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

from idlc.emit import pynames
from idlc.emit.codec import wire_plan
from idlc.model import derive, ir


class References:
    """The names of all classes that a module mentions.

    `direct` are the types of fields as written in the file, imported with the module; `implied`
    those of derived fields in other packages, imported when used, so that a service's request can
    be used without them.
    """

    def __init__(
        self, interface: ir.Interface, messages: wire_plan.Messages, modules: pynames.Modules
    ) -> None:
        self._modules = modules
        self.package = interface.name.package
        self.own = {message.name for message in derive.messages(interface)}
        written = {message.name for message in derive.sections(interface)}
        self.direct: set[ir.TypeName] = set()
        self.implied: set[ir.TypeName] = set()
        for message in derive.messages(interface):
            for name in referred(message):
                if name in self.own:
                    continue
                if message.name in written or name.package == self.package:
                    self.direct.add(name)
                else:
                    self.implied.add(name)
        self.implied -= self.direct
        groups = {interface.name, *(service.name for service in derive.services(interface))}
        self._names = self._named(self.own | groups, _closure(self.own, messages))

    def _named(
        self, own: set[ir.TypeName], others: set[ir.TypeName]
    ) -> dict[ir.TypeName, pynames.ClassName]:
        """Return each structure's class; those that the module defines keep their plain name."""
        by_class: dict[str, list[ir.TypeName]] = defaultdict(list)
        for name in own | others:
            by_class[pynames.class_(name)].append(name)
        return {
            name: pynames.class_(name)
            if name in own or len(same) == 1
            else pynames.qualified_class(name)
            for same in by_class.values()
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
        return sorted({(f"{type_.package}.{type_.kind}", _module(type_)) for type_ in self.implied})

    def imports(self, types: Iterable[ir.TypeName], kind: ir.Kind) -> tuple[list[str], list[str]]:
        """Return import statements, those of this package and those of others, sorted."""
        inside: set[tuple[int, str, str]] = set()
        outside: dict[str, set[str]] = defaultdict(set)
        for type_ in types:
            target = pynames.class_(type_)
            if self.name(type_) != target:
                target = pynames.ClassName(f"{target} as {self.name(type_)}")
            if type_.package != self.package:
                outside[f"{type_.package}.{type_.kind}"].add(target)
            elif type_.kind == kind:
                inside.add((1, f".{self._modules[type_]}", target))
            else:
                inside.add((0, f"..{type_.kind}.{self._modules[type_]}", target))
        return (
            [f"from {module} import {target}" for _, module, target in sorted(inside)],
            [
                f"from {module} import {', '.join(sorted(targets))}"
                for module, targets in sorted(outside.items())
            ],
        )


def _module(type_: ir.TypeName) -> str:
    return f"_{type_.package}_{type_.kind}"


def referred(message: ir.Message) -> list[ir.TypeName]:
    """Return the structures that a structure's fields name, in order."""
    elements = (ir.element_of(field.type) for field in message.fields)
    return [element.target for element in elements if isinstance(element, ir.Ref)]


def _closure(own: set[ir.TypeName], messages: wire_plan.Messages) -> set[ir.TypeName]:
    found: set[ir.TypeName] = set()
    waiting = list(own)
    while waiting:
        for name in referred(messages[waiting.pop()]):
            if name not in found:
                found.add(name)
                waiting.append(name)
    return found


def wrapped(statements: list[str]) -> list[str]:
    """Break import statements that are too long inside a block."""
    result = []
    for statement in statements:
        head, _, names = statement.partition(" import ")
        if len(statement) + 8 <= 88:
            result.append(statement)
        else:
            result += [f"{head} import (", *(f"    {n}," for n in names.split(", ")), ")"]
    return result
