"""The pipeline of `idlc docs`: compile packages, write pages about them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from idlc.check.compiler import sound_models, stage
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import printable
from idlc.documents.view import KINDS, Block, Home, Pages, blocks, page, prefix, words
from idlc.generate.gen import is_name, named_packages
from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.atomic import exclusive
from idlc.project.find import find
from idlc.project.lock import Tree
from idlc.project.package_xml import read_statements
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.project.templates import RenderedFile, html, verbatim
from idlc.project.write import apply, owned_files, plan


class About(NamedTuple):
    """The facts about a package in its package.xml."""

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
    """The page of a package; `described`: some interface has a description."""

    title: str
    root: str
    words: Sequence[str]
    description: Sequence[Block]
    facts: str
    described: bool
    entries: Sequence[Entry]


class PackageRow(NamedTuple):
    """A package in the list of packages."""

    page: str
    words: Sequence[str]
    facts: str
    about: str


class Front(NamedTuple):
    """The title page of several packages."""

    title: str
    root: str
    rows: Sequence[PackageRow]


def homes(names: Sequence[str]) -> dict[str, str]:
    """Return the page of each package; a single package has the title page."""
    return {name: f"{name}/index.html" if len(names) > 1 else "index.html" for name in names}


def package_page(
    name: str, home: str, about: About, interfaces: Sequence[ir.Interface], pages: Pages
) -> PackagePage:
    """Return the page of a package, which is `home`."""
    entries = [_entry(interface, pages) for interface in interfaces]
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
        rows.append(PackageRow(pages[name], words(name), facts, own.description))
    return Front("Interfaces", "", rows)


def counted(interfaces: Sequence[ir.Interface]) -> str:
    """Return the number of interfaces of each kind, in words."""
    kinds: Counter[str] = Counter(interface.name.kind for interface in interfaces)
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
    """Return the first line of an interface's description."""
    lines = (line for part in derive.sections(interface) for line in part.comment)
    return next((line for line in lines if line.strip()), "")


#: The interfaces by package.
Packages = Mapping[str, Sequence[ir.Interface]]


def site(models: Sequence[Model], about: Mapping[str, About]) -> tuple[RenderedFile, ...]:
    """Return the pages of all packages and of the interfaces that they use, with a search.

    `about` has the facts about packages by name.
    """
    sources: dict[ir.TypeName, tuple[ir.Interface, Model]] = {}
    for model in models:
        for name, interface in model.interfaces.items():
            if interface.source is not None and (name not in sources or interface in model.own):
                sources[name] = (interface, model)
    own = {interface.name for model in models for interface in model.own}
    pages = {name: _path(name) for name in sorted(sources)}
    users = _users(interface for interface, _ in sources.values())
    shown = [sources[name][0] for name in sorted(own)]
    packages = {
        name: tuple(group)
        for name, group in groupby(shown, lambda interface: interface.name.package)
    }
    home = homes([*packages])
    owners = {
        name: Home(address, about.get(name, About()).version) for name, address in home.items()
    }
    template = html().get_template("documents/interface.html.jinja")
    files = []
    for name, (interface, model) in sorted(sources.items()):
        owner = owners.get(name.package, Home())
        shown_page = page(interface, model, users.get(name, set()), pages, owner)
        files.append(RenderedFile(pages[name], template.render(page=shown_page)))
    return (
        *_lists(packages, home, pages, about),
        RenderedFile("index.js", f"const INDEX = {_index(packages, home, pages, about)};\n"),
        RenderedFile("search.js", verbatim("documents/search.js")),
        RenderedFile("style.css", verbatim("documents/style.css")),
        *files,
    )


def _lists(
    packages: Packages, home: Mapping[str, str], pages: Pages, about: Mapping[str, About]
) -> Iterator[RenderedFile]:
    """Yield the page of each package, and for several packages the title page."""
    template = html().get_template("documents/package.html.jinja")
    for name, interfaces in packages.items():
        text = package_page(name, home[name], about.get(name, About()), interfaces, pages)
        yield RenderedFile(home[name], template.render(page=text))
    if len(packages) > 1:
        title = html().get_template("documents/index.html.jinja")
        yield RenderedFile("index.html", title.render(page=front(packages, home, about)))


def _path(name: ir.TypeName) -> str:
    return f"{name.package}/{name.kind}-{name.name}.html"


def _users(interfaces: Iterable[ir.Interface]) -> dict[ir.TypeName, set[ir.TypeName]]:
    users: dict[ir.TypeName, set[ir.TypeName]] = {}
    for interface in interfaces:
        for target in derive.references(interface):
            users.setdefault(target, set()).add(interface.name)
    return users


def _index(
    packages: Packages, home: Mapping[str, str], pages: Pages, about: Mapping[str, About]
) -> str:
    """Return the search index: names, pages, descriptions and the items of each, as JSON."""
    entries: list[tuple[str, str, str, list[tuple[str, str]]]] = []
    for package, interfaces in packages.items():
        described = printable(about.get(package, About()).description)
        entries.append((package, home[package], described, []))
        entries += [
            (
                str(interface.name),
                pages[interface.name],
                printable(first_line(interface)),
                [*_items(interface)],
            )
            for interface in interfaces
        ]
    return json.dumps(entries, separators=(",", ":"))


def _items(interface: ir.Interface) -> Iterator[tuple[str, str]]:
    """Yield fields and constants, as suffixes of the interface's name, with a description."""
    for part in derive.sections(interface):
        before = prefix(interface, part)
        divider = "_" if before else "."
        items = [(constant.name, constant.comment) for constant in part.constants]
        items += [(field.name, field.comment) for field in part.fields]
        for name, comment in items:
            yield f"{divider}{before}{name}", printable(" ".join(comment[:1]))


#: The pages that a run wrote, each with its SHA-256.
LISTING = "idlc-docs.json"


def write(out: str, files: Mapping[str, str], root: Root, report: Report) -> bool:
    """Write files below `out`; report IDL612 to IDL614 and return `False` if that is refused."""
    folder = root.absolute(out)
    pages = {path: text.encode("utf-8") for path, text in files.items()}
    with exclusive(folder):
        planned = plan(folder, out, pages, _listed(folder), report, record=LISTING)
        return planned is not None and apply(planned, out, report, _listing)


def _listing(outputs: Mapping[str, str]) -> bytes:
    return json.dumps(outputs, indent=1, sort_keys=True).encode() + b"\n"


def _listed(folder: Path) -> dict[str, frozenset[str]]:
    """Return the pages that earlier runs may have written, each with its digests."""
    record = Tree(folder).read(LISTING)
    try:
        listed = json.loads(record) if isinstance(record, bytes) else {}
    except (ValueError, RecursionError):
        listed = {}
    return owned_files(listed if isinstance(listed, dict) else {})


def docs(paths: Sequence[str], out: str, scope: Scope, report: Report) -> int:
    """Write a site about the interfaces of paths and names; return its number of pages.

    Interfaces with errors, and interfaces that hold these, are left out.
    """
    packages = _packages(paths, scope, report)
    if report.had_errors:
        return 0
    models = [model for model, _ in sound_models(packages, scope, report) if model.own]
    if not models:
        return 0

    about = {package.package: _about(package, scope.root) for package in packages}
    with stage("document", out):
        files = {file.path: file.text for file in site(models, about)}
    written = Report()
    done = write(out, files, scope.root, written)
    report.extend(written)
    return sum(path.endswith(".html") for path in files) if done else 0


def _packages(words: Sequence[str], scope: Scope, report: Report) -> tuple[inputs.Inputs, ...]:
    names = [word for word in words if is_name(word, scope.root)]
    named = named_packages(names, scope, report, whole=False)
    paths = [word for word in words if not is_name(word, scope.root)]
    if not paths or report.had_errors:
        return tuple(named)
    files = find(paths, scope.root, report, scope.exclude)
    packages = (*inputs.packages(files, scope, report), *named)
    return inputs.without_duplicates(packages, scope.root, report)


def _about(package: inputs.Inputs, root: Root) -> About:
    """Return the facts about a package in its package.xml."""
    path = root.manifest(package.folders[0]) if package.folders else None
    statements = read_statements(path, path.as_posix(), root, Report()) if path else ()
    texts: dict[str, list[str]] = {}
    for statement in statements:
        texts.setdefault(statement.tag, []).append(" ".join(statement.text.split()))
    return About(
        version=" ".join(texts.get("version", [])),
        description=" ".join(texts.get("description", [])),
        maintainers=tuple(texts.get("maintainer", [])),
        licenses=tuple(texts.get("license", [])),
    )
