"""The title page: every package with what its package.xml says, and its interfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from idlc.model import derive, ir
from idlc.site.view import KINDS, Block, Pages, blocks, words


class About(NamedTuple):
    """What a package's package.xml says of it."""

    version: str = ""
    description: str = ""
    maintainers: tuple[str, ...] = ()
    licenses: tuple[str, ...] = ()


class Entry(NamedTuple):
    """An interface in the list of its package."""

    page: str
    words: Sequence[str]
    kind: str
    what: str
    about: str


class PackageEntry(NamedTuple):
    """A package; `described` is whether any of its interfaces says what it is for."""

    words: Sequence[str]
    description: Sequence[Block]
    facts: str
    described: bool
    entries: Sequence[Entry]


class Front(NamedTuple):
    """The title page; `heading` is the element of a package's name."""

    title: str
    root: str
    several: bool
    heading: str
    packages: Sequence[PackageEntry]


def front(interfaces: Sequence[ir.Interface], pages: Pages, about: Mapping[str, About]) -> Front:
    """Return the title page of interfaces; `about` tells of packages by name."""
    names = sorted({one.name.package for one in interfaces})
    several = len(names) > 1
    return Front(
        title="Interfaces" if several else names[0],
        root="",
        several=several,
        heading="h2" if several else "h1",
        packages=[
            _package(
                name,
                about.get(name, About()),
                [_entry(one, pages) for one in interfaces if one.name.package == name],
            )
            for name in names
        ],
    )


def _package(name: str, about: About, entries: Sequence[Entry]) -> PackageEntry:
    return PackageEntry(
        words(name),
        blocks(about.description.split("\n")),
        _facts(about),
        any(entry.about for entry in entries),
        entries,
    )


def _entry(interface: ir.Interface, pages: Pages) -> Entry:
    name = interface.name
    about = first_line(interface)
    return Entry(pages[name], words(name.name), name.kind, KINDS[name.kind], about)


def _facts(about: About) -> str:
    listed = (
        ("version", (about.version,)),
        ("maintained by", about.maintainers),
        ("licence", about.licenses),
    )
    return " · ".join(f"{label} {', '.join(values)}" for label, values in listed if any(values))


def first_line(interface: ir.Interface) -> str:
    """Return the first line that says what an interface is for."""
    lines = (line for part in derive.sections(interface) for line in part.comment)
    return next((line for line in lines if line.strip()), "")
