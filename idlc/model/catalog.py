"""ROS 2's standard interfaces, built in, so that a machine without ROS compiles them too.

`catalog.json` holds those that are alike in all distributions, `catalog_differences.json` the
others; `catalog.md` says where they come from. They are names, types, defaults and constants, no
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

#: The distribution that is meant where a function is not told.
distro = DEFAULT

_HERE = Path(__file__)


@lru_cache(maxsize=1)
def _common() -> dict[str, msgspec.Raw]:
    data = _HERE.with_name("catalog.json").read_bytes()
    return msgspec.json.decode(data, type=dict[str, msgspec.Raw])


@lru_cache(maxsize=1)
def _differences() -> dict[str, dict[str, msgspec.Raw]]:
    """Return definitions by name, and by the names of the distributions that have them."""
    data = _HERE.with_name("catalog_differences.json").read_bytes()
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
    found: dict[str, list[str]] = {}
    for key in _entries(of):
        name = ir.TypeName.parse(key)
        messages = found.setdefault(name.package, [])
        if name.kind == "msg":
            messages.append(name.name)
    return found


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
    """Return `None`: what is not built in is not near either."""
    return None


def is_standard(package: str) -> bool:
    """Return whether a package is one of any distribution's."""
    return package in _packages_of_any()


@lru_cache(maxsize=1)
def _packages_of_any() -> frozenset[str]:
    return frozenset(key.partition("/")[0] for key in (*_common(), *_differences()))


def holding(name: ir.TypeName) -> tuple[Distro, ...]:
    """Return the distributions that have an interface."""
    return tuple(one for one in DISTROS if str(name) in _entries(one))


def removed(name: ir.TypeName, of: Distro) -> Distro | None:
    """Return the distribution since which an interface of an earlier one is gone."""
    holders = holding(name) if str(name) in _differences() else ()
    if of not in holders or NEWEST in holders:
        return None
    return later(holders[-1])[0]


def changed(name: ir.TypeName, of: Distro) -> Distro | None:
    """Return the first distribution after one in which a message has other bytes."""
    here = _layout(str(name), of)
    others = ((one, _layout(str(name), one)) for one in later(of))
    return next((one for one, layout in others if here and layout and layout != here), None)


def _sections(key: str, of: Distro) -> list[dict[str, list[list[Any]]]] | None:
    entry = _entries(of).get(key)
    if entry is None:
        return None
    return msgspec.json.decode(entry, type=list[dict[str, list[list[Any]]]])


@lru_cache(maxsize=1024)
def _layout(key: str, of: Distro) -> tuple[Hashable, ...]:
    """Return the fields of a message, with those of the messages in it; empty if not there."""
    return tuple(
        (type_, name, _layout(_target(type_), of) if "/" in type_ else ())
        for section in _sections(key, of) or ()
        for type_, name, *_ in section["fields"]
    )


def _target(type_: str) -> str:
    """Return the full name of the message that a type such as `std_msgs/Header[3]` holds."""
    return re.sub(r"(\w+)/(\w+).*", r"\1/msg/\2", type_)


def _section(section: dict[str, list[list[Any]]]) -> str:
    constants = [f"{type_} {name}={_literal(v)}" for type_, name, v in section["constants"]]
    fields = [
        " ".join((type_, name, *map(_literal, default)))
        for type_, name, *default in section["fields"]
    ]
    return "".join(f"{line}\n" for line in (*constants, *fields))


def _literal(value: Any) -> str:
    if isinstance(value, list):
        texts = (f'"{one}"' if isinstance(one, str) else str(one) for one in value)
        return f"[{', '.join(texts)}]"
    return str(value)
