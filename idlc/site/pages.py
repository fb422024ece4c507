"""Models → the files of a site."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby

from idlc.diagnostics.visible import printable
from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.site.front import About, first_line, front, homes, package_page
from idlc.site.view import Home, Pages, page, prefix
from idlc.templating import RenderedFile, html, verbatim

#: The interfaces of each package that is shown.
Packages = Mapping[str, Sequence[ir.Interface]]


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
    shown = [known[name][0] for name in sorted(own)]
    packages = {name: tuple(found) for name, found in groupby(shown, lambda one: one.name.package)}
    home = homes([*packages])
    owners = {name: Home(there, about.get(name, About()).version) for name, there in home.items()}
    template = html().get_template("site/interface.html.jinja")
    files = []
    for name, (interface, model) in sorted(known.items()):
        owner = owners.get(name.package, Home())
        shown_page = page(interface, model, users.get(name, set()), pages, owner)
        files.append(RenderedFile(pages[name], template.render(page=shown_page)))
    return (
        *_lists(packages, home, pages, about),
        RenderedFile("index.js", f"const INDEX = {_index(packages, home, pages, about)};\n"),
        RenderedFile("search.js", verbatim("site/search.js")),
        RenderedFile("style.css", verbatim("site/style.css")),
        *files,
    )


def _lists(
    packages: Packages, home: Mapping[str, str], pages: Pages, about: Mapping[str, About]
) -> Iterator[RenderedFile]:
    """Yield the pages that list interfaces, and for several packages the one that lists those."""
    template = html().get_template("site/package.html.jinja")
    for name, interfaces in packages.items():
        text = package_page(name, home[name], about.get(name, About()), interfaces, pages)
        yield RenderedFile(home[name], template.render(page=text))
    if len(packages) > 1:
        title = html().get_template("site/index.html.jinja")
        yield RenderedFile("index.html", title.render(page=front(packages, home, about)))


def _path(name: ir.TypeName) -> str:
    return f"{name.package}/{name.kind}-{name.name}.html"


def _users(interfaces: Iterable[ir.Interface]) -> dict[ir.TypeName, set[ir.TypeName]]:
    found: dict[ir.TypeName, set[ir.TypeName]] = {}
    for interface in interfaces:
        for target in derive.references(interface):
            found.setdefault(target, set()).add(interface.name)
    return found


def _index(
    packages: Packages, home: Mapping[str, str], pages: Pages, about: Mapping[str, About]
) -> str:
    """Return what is searched: names, pages, lines about them, and the same of what is in them."""
    entries: list[tuple[str, str, str, list[tuple[str, str]]]] = []
    for package, interfaces in packages.items():
        described = printable(about.get(package, About()).description)
        entries.append((package, home[package], described, []))
        entries += [
            (str(one.name), pages[one.name], printable(first_line(one)), [*_items(one)])
            for one in interfaces
        ]
    return json.dumps(entries, separators=(",", ":"))


def _items(interface: ir.Interface) -> Iterator[tuple[str, str]]:
    """Yield fields and constants, as they follow the interface's name, and a line about each."""
    for part in derive.sections(interface):
        before = prefix(interface, part)
        divider = "_" if before else "."
        items = [(one.name, one.comment) for one in part.constants]
        items += [(one.name, one.comment) for one in part.fields]
        for name, comment in items:
            yield f"{divider}{before}{name}", printable(" ".join(comment[:1]))
