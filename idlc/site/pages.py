"""Models → the files of a site."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence

from idlc.diagnostics.visible import printable
from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.site.front import About, first_line, front
from idlc.site.view import Pages, page, prefix
from idlc.templating import RenderedFile, html, verbatim


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
    pages = {name: _path(name) for name in sorted(known)}
    users = _users(interface for interface, _ in known.values())
    template = html().get_template("site/interface.html.jinja")
    files = [
        RenderedFile(
            pages[name],
            template.render(page=page(interface, model, users.get(name, set()), pages)),
        )
        for name, (interface, model) in sorted(known.items())
    ]
    shown = [known[name][0] for name in sorted(own)]
    title = html().get_template("site/index.html.jinja")
    return (
        RenderedFile("index.html", title.render(page=front(shown, pages, about))),
        RenderedFile("index.js", f"const INDEX = {_index(shown, pages)};\n"),
        RenderedFile("search.js", verbatim("site/search.js")),
        RenderedFile("style.css", verbatim("site/style.css")),
        *files,
    )


def _path(name: ir.TypeName) -> str:
    return f"{name.package}/{name.kind}-{name.name}.html"


def _users(interfaces: Iterable[ir.Interface]) -> dict[ir.TypeName, set[ir.TypeName]]:
    found: dict[ir.TypeName, set[ir.TypeName]] = {}
    for interface in interfaces:
        for target in derive.references(interface):
            found.setdefault(target, set()).add(interface.name)
    return found


def _index(interfaces: Sequence[ir.Interface], pages: Pages) -> str:
    """Return what is searched: name, page and a line about it."""
    entries = []
    for one in interfaces:
        path = pages[one.name]
        entries.append([str(one.name), path, printable(first_line(one))])
        for part in derive.sections(one):
            before = prefix(one, part)
            items = [(item.name, item.comment) for item in part.constants]
            items += [(item.name, item.comment) for item in part.fields]
            for item, comment in items:
                about = printable(" ".join(comment[:1]))
                entries.append([f"{part.name}.{item}", f"{path}#{before}{item}", about])
    return json.dumps(entries)
