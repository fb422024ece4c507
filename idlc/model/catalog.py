"""ROS 2 Jazzy's standard interfaces, built in, so that a machine without ROS compiles them too.

`catalog.json` holds names, types, defaults and constants, no comments; it is turned into
interface text, so that there is one way from text to meaning.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec

from idlc.diagnostics.source import Source
from idlc.model import ir


@lru_cache(maxsize=1)
def _entries() -> dict[str, msgspec.Raw]:
    data = Path(__file__).with_name("catalog.json").read_bytes()
    return msgspec.json.decode(data, type=dict[str, msgspec.Raw])


@lru_cache(maxsize=1)
def _messages() -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for key in _entries():
        name = ir.TypeName.parse(key)
        messages = found.setdefault(name.package, [])
        if name.kind == "msg":
            messages.append(name.name)
    return found


def interfaces() -> tuple[ir.TypeName, ...]:
    """Return the names of all interfaces in the catalogue, sorted."""
    return tuple(map(ir.TypeName.parse, _entries()))


def source(name: ir.TypeName) -> Source | None:
    """Return the text of an interface, or `None` if the catalogue does not have it."""
    entry = _entries().get(str(name))
    if entry is None:
        return None
    sections = msgspec.json.decode(entry, type=list[dict[str, list[list[Any]]]])
    text = "---\n".join(_section(section) for section in sections)
    return Source(f"<catalogue>/{name}.{name.kind}", text)


def names(package: str) -> Iterable[str]:
    """Return the names of a package's messages."""
    return _messages().get(package, ())


def packages() -> Iterable[str]:
    """Return the names of the packages."""
    return _messages()


def nearby(_: str) -> str | None:
    """Return `None`: what is not built in is not near either."""
    return None


def _section(section: dict[str, list[list[Any]]]) -> str:
    constants = [f"{type_} {name}={_literal(v)}" for type_, name, v in section["constants"]]
    fields = [
        " ".join((type_, name, *map(_literal, default)))
        for type_, name, *default in section["fields"]
    ]
    return "".join(f"{line}\n" for line in (*constants, *fields))


def _literal(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_literal, value))}]"
    return str(value)
