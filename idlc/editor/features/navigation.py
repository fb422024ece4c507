"""Where something is defined, and where it is used."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.editor.elements import Element, elements, snapshots, spot, text_of, users, uses
from idlc.editor.protocol.framing import INVALID_PARAMS, RequestError
from idlc.editor.protocol.parts import (
    AskedContent,
    AskedReferences,
    AtPosition,
    Location,
    Part,
    Position,
    Range,
)
from idlc.editor.state import Known, ServerState
from idlc.editor.workspace import Snapshot
from idlc.model import catalog, ir
from idlc.model.distros import BY_NAME
from idlc.project.files import is_file
from idlc.project.package_xml import statements
from idlc.project.prefixes import ament_prefixes
from idlc.project.root import MANIFEST, Root

_TOP = Range(Position(0, 0), Position(0, 0))


def named_package(state: ServerState, asked: AtPosition) -> str | None:
    """Return the package that is named at a position of a package.xml."""
    path = state.path(asked.text_document.uri)
    source = _source(path, state) if path and path.name == MANIFEST else None
    if source is None:
        return None
    offset = state.offset(source, asked.position)
    return next((name for name, at in _packages(source) if at.start <= offset <= at.end), None)


def manifest_definition(package: str, state: ServerState) -> Location | None:
    """Return the package.xml of a package, or what is built in of it."""
    for snapshot in snapshots(state):
        if path := _file(package, snapshot):
            return Location(state.uri(path), _TOP)
    for snapshot in snapshots(state):
        for name in snapshot.library.interfaces(package)[:1]:
            if source := snapshot.source(name):
                return state.location(Span(source, 0, 0), snapshot)
    return None


def manifest_references(package: str, asked: AskedReferences, state: ServerState) -> list[Location]:
    """Return where a package's messages are used, and where other packages declare it."""
    found = [
        state.location(at, snapshot)
        for snapshot, at, used in uses(state)
        if used.package == package
    ]
    for path in dict.fromkeys(_manifests(state)):
        source = _source(path, state)
        for name, at in _packages(source) if source else ():
            is_own = source is not None and source.text[: at.start].rstrip().endswith("<name>")
            if name == package and (asked.context.include_declaration or not is_own):
                found.append(Location(state.uri(path), state.range(at)))
    return found


def _source(path: Path, state: ServerState) -> Source | None:
    """Return the text of a package.xml, as an editor has it if it is open."""
    return Root(path.parent, state.documents.texts()).read_source(path, str(path), Report())


def _packages(source: Source) -> Iterator[tuple[str, Span]]:
    """Yield the packages that a package.xml names, and where."""
    for one in statements(source):
        if one.text and (one.tag == "name" or one.tag.endswith("depend")):
            start = source.text.find(one.text, one.span.end - 1)
            if start >= 0:
                yield one.text, Span(source, start, start + len(one.text))


def _manifests(state: ServerState) -> Iterator[Path]:
    """Yield the package.xml files of the packages in all folders."""
    for snapshot in snapshots(state):
        for path in snapshot.interfaces:
            if declared := snapshot.root.manifest(path.parent.parent):
                yield declared


def _file(package: str, snapshot: Snapshot) -> Path | None:
    """Return the package.xml of a package that is in a folder, beside it, or installed."""
    home = snapshot.library.home(package)
    declared = snapshot.root.manifest(home) if home else None
    installed = (prefix / "share" / package / MANIFEST for prefix in ament_prefixes())
    found = (declared and snapshot.folder / declared, *installed)
    return next((one for one in found if one and is_file(one)), None)


_READ, _WRITE = 2, 3


class Highlight(Part, frozen=True):
    """A range that is about the same thing as the cursor's; `kind` 3 is where it is defined."""

    range: Range
    kind: int


class Thing(NamedTuple):
    """The subject of a position: a definition, or the interface of that name."""

    known: Known
    name: ir.TypeName
    element: Element | None


def thing(state: ServerState, asked: AtPosition) -> Thing | None:
    """Return what a position is about; between definitions, that is the file's interface."""
    known = state.known(asked.text_document.uri)
    if known is None:
        return None
    found = spot(state, known, asked.position)
    if found is None or found.part == "comment":
        return Thing(known, known.interface.name, None)
    if found.part == "type":
        target = found.element.target
        return Thing(known, target, None) if target else None
    return Thing(known, known.interface.name, found.element)


def definition(state: ServerState, asked: AtPosition) -> Location | None:
    """Return where the thing at a position is defined."""
    if package := named_package(state, asked):
        return manifest_definition(package, state)
    found = thing(state, asked)
    if found is None:
        return None
    if found.element is not None:
        return state.location(found.element.name, found.known.snapshot)
    return top(found.name, found.known.snapshot, state)


def type_definition(state: ServerState, asked: AtPosition) -> Location | None:
    """Return where the type of the field at a position is defined."""
    found = thing(state, asked)
    if found is None:
        return None
    target = found.element.target if found.element else found.name
    return top(target, found.known.snapshot, state) if target else None


def top(name: ir.TypeName, snapshot: Snapshot, state: ServerState) -> Location | None:
    """Return the beginning of the file of an interface."""
    source = text_of(name, snapshot)
    return state.location(Span(source, 0, 0), snapshot) if source else None


def references(state: ServerState, asked: AskedReferences) -> list[Location]:
    """Return where the thing at a position is used, in all folders, and where it is defined."""
    if package := named_package(state, asked):
        return manifest_references(package, asked, state)
    found = thing(state, asked)
    if found is None:
        return []
    if found.element is not None:
        spans = list(mentions(found.element, found.known))
        if not asked.context.include_declaration:
            del spans[0]
        return [state.location(span, found.known.snapshot) for span in spans]
    first = top(found.name, found.known.snapshot, state)
    declared = [first] if first and asked.context.include_declaration else []
    snapshot, path = found.known.snapshot, found.known.snapshot.path_of(found.known.source)
    used = [state.location(span, one) for one, span in users(found.name, snapshot, state)]
    workspace = state.workspace_of(path)
    span = workspace.declaration(path, found.name.package) if workspace else None
    used += [state.location(span, snapshot)] if span else []
    return list(dict.fromkeys((*declared, *used)))


def mentions(element: Element, known: Known) -> Iterator[Span]:
    """Yield where a field or constant is defined, and where comments of its file name it.

    A constant is named by its name. Fields are called like words, so they count in backticks only.
    """
    yield element.name
    name = re.escape(element.body.name.text)
    if not name:
        return
    is_constant = isinstance(element.meaning, ir.Constant)
    pattern = re.compile(rf"\b{name}\b" if is_constant else rf"(?<=`){name}(?=`)")
    for span in comments(known):
        for match in pattern.finditer(span.text):
            yield span.at(*match.span())


def comments(known: Known) -> Iterator[Span]:
    """Yield every comment of a file."""
    from idlc.language.parse import parse

    for section in parse(known.source).sections:
        for line in section.lines:
            if line.comment:
                start = line.start + len(line.code)
                yield Span(known.source, start, start + len(line.comment))


def highlights(state: ServerState, asked: AtPosition) -> list[Highlight]:
    """Return the places of the document that are about the thing at a position."""
    found = thing(state, asked)
    if found is None:
        return []
    if found.element is not None:
        first, *others = mentions(found.element, found.known)
        places = [Highlight(state.range(span), _READ) for span in others]
        return [Highlight(state.range(first), _WRITE), *places]
    return [
        Highlight(state.range(one.type), _READ)
        for one in elements(found.known.source, found.known.interface)
        if one.target == found.name
    ]


def built_in_text(_state: ServerState, asked: AskedContent) -> dict[str, str]:
    """Return the text of `idlc:/jazzy/std_msgs/msg/Header.msg`."""
    scheme, _, path = asked.uri.partition(":")
    distro, _, name = path.strip("/").partition("/")
    stem, _, _kind = name.rpartition(".")
    source = None
    if scheme == "idlc" and distro in BY_NAME and stem.count("/") == 2:
        package, kind, interface = stem.split("/")
        if kind in ir.KINDS:
            source = catalog.source(ir.TypeName(package, kind, interface), BY_NAME[distro])
    if source is None:
        raise RequestError(INVALID_PARAMS, f"there is no document `{asked.uri}`")
    return {"text": source.text}
