"""The view of `msg/__init__.py` and its siblings: what they export, and from where."""

from __future__ import annotations

from collections import defaultdict

import msgspec

from idlc.emit import imports, pynames
from idlc.emit.references import Homes
from idlc.model import derive, ir, link

TITLES: dict[ir.Kind, str] = {"msg": "Messages", "srv": "Services", "action": "Actions"}


class NameView(msgspec.Struct, frozen=True):
    """A class, and the module that it is in."""

    name: str
    module: str


class PackageView(msgspec.Struct, frozen=True):
    """A package that imports its modules when a name is asked for."""

    path: str
    title: str
    imports: tuple[str, ...]
    names: tuple[NameView, ...]


def exported(interface: ir.Interface, modules: pynames.Modules) -> dict[str, str]:
    """Return the names that an interface's modules offer, with their modules."""
    homes = Homes(interface, modules)
    names: dict[str, str] = {
        pynames.class_(message.name): homes.of(message.name)
        for message in derive.messages(interface)
    }
    for service in derive.services(interface):
        names[pynames.class_(service.name)] = homes.protocol
    names[pynames.class_(interface.name)] = homes.classes
    return names


def package(model: link.Model, kind: ir.Kind, modules: pynames.Modules) -> PackageView:
    """Return the view of one kind's package."""
    found: dict[str, str] = {}
    for interface in model.own:
        if interface.name.kind == kind:
            found |= exported(interface, modules)
    by_module: dict[str, list[str]] = defaultdict(list)
    for name, module in found.items():
        by_module[module].append(name)
    return PackageView(
        path=f"{kind}/__init__.py",
        title=f"{TITLES[kind]} of {model.package}, imported when they are asked for.",
        imports=tuple(
            line
            for module in sorted(by_module, key=imports.natural)
            for line in imports.statements(f".{module}", by_module[module], 4)
        ),
        names=tuple(NameView(name, found[name]) for name in sorted(found, key=imports.natural)),
    )
