"""ROS 2's standard interfaces, built in, so that a machine without ROS compiles them too.

`catalog.json` holds the interfaces that are equal in all distributions, `catalog_differences.json`
the others; `catalog.md` documents their origin. They are names, types, defaults and constants, no
comments, and are turned into interface text, so that there is one way from text to meaning.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec

from idlc.diagnostics.source import Source
from idlc.model import ir
from idlc.model.distros import DEFAULT, DISTROS, NEWEST, Distro, later

#: The distribution of functions that get none as an argument.
distro = DEFAULT


@lru_cache(maxsize=1)
def _common() -> dict[str, msgspec.Raw]:
    data = Path(__file__).with_name("catalog.json").read_bytes()
    return msgspec.json.decode(data, type=dict[str, msgspec.Raw])


@lru_cache(maxsize=1)
def _differences() -> dict[str, dict[str, msgspec.Raw]]:
    """Return definitions by name, and by the names of the distributions that have them."""
    data = Path(__file__).with_name("catalog_differences.json").read_bytes()
    return msgspec.json.decode(data, type=dict[str, dict[str, msgspec.Raw]])


@lru_cache
def _entries(of: Distro) -> dict[str, msgspec.Raw]:
    own = {
        name: definition
        for name, variants in _differences().items()
        for distros, definition in variants.items()
        if of.name in distros.split()
    }
    return dict(sorted({**_common(), **own}.items()))


@lru_cache
def _messages(of: Distro) -> dict[str, list[str]]:
    by_package: dict[str, list[str]] = {}
    for key in _entries(of):
        name = ir.TypeName.parse(key)
        messages = by_package.setdefault(name.package, [])
        if name.kind == "msg":
            messages.append(name.name)
    return by_package


def interfaces(of: Distro = DEFAULT) -> tuple[ir.TypeName, ...]:
    """Return the names of all interfaces of a distribution, sorted."""
    return tuple(map(ir.TypeName.parse, _entries(of)))


def source(name: ir.TypeName, of: Distro = DEFAULT) -> Source | None:
    """Return the text of an interface, or `None` if the distribution does not have it."""
    sections = _sections(str(name), of)
    if sections is None:
        return None
    text = "---\n".join(_section(section) for section in sections)
    return Source(f"<{of.name}>/{name}.{name.kind}", text)


def names(package: str, of: Distro = DEFAULT) -> Iterable[str]:
    """Return the names of a package's messages."""
    return _messages(of).get(package, ())


def packages(of: Distro = DEFAULT) -> Iterable[str]:
    """Return the names of the packages."""
    return _messages(of)


def nearby(_: str) -> str | None:
    """Return `None`: the catalogue has no folders to suggest."""
    return None


def idl_file(_: ir.TypeName) -> str | None:
    """Return `None`: ROS 2 defines the standard messages in .msg files."""
    return None


def is_standard(package: str) -> bool:
    """Return whether a package is one of any distribution's."""
    return package in _packages_of_any()


@lru_cache(maxsize=1)
def _packages_of_any() -> frozenset[str]:
    return frozenset(key.partition("/")[0] for key in (*_common(), *_differences()))


def holding(name: ir.TypeName) -> tuple[Distro, ...]:
    """Return the distributions that have an interface."""
    return tuple(other for other in DISTROS if str(name) in _entries(other))


def removed(name: ir.TypeName, of: Distro) -> Distro | None:
    """Return the distribution since which an interface of an earlier one is gone."""
    holders = holding(name) if str(name) in _differences() else ()
    if of not in holders or NEWEST in holders:
        return None
    return later(holders[-1])[0]


def changed(name: ir.TypeName, of: Distro) -> Distro | None:
    """Return the first later distribution in which a message has another layout in bytes."""
    own = _layout(str(name), of)
    layouts = ((other, _layout(str(name), other)) for other in later(of))
    return next((other for other, layout in layouts if own and layout and layout != own), None)


def _sections(key: str, of: Distro) -> list[dict[str, list[list[Any]]]] | None:
    entry = _entries(of).get(key)
    if entry is None:
        return None
    return msgspec.json.decode(entry, type=list[dict[str, list[list[Any]]]])


@lru_cache(maxsize=1024)
def _layout(key: str, of: Distro) -> tuple[Hashable, ...]:
    """Return the fields of a message, nested ones included; empty if there is no such message."""
    return tuple(
        # of a type such as `std_msgs/Header[3]`, the layout of the message
        (type_, name, _layout(re.sub(r"/(\w+).*", r"/msg/\1", type_), of) if "/" in type_ else ())
        for section in _sections(key, of) or ()
        for type_, name, *_ in section["fields"]
    )


def _section(section: dict[str, list[list[Any]]]) -> str:
    constants = [f"{type_} {name}={_literal(v)}" for type_, name, v in section["constants"]]
    fields = [
        " ".join((type_, name, *map(_literal, default)))
        for type_, name, *default in section["fields"]
    ]
    return "".join(f"{line}\n" for line in (*constants, *fields))


def _literal(value: Any) -> str:
    if isinstance(value, list):
        texts = (f'"{item}"' if isinstance(item, str) else str(item) for item in value)
        return f"[{', '.join(texts)}]"
    return str(value)
