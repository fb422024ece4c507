"""Models → the files of a site."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from html import escape

from idlc.emit.render import RenderedFile
from idlc.emit.site import assets
from idlc.emit.site.html import Pages, document, link, page_of, prose, table, type_
from idlc.emit.site.picture import picture
from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.model.spelling import spell, spell_value

_KINDS = {"msg": "message", "srv": "service", "action": "action"}
_SECTIONS = {"srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}


def site(models: Sequence[Model]) -> tuple[RenderedFile, ...]:
    """Return the pages of all packages, and of what they use, with a search over all."""
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
        RenderedFile("index.html", _front(shown, pages)),
        RenderedFile("index.js", f"const INDEX = {_index(shown, pages)};\n"),
        RenderedFile("search.js", assets.SEARCH),
        RenderedFile("style.css", assets.STYLE),
        *files,
    )


def _targets(interface: ir.Interface) -> Iterator[ir.TypeName]:
    for part in derive.sections(interface):
        for field in part.fields:
            element = ir.element_of(field.type)
            if isinstance(element, ir.Ref):
                yield element.target


def _users(interfaces: Iterable[ir.Interface]) -> dict[ir.TypeName, set[ir.TypeName]]:
    found: dict[ir.TypeName, set[ir.TypeName]] = {}
    for interface in interfaces:
        for target in _targets(interface):
            found.setdefault(target, set()).add(interface.name)
    return found


def _page(interface: ir.Interface, model: Model, users: set[ir.TypeName], pages: Pages) -> str:
    name = interface.name
    hash_ = model.describer.hash(str(name))
    parts = [
        f'<p class="path">{escape(name.package)} / {escape(name.kind)}</p>\n',
        f'<h1>{escape(name.name)} <small class="{name.kind}">{_KINDS[name.kind]}</small></h1>\n',
    ]
    titles = _SECTIONS.get(name.kind, ("",))
    for title, section in zip(titles, derive.sections(interface), strict=True):
        parts.append(f"<h2>{title}</h2>\n" if title else "")
        parts.append(_section(section, _prefix(interface, section), pages))
    drawn = picture(name, users, set(_targets(interface)), pages)
    parts.append(f"<h2>Used by and using</h2>\n{drawn}" if drawn else "")
    if users:
        listed = ", ".join(link(user, str(user), pages) for user in sorted(users))
        parts.append(f'<p class="users">Used by {listed}.</p>\n')
    parts.append(f"<h2>Type hash</h2>\n<p><code>{escape(hash_)}</code></p>\n")
    return document(str(name), "../", "".join(parts))


def _prefix(interface: ir.Interface, part: ir.Message) -> str:
    """Return what tells the anchors of a service's or action's parts from each other."""
    return part.name.name.removeprefix(interface.name.name).strip("_") + "." * (
        part.name != interface.name
    )


def _named(name: str, prefix: str) -> str:
    return f'<code id="{escape(prefix + name)}">{escape(name)}</code>'


def _section(message: ir.Message, prefix: str, pages: Pages) -> str:
    package = message.name.package
    constants = table(
        ("constant", "type", "value", "meaning"),
        (
            (
                _named(one.name, prefix),
                f'<span class="type">{escape(spell(one.type))}</span>',
                f"<code>{escape(spell_value(one.value))}</code>",
                prose(one.comment),
            )
            for one in message.constants
        ),
    )
    fields = table(
        ("field", "type", "unit", "default", "meaning"),
        (
            (
                _named(one.name, prefix),
                type_(one.type, package, pages),
                f'<span class="unit">{escape(one.unit)}</span>' if one.unit else "",
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


def _front(interfaces: Sequence[ir.Interface], pages: Pages) -> str:
    parts = ["<h1>Interfaces</h1>\n"]
    for package in sorted({one.name.package for one in interfaces}):
        parts.append(f"<h2>{escape(package)}</h2>\n")
        rows = (
            (
                f'<a class="type" href="{escape(pages[one.name])}">{escape(one.name.name)}</a>',
                f'<small class="{one.name.kind}">{_KINDS[one.name.kind]}</small>',
                escape(_first(one)),
            )
            for one in interfaces
            if one.name.package == package
        )
        parts.append(table(("name", "kind", "what it is for"), rows))
    return document("Interfaces", "", "".join(parts))


def _index(interfaces: Sequence[ir.Interface], pages: Pages) -> str:
    """Return what is searched: name, page and a line about it."""
    entries = []
    for one in interfaces:
        page = pages[one.name]
        entries.append([str(one.name), page, _first(one)])
        for part in derive.sections(one):
            prefix = _prefix(one, part)
            items = [(item.name, item.comment) for item in part.constants]
            items += [(item.name, item.comment) for item in part.fields]
            for name, comment in items:
                entries.append(
                    [f"{part.name}.{name}", f"{page}#{prefix}{name}", " ".join(comment[:1])]
                )
    return json.dumps(entries)
