"""Models → the files of a site."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from idlc.diagnostics.visible import printable
from idlc.emit.render import RenderedFile
from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.model.spelling import spell, spell_value
from idlc.site import assets
from idlc.site.html import (
    Pages,
    breakable,
    document,
    escape,
    link,
    page_of,
    prose,
    table,
    type_,
)
from idlc.site.picture import picture

_KINDS = {"msg": "message", "srv": "service", "action": "action"}
_SECTIONS = {"srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}


class About(NamedTuple):
    """What a package's package.xml says of it."""

    version: str = ""
    description: str = ""
    maintainers: tuple[str, ...] = ()
    licenses: tuple[str, ...] = ()


def site(models: Sequence[Model], about: Mapping[str, About]) -> tuple[RenderedFile, ...]:
    """Return the pages of all packages, and of what they use, with a search over all.

    `about` tells of packages by name.
    """
    known: dict[ir.TypeName, tuple[ir.Interface, Model]] = {}
    for model in models:
        for name, interface in model.interfaces.items():
            if interface.source is not None and (name not in known or interface in model.own):
                known[name] = (interface, model)
    own = {interface.name for model in models for interface in model.own}
    pages = {name: page_of(name) for name in sorted(known)}
    users = _users(interface for interface, _ in known.values())
    files = [
        RenderedFile(pages[name], _page(interface, model, users.get(name, set()), pages))
        for name, (interface, model) in sorted(known.items())
    ]
    shown = [known[name][0] for name in sorted(own)]
    return (
        RenderedFile("index.html", _front(shown, pages, about)),
        RenderedFile("index.js", f"const INDEX = {_index(shown, pages)};\n"),
        RenderedFile("search.js", assets.SEARCH),
        RenderedFile("style.css", assets.STYLE),
        *files,
    )


def _users(interfaces: Iterable[ir.Interface]) -> dict[ir.TypeName, set[ir.TypeName]]:
    found: dict[ir.TypeName, set[ir.TypeName]] = {}
    for interface in interfaces:
        for target in derive.references(interface):
            found.setdefault(target, set()).add(interface.name)
    return found


def _page(interface: ir.Interface, model: Model, users: set[ir.TypeName], pages: Pages) -> str:
    own = interface.name
    hash_ = model.describer.hash(str(own))
    parts = [
        f'<p class="path">{escape(own.package)} / {escape(own.kind)}</p>\n',
        f'<h1>{breakable(own.name)} <small class="{own.kind}">{_KINDS[own.kind]}</small></h1>\n',
    ]
    titles = _SECTIONS.get(own.kind, ("",))
    for title, section in zip(titles, derive.sections(interface), strict=True):
        parts.append(f"<h2>{title}</h2>\n" if title else "")
        parts.append(_section(section, _prefix(interface, section), pages))
    drawn = picture(own, users, derive.references(interface), pages)
    parts.append(f"<h2>Used by and using</h2>\n{drawn}" if drawn else "")
    if users:
        listed = ", ".join(link(user, str(user), pages) for user in sorted(users))
        parts.append(f'<p class="users">Used by {listed}.</p>\n')
    parts.append(f"<h2>Type hash</h2>\n<p><code>{escape(hash_)}</code></p>\n{_source(interface)}")
    return document(str(own), "../", "".join(parts))


def _source(interface: ir.Interface) -> str:
    """Return the text of the file, which is seen when one asks for it."""
    if interface.source is None:
        return ""
    text = "\n".join(interface.source.text.splitlines())
    return f"<details>\n<summary>Source</summary>\n<pre>{escape(text)}</pre>\n</details>\n"


def _prefix(interface: ir.Interface, part: ir.Message) -> str:
    """Return what tells the anchors of a service's or action's parts from each other."""
    return part.name.name.removeprefix(interface.name.name).strip("_") + "." * (
        part.name != interface.name
    )


def _named(own: str, prefix: str) -> str:
    return f'<code id="{escape(prefix + own)}">{breakable(own)}</code>'


def _section(message: ir.Message, prefix: str, pages: Pages) -> str:
    package = message.name.package
    constants = table(
        (("name", "constant"), ("type", "type"), ("value", "value"), ("meaning", "meaning")),
        (
            (
                _named(one.name, prefix),
                escape(spell(one.type)),
                f"<code>{escape(spell_value(one.value))}</code>",
                prose(one.comment),
            )
            for one in message.constants
        ),
    )
    fields = table(
        (
            ("name", "field"),
            ("type", "type"),
            ("unit", "unit"),
            ("value", "default"),
            ("meaning", "meaning"),
        ),
        (
            (
                _named(one.name, prefix),
                type_(one.type, package, pages),
                f"<span>{escape(one.unit)}</span>" if one.unit else "",
                f"<code>{escape(spell_value(one.default.value))}</code>" if one.default else "",
                prose(one.comment),
            )
            for one in message.fields
        ),
    )
    empty = "" if constants or fields else '<p class="empty">Empty.</p>\n'
    return f"{prose(message.comment)}{constants}{fields}{empty}"


def _first(interface: ir.Interface) -> str:
    lines = [line for part in derive.sections(interface) for line in part.comment if line.strip()]
    return lines[0] if lines else ""


def _front(interfaces: Sequence[ir.Interface], pages: Pages, about: Mapping[str, About]) -> str:
    packages = sorted({one.name.package for one in interfaces})
    single = len(packages) == 1
    parts = [] if single else ["<h1>Interfaces</h1>\n"]
    for package in packages:
        parts.append(
            f"<h1>{breakable(package)}</h1>\n" if single else f"<h2>{breakable(package)}</h2>\n"
        )
        parts.append(_about(about.get(package, About())))
        rows = (
            (
                f'<a href="{escape(pages[one.name])}">{breakable(one.name.name)}</a>',
                f'<small class="{one.name.kind}">{_KINDS[one.name.kind]}</small>',
                escape(_first(one)),
            )
            for one in interfaces
            if one.name.package == package
        )
        heads = (("title", "name"), ("kind", "kind"), ("meaning", "what it is for"))
        parts.append(table(heads, rows))
    return document(packages[0] if single else "Interfaces", "", "".join(parts))


def _about(about: About) -> str:
    """Return what a package's package.xml says: what it is for, then the facts in one line."""
    facts = [
        f"{label} {', '.join(values)}"
        for label, values in (
            ("version", (about.version,)),
            ("maintained by", about.maintainers),
            ("licence", about.licenses),
        )
        if any(values)
    ]
    line = f'<p class="facts">{escape(" · ".join(facts))}</p>\n' if facts else ""
    return prose(about.description.split("\n")) + line


def _index(interfaces: Sequence[ir.Interface], pages: Pages) -> str:
    """Return what is searched: name, page and a line about it."""
    entries = []
    for one in interfaces:
        page = pages[one.name]
        entries.append([str(one.name), page, printable(_first(one))])
        for part in derive.sections(one):
            prefix = _prefix(one, part)
            items = [(item.name, item.comment) for item in part.constants]
            items += [(item.name, item.comment) for item in part.fields]
            for item, comment in items:
                about = printable(" ".join(comment[:1]))
                entries.append([f"{part.name}.{item}", f"{page}#{prefix}{item}", about])
    return json.dumps(entries)
