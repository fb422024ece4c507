"""The pages that list: of a package, with what its package.xml says, and of several packages."""

from __future__ import annotations

from collections import Counter
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


class PackagePage(NamedTuple):
    """The page of a package; `described` is whether any interface says what it is for."""

    title: str
    root: str
    words: Sequence[str]
    description: Sequence[Block]
    facts: str
    described: bool
    entries: Sequence[Entry]


class Row(NamedTuple):
    """A package in the list of packages."""

    page: str
    words: Sequence[str]
    facts: str
    about: str


class Front(NamedTuple):
    """The title page of several packages."""

    title: str
    root: str
    rows: Sequence[Row]


def homes(names: Sequence[str]) -> dict[str, str]:
    """Return the page of each package; that of a single one is the title page."""
    return {name: f"{name}/index.html" if len(names) > 1 else "index.html" for name in names}


def package_page(
    name: str, home: str, about: About, interfaces: Sequence[ir.Interface], pages: Pages
) -> PackagePage:
    """Return the page of a package, which is `home`."""
    entries = [_entry(one, pages) for one in interfaces]
    return PackagePage(
        title=name,
        root="../" * home.count("/"),
        words=words(name),
        description=blocks(about.description.split("\n")),
        facts=" · ".join([*_facts(about), counted(interfaces)]),
        described=any(entry.about for entry in entries),
        entries=entries,
    )


def front(
    packages: Mapping[str, Sequence[ir.Interface]],
    pages: Mapping[str, str],
    about: Mapping[str, About],
) -> Front:
    """Return the title page of packages, whose own pages are `pages`."""
    rows = []
    for name, interfaces in packages.items():
        own = about.get(name, About())
        version = [f"version {own.version}"] if own.version else []
        facts = " · ".join([*version, counted(interfaces)])
        rows.append(Row(pages[name], words(name), facts, own.description))
    return Front("Interfaces", "", rows)


def counted(interfaces: Sequence[ir.Interface]) -> str:
    """Return how many interfaces of each kind there are, in words."""
    kinds: Counter[str] = Counter(one.name.kind for one in interfaces)
    return ", ".join(
        f"{kinds[kind]} {word}{'s' * (kinds[kind] > 1)}"
        for kind, word in KINDS.items()
        if kinds[kind]
    )


def _entry(interface: ir.Interface, pages: Pages) -> Entry:
    name = interface.name
    about = first_line(interface)
    return Entry(pages[name], words(name.name), name.kind, KINDS[name.kind], about)


def _facts(about: About) -> list[str]:
    listed = (
        ("version", (about.version,)),
        ("maintained by", about.maintainers),
        ("licence", about.licenses),
    )
    return [f"{label} {', '.join(values)}" for label, values in listed if any(values)]


def first_line(interface: ir.Interface) -> str:
    """Return the first line that says what an interface is for."""
    lines = (line for part in derive.sections(interface) for line in part.comment)
    return next((line for line in lines if line.strip()), "")
