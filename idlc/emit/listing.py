"""The view of `msg/__init__.py` and its siblings: what they export, and from where."""

from __future__ import annotations

import msgspec

from idlc.emit import pynames
from idlc.emit.python_lines import Group, lines
from idlc.model import derive, ir, link

TITLES: dict[ir.Kind, str] = {"msg": "Messages", "srv": "Services", "action": "Actions"}


class PackageView(msgspec.Struct, frozen=True):
    """A package that imports its modules when a name is asked for. All lines are finished."""

    path: str
    summary: str
    imports: tuple[str, ...]
    exports: tuple[str, ...]
    modules: tuple[str, ...]


def exported(interface: ir.Interface) -> list[str]:
    """Return the names that an interface's module offers."""
    names = [pynames.class_(message.name) for message in derive.messages(interface)]
    if not isinstance(interface, ir.Message):
        names += [pynames.class_(service.name) for service in derive.services(interface)]
        names.append(pynames.class_(interface.name))
    return sorted(set(names))


def _order(item: tuple[str, object]) -> list[tuple[int, str]]:
    return pynames.natural(item[0])


def package(model: link.Model, kind: ir.Kind, modules: pynames.Modules) -> PackageView:
    """Return the view of one kind's package."""
    found = {
        name: str(modules[interface.name])
        for interface in model.own
        if interface.name.kind == kind
        for name in exported(interface)
    }
    imports: list[str] = []
    by_module: dict[str, list[str]] = {}
    for name, module in sorted(found.items(), key=_order):
        by_module.setdefault(module, []).append(name)
    for module, names in sorted(by_module.items(), key=_order):
        one = f"    from .{module} import {', '.join(names)}"
        if len(one) <= 88:
            imports.append(one)
        else:
            imports += [f"    from .{module} import (", *(f"        {n}," for n in names), "    )"]
    quoted = tuple(f'"{name}"' for name in sorted(found, key=pynames.natural))
    pairs = tuple(f'"{name}": "{module}"' for name, module in sorted(found.items(), key=_order))
    return PackageView(
        path=f"{kind}/__init__.py",
        summary=f"{TITLES[kind]} of {model.package}, imported when they are asked for.",
        imports=tuple(imports),
        exports=tuple(lines(Group("", quoted, brackets="[]"), 0, "__all__ = ")),
        modules=tuple(lines(Group("", pairs, brackets="{}"), 0, "_MODULES = ")),
    )
