"""The pipeline of `idlc docs`: compile packages, write pages about them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple, TypeAlias

from idlc.compiler.compiler import sound_models, stage
from idlc.diagnostics.report import Report
from idlc.diagnostics.terminal import counted
from idlc.diagnostics.text import printable
from idlc.generate.templates import RenderedFile, html, verbatim
from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.atomic import exclusive
from idlc.project.find import find
from idlc.project.lock import Tree
from idlc.project.package_xml import read_statements
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.project.words import read_word
from idlc.project.write import apply, owned_files, plan
from idlc.tasks.docs_view import KINDS, Home, PagePaths, Paragraph, blocks, page, prefix, words
from idlc.tasks.gen import named_packages


class About(NamedTuple):
    """The facts about a package in its package.xml."""

    version: str = ""
    description: str = ""
    maintainers: tuple[str, ...] = ()
    licenses: tuple[str, ...] = ()


class ListingEntry(NamedTuple):
    """An interface in the list of its package, or a package among several."""

    page: str
    words: Sequence[str]
    kind: str
    what: str
    about: str


class ListingPage(NamedTuple):
    """The page of a package, or of several; `described`: some entry has a description."""

    title: str
    root: str
    words: Sequence[str]
    description: Sequence[Paragraph]
    facts: str
    described: bool
    entries: Sequence[ListingEntry]


def _package_page(
    name: str, home: str, about: About, interfaces: Sequence[ir.Interface], pages: PagePaths
) -> ListingPage:
    entries = [
        ListingEntry(
            pages[interface.name],
            words(interface.name.name),
            interface.name.kind,
            KINDS[interface.name.kind],
            first_line(interface),
        )
        for interface in interfaces
    ]
    facts = {
        "version": about.version,
        "maintained by": ", ".join(about.maintainers),
        "licence": ", ".join(about.licenses),
    }
    shown = [f"{label} {fact}" for label, fact in facts.items() if fact]
    return ListingPage(
        title=name,
        root="../" * home.count("/"),
        words=words(name),
        description=blocks(about.description.split("\n")),
        facts=" · ".join([*shown, kind_counts(interfaces)]),
        described=any(entry.about for entry in entries),
        entries=entries,
    )


def kind_counts(interfaces: Sequence[ir.Interface]) -> str:
    """Return the number of interfaces of each kind, in words."""
    kinds: Counter[str] = Counter(interface.name.kind for interface in interfaces)
    return ", ".join(counted(kinds[kind], word) for kind, word in KINDS.items() if kinds[kind])


def first_line(interface: ir.Interface) -> str:
    """Return the first line of an interface's description."""
    lines = (line for part in derive.sections(interface) for line in part.comment)
    return next((line for line in lines if line.strip()), "")


#: The interfaces by package.
InterfacesByPackage: TypeAlias = Mapping[str, Sequence[ir.Interface]]
#: The facts about packages by name.
Abouts: TypeAlias = Mapping[str, About]


def site(models: Sequence[Model], about: Abouts) -> Iterator[RenderedFile]:
    """Yield the pages of all packages and of the interfaces that they use, with a search."""
    sources = _with_sources(models)
    own = sorted({interface.name for model in models for interface in model.own})
    users: dict[ir.TypeName, set[ir.TypeName]] = {}
    for interface, _ in sources.values():
        for target in derive.references(interface):
            users.setdefault(target, set()).add(interface.name)
    pages = {name: f"{name.package}/{name.kind}-{name.name}.html" for name in sorted(sources)}
    packages = {
        package: tuple(sources[name][0] for name in names)
        for package, names in groupby(own, attrgetter("package"))
    }
    # a single package has the title page
    home = {name: f"{name}/index.html" if len(packages) > 1 else "index.html" for name in packages}
    template = html().get_template("documents/package.html.jinja")
    for package, interfaces in packages.items():
        facts = about.get(package, About())
        shown = _package_page(package, home[package], facts, interfaces, pages)
        yield RenderedFile(home[package], template.render(page=shown))
    if len(packages) > 1:
        template = html().get_template("documents/index.html.jinja")
        entries = [
            _package_entry(package, home[package], about.get(package, About()), interfaces)
            for package, interfaces in packages.items()
        ]
        shown = ListingPage("Interfaces", "", (), (), "", True, entries)
        yield RenderedFile("index.html", template.render(page=shown))
    yield RenderedFile("index.js", f"const INDEX = {_index(packages, home, pages, about)};\n")
    for path in ("search.js", "style.css"):
        yield RenderedFile(path, verbatim(f"documents/{path}"))
    template = html().get_template("documents/interface.html.jinja")
    owners = {name: Home(home[name], about.get(name, About()).version) for name in home}
    for name, (interface, model) in sorted(sources.items()):
        owner = owners.get(name.package, Home())
        text = template.render(page=page(interface, model, users.get(name, set()), pages, owner))
        yield RenderedFile(pages[name], text)


def _with_sources(models: Sequence[Model]) -> dict[ir.TypeName, tuple[ir.Interface, Model]]:
    """Return the interfaces that have a file, each with its model: that of its package, if any."""
    sources: dict[ir.TypeName, tuple[ir.Interface, Model]] = {}
    for model in models:
        for name, interface in model.interfaces.items():
            if interface.source is not None and (name not in sources or interface in model.own):
                sources[name] = (interface, model)
    return sources


def _package_entry(
    package: str, home: str, facts: About, interfaces: Sequence[ir.Interface]
) -> ListingEntry:
    version = [f"version {facts.version}"] if facts.version else []
    line = " · ".join([*version, kind_counts(interfaces)])
    return ListingEntry(home, words(package), "", line, facts.description)


def _index(
    packages: InterfacesByPackage, home: Mapping[str, str], pages: PagePaths, about: Abouts
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
        items: tuple[ir.Constant | ir.Field, ...] = (*part.constants, *part.fields)
        for item in items:
            yield f"{divider}{before}{item.name}", printable(" ".join(item.comment[:1]))


#: The pages that a run wrote, each with its SHA-256.
LISTING = "idlc-docs.json"


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

    Interfaces with errors, and interfaces that hold these, are left out. Raises ReportedError.
    """
    packages = _packages(paths, scope, report)
    report.raise_errors()
    models = [model for model, _ in sound_models(packages, scope, report) if model.own]
    if not models:
        return 0

    about = {package.package: _about(package, scope.root) for package in packages}
    with stage("document", out):
        pages = {file.path: file.text.encode("utf-8") for file in site(models, about)}
    folder, problems = scope.root.absolute(out), Report()
    with exclusive(folder):
        planned = plan(folder, out, pages, _listed(folder), problems, record=LISTING)
        done = planned is not None and apply(planned, out, problems, _listing)
    report.extend(problems)
    return sum(path.endswith(".html") for path in pages) if done else 0


def _packages(words: Sequence[str], scope: Scope, report: Report) -> tuple[inputs.Inputs, ...]:
    names = [word for word in words if read_word(word, scope.root) == "name"]
    named = named_packages(names, scope, report, whole=False)
    paths = [word for word in words if word not in names]
    report.raise_errors()
    if not paths:
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
