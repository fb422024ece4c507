"""What the pages' templates are given: texts and flags, in the order in which they are shown.

Texts are as the user wrote them; the templates' environment escapes all that it places.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.model.spelling import is_range, spell, spell_value
from idlc.site.picture import Picture, picture

KINDS = {"msg": "message", "srv": "service", "action": "action"}
_SECTIONS = {"srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}

#: The pages by interface; a link from one page to another goes up one folder.
Pages = Mapping[ir.TypeName, str]

#: Blanks that draw something: at the start of a line, or several that no punctuation explains.
_DRAWING = re.compile(r"(?m)^[ \t]|[^\s.,;:!?]([ ]{2,}|\t)\S")


class Block(NamedTuple):
    """A paragraph, or something drawn, which `pre` shows as it stands."""

    tag: str
    text: str


class Link(NamedTuple):
    """The name of a type; `page` is empty if it has none."""

    page: str
    title: str
    words: Sequence[str]


class Row(NamedTuple):
    """A field or constant; its type is a link and what comes after it, or only the latter."""

    anchor: str
    words: Sequence[str]
    link: Link | None
    type: Sequence[str]
    unit: str
    value: str
    meaning: Sequence[Block]


class Table(NamedTuple):
    """Rows, and which of the columns that may be empty are not; `units` is the heading of one."""

    rows: Sequence[Row]
    units: str
    values: bool
    meanings: bool


class Section(NamedTuple):
    """A structure, with a title if it is one of several."""

    title: str
    about: Sequence[Block]
    constants: Table
    fields: Table
    empty: bool


class Home(NamedTuple):
    """The page of a package and its version; empty what it has not."""

    page: str = ""
    version: str = ""


class Page(NamedTuple):
    """The page of an interface; `statement` imports its class in Python."""

    title: str
    root: str
    package: str
    home: Home
    kind: str
    what: str
    words: Sequence[str]
    sections: Sequence[Section]
    picture: Picture | None
    users: Sequence[Link]
    statement: str
    hash: str
    source: str


def page(
    interface: ir.Interface, model: Model, users: Iterable[ir.TypeName], pages: Pages, home: Home
) -> Page:
    """Return the page of an interface; `users` are the interfaces that refer to it."""
    own = interface.name
    titles = _SECTIONS.get(own.kind, ("",))
    parts = zip(titles, derive.sections(interface), strict=True)
    return Page(
        title=str(own),
        root="../",
        package=own.package,
        home=home,
        kind=own.kind,
        what=KINDS[own.kind],
        words=words(own.name),
        sections=[_section(title, part, prefix(interface, part), pages) for title, part in parts],
        picture=picture(own, users, derive.references(interface), pages),
        users=[_link(user, str(user), pages) for user in sorted(users)],
        statement=f"from {own.package}.{own.kind} import {own.name}",
        hash=model.describer.hash(str(own)) if model.distro.has_hashes else "",
        source="\n".join(interface.source.text.splitlines()) if interface.source else "",
    )


def words(name: str) -> list[str]:
    """Return the pieces of a name between which it may break."""
    return re.split(r"(?<=[_/.])|(?<=[a-z0-9])(?=[A-Z])", name)


def prefix(interface: ir.Interface, part: ir.Message) -> str:
    """Return what tells the anchors of a service's or action's parts from each other."""
    return part.name.name.removeprefix(interface.name.name).strip("_") + "." * (
        part.name != interface.name
    )


def blocks(lines: Sequence[str]) -> list[Block]:
    """Return comment lines: paragraphs, and what is indented or drawn as it stands."""
    texts = re.split(r"\n\s*\n", "\n".join(lines).strip("\n"))
    return [Block(_tag(text), text) for text in texts if text.strip()]


def _tag(text: str) -> str:
    return "pre" if "\n" in text and _DRAWING.search(text) else "p"


def _link(target: ir.TypeName, text: str, pages: Pages) -> Link:
    return Link(pages.get(target, ""), str(target), words(text))


def _section(title: str, message: ir.Message, before: str, pages: Pages) -> Section:
    constants = [
        Row(
            before + one.name,
            words(one.name),
            None,
            [spell(one.type)],
            "",
            spell_value(one.value),
            blocks(one.comment),
        )
        for one in message.constants
    ]
    fields = [_field(one, message.name.package, before, pages) for one in message.fields]
    empty = not (constants or fields)
    return Section(title, blocks(message.comment), _table(constants), _table(fields), empty)


def _field(field: ir.Field, package: str, before: str, pages: Pages) -> Row:
    element = ir.element_of(field.type)
    written = spell(field.type, package)
    link, rest = None, words(written)
    if isinstance(element, ir.Ref):
        text = spell(element, package)
        link, rest = _link(element.target, text, pages), [written.removeprefix(text)]
    value = spell_value(field.default.value) if field.default else ""
    return Row(
        before + field.name,
        words(field.name),
        link,
        rest,
        field.unit or "",
        value,
        blocks(field.comment),
    )


def _table(rows: Sequence[Row]) -> Table:
    kinds = {"range" if is_range(row.unit) else "unit" for row in rows if row.unit}
    return Table(
        rows,
        " or ".join(sorted(kinds, reverse=True)),
        any(row.value for row in rows),
        any(row.meaning for row in rows),
    )
