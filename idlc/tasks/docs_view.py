"""The input of the pages' templates: texts and flags, in the order in which they are shown.

Texts are as the user wrote them; the templates' environment escapes every text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from idlc.model import derive, ir
from idlc.model.comments import deprecation
from idlc.model.enums import enums
from idlc.model.ir import is_range, spell, spell_value
from idlc.model.link import Model

_HEIGHT = 30
_GAP = 12
_CHARACTER = 7.3
_BETWEEN = 70
#: More neighbours than these make a picture unreadable.
_MOST = 14


class Box(NamedTuple):
    """An interface; a click leads to `page`, empty for the page itself and without a page."""

    x: str
    y: str
    width: str
    height: str
    middle: str
    baseline: str
    text: str
    own: bool
    page: str


class Picture(NamedTuple):
    """A drawing; `lines` are curves in SVG's syntax."""

    label: str
    width: str
    height: str
    lines: Sequence[str]
    boxes: Sequence[Box]


def picture(
    name: ir.TypeName,
    users: Iterable[ir.TypeName],
    used: Iterable[ir.TypeName],
    pages: Mapping[ir.TypeName, str],
) -> Picture | None:
    """Return the picture of an interface, `None` without neighbours."""
    columns = (sorted(users), [name], sorted(used))
    if not columns[0] and not columns[2]:
        return None
    most = max(min(len(names), _MOST + 1) for names in columns)
    height = most * (_HEIGHT + _GAP) + _GAP
    middle = height / 2
    lines: list[str] = []
    boxes: list[Box] = []
    start = end = 1.0
    for column, names in enumerate(columns):
        if not names:
            continue
        nodes: list[tuple[ir.TypeName | None, str]] = [
            (other, spell(ir.Ref(other), name.package)) for other in names[:_MOST]
        ]
        if len(names) > _MOST:
            nodes.append((None, f"and {len(names) - _MOST} more"))
        width = max(len(text) for _, text in nodes) * _CHARACTER + 24
        before, start = end, end + (_BETWEEN if boxes else 0)
        end = start + width
        y = (height - len(nodes) * (_HEIGHT + _GAP) + _GAP) / 2 + _HEIGHT / 2
        for other, text in nodes:
            if column == 0:
                lines.append(_line((end, y), (end + _BETWEEN, middle)))
            elif column == 2:
                lines.append(_line((before, middle), (start, y)))
            box = Box(
                x=f"{start:.0f}",
                y=f"{y - _HEIGHT / 2:.0f}",
                width=f"{width:.0f}",
                height=str(_HEIGHT),
                middle=f"{start + width / 2:.0f}",
                baseline=f"{y + 4.5:.0f}",
                text=text,
                own=other == name,
                page=pages.get(other, "") if other and other != name else "",
            )
            boxes.append(box)
            y += _HEIGHT + _GAP
    label = f"what uses {name.name}, and what it uses"
    return Picture(label, f"{end + 1:.0f}", f"{height:.0f}", lines, boxes)


def _line(start: tuple[float, float], end: tuple[float, float]) -> str:
    middle = (start[0] + end[0]) / 2
    return (
        f"M{start[0]:.0f},{start[1]:.0f} C{middle:.0f},{start[1]:.0f} "
        f"{middle:.0f},{end[1]:.0f} {end[0]:.0f},{end[1]:.0f}"
    )


KINDS = {"msg": "message", "srv": "service", "action": "action"}
_SECTIONS = {"srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}

#: The pages by interface; a link from one page to another goes up one folder.
PagePaths = Mapping[ir.TypeName, str]

#: Whitespace of a drawing: at the start of a line, or repeated without punctuation before it.
_DRAWING = re.compile(r"(?m)^[ \t]|[^\s.,;:!?]([ ]{2,}|\t)\S")


class Paragraph(NamedTuple):
    """A paragraph, or a drawing, which `pre` shows unchanged."""

    tag: str
    text: str


class Link(NamedTuple):
    """The name of a type; `page` is empty if it has none."""

    page: str
    title: str
    words: Sequence[str]


class Row(NamedTuple):
    """A field or constant; its type is a link and the text after it, or only a text.

    `constants` is the anchor of the first constant that names a value of the field.
    """

    anchor: str
    constants: str
    words: Sequence[str]
    link: Link | None
    type: Sequence[str]
    unit: str
    value: str
    meaning: Sequence[Paragraph]
    is_deprecated: bool


class FieldTable(NamedTuple):
    """Rows, and flags for the columns that have text; `units` is the heading of one."""

    rows: Sequence[Row]
    units: str
    values: bool
    meanings: bool


class StructureView(NamedTuple):
    """A structure, with a title if it is one of several."""

    title: str
    about: Sequence[Paragraph]
    constants: FieldTable
    fields: FieldTable
    empty: bool


class Home(NamedTuple):
    """The page of a package and its version; empty if there is none."""

    page: str = ""
    version: str = ""


class InterfacePage(NamedTuple):
    """The page of an interface; `statement` imports its class in Python."""

    title: str
    root: str
    package: str
    home: Home
    kind: str
    what: str
    words: Sequence[str]
    sections: Sequence[StructureView]
    picture: Picture | None
    users: Sequence[Link]
    statement: str
    hash: str
    source: str


def page(
    interface: ir.Interface,
    model: Model,
    users: Iterable[ir.TypeName],
    pages: PagePaths,
    home: Home,
) -> InterfacePage:
    """Return the page of an interface; `users` are the interfaces that refer to it."""
    own = interface.name
    titles = _SECTIONS.get(own.kind, ("",))
    parts = zip(titles, derive.sections(interface), strict=True)
    return InterfacePage(
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
    """Return the pieces of a name between which a line may break."""
    return re.split(r"(?<=[_/.])|(?<=[a-z0-9])(?=[A-Z])", name)


def prefix(interface: ir.Interface, part: ir.Message) -> str:
    """Return the prefix of a part's anchors, which differs for the parts of a service or action."""
    inner = part.name.name.removeprefix(interface.name.name).strip("_")
    return inner if part.name == interface.name else f"{inner}."


def blocks(lines: Sequence[str]) -> list[Paragraph]:
    """Return comment lines as paragraphs, and as drawings where they are indented or aligned."""
    texts = re.split(r"\n\s*\n", "\n".join(lines).strip("\n"))
    return [
        Paragraph("pre" if "\n" in text and _DRAWING.search(text) else "p", text)
        for text in texts
        if text.strip()
    ]


def _link(target: ir.TypeName, text: str, pages: PagePaths) -> Link:
    return Link(pages.get(target, ""), str(target), words(text))


def _section(title: str, message: ir.Message, before: str, pages: PagePaths) -> StructureView:
    package = message.name.package
    own = (message.constants, message.fields)
    named = {
        field.name: before + next(iter(enum.members.values())).name
        for enum in enums(message, "all")
        for field in enum.fields
    }
    constants, fields = (_table(elements, package, before, pages, named) for elements in own)
    return StructureView(title, blocks(message.comment), constants, fields, not any(own))


def _table(
    elements: Sequence[ir.Field | ir.Constant],
    package: str,
    before: str,
    pages: PagePaths,
    named: Mapping[str, str],
) -> FieldTable:
    rows = []
    for element in elements:
        type_ = ir.element_of(element.type)
        written = spell(element.type, package)
        link, rest = None, words(written)
        if isinstance(type_, ir.Ref):
            text = spell(type_, package)
            link, rest = _link(type_.target, text, pages), [written.removeprefix(text)]
        unit, value = "", spell_value(element.value) if isinstance(element, ir.Constant) else ""
        if isinstance(element, ir.Field):
            unit = element.unit or ""
            value = spell_value(element.default.value) if element.default else ""
        meaning, anchor = blocks(element.comment), before + element.name
        is_deprecated = deprecation(element.comment) is not None
        name, constants = words(element.name), named.get(element.name, "")
        rows.append(Row(anchor, constants, name, link, rest, unit, value, meaning, is_deprecated))
    kinds = {"range" if is_range(row.unit) else "unit" for row in rows if row.unit}
    return FieldTable(
        rows,
        " or ".join(sorted(kinds, reverse=True)),
        any(row.value for row in rows),
        any(row.meaning for row in rows),
    )
