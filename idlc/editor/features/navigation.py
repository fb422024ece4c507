"""Definitions, references, highlights, and the texts of built-in interfaces."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.editor.elements import Element, elements, snapshots, spot_at, text_of, users, uses
from idlc.editor.protocol.framing import INVALID_PARAMS, RequestError
from idlc.editor.protocol.parts import (
    Location,
    Part,
    Position,
    PositionParams,
    Range,
    ReferenceParams,
    TextDocumentContentParams,
)
from idlc.editor.state import InterfaceContext, ServerState
from idlc.editor.workspace import Snapshot
from idlc.model import catalog, ir
from idlc.model.distros import BY_NAME
from idlc.project.files import is_file
from idlc.project.package_xml import statements
from idlc.project.prefixes import ament_prefixes
from idlc.project.root import MANIFEST, Root

_TOP = Range(Position(0, 0), Position(0, 0))


def named_package(state: ServerState, params: PositionParams) -> str | None:
    """Return the package that is named at a position of a package.xml."""
    path = state.path(params.text_document.uri)
    source = _source(path, state) if path and path.name == MANIFEST else None
    if source is None:
        return None
    offset = state.offset(source, params.position)
    return next((name for name, at in _packages(source) if at.start <= offset <= at.end), None)


def manifest_definition(package: str, state: ServerState) -> Location | None:
    """Return the package.xml of a package, or one of its built-in interfaces."""
    for snapshot in snapshots(state):
        if path := _file(package, snapshot):
            return Location(state.uri(path), _TOP)
    for snapshot in snapshots(state):
        for name in snapshot.library.interfaces(package)[:1]:
            if source := snapshot.source(name):
                return state.location(Span(source, 0, 0), snapshot)
    return None


def manifest_references(
    package: str, params: ReferenceParams, state: ServerState
) -> list[Location]:
    """Return the uses of a package's messages, and the declarations in other packages."""
    locations = [
        state.location(at, snapshot)
        for snapshot, at, used in uses(state)
        if used.package == package
    ]
    for path in dict.fromkeys(_manifests(state)):
        source = _source(path, state)
        for name, at in _packages(source) if source else ():
            is_own = source is not None and source.text[: at.start].rstrip().endswith("<name>")
            if name == package and (params.context.include_declaration or not is_own):
                locations.append(Location(state.uri(path), state.range(at)))
    return locations


def _source(path: Path, state: ServerState) -> Source | None:
    """Return the text of a package.xml, as an editor has it if it is open."""
    return Root(path.parent, state.documents.texts()).read_source(path, str(path), Report())


def _packages(source: Source) -> Iterator[tuple[str, Span]]:
    """Yield the packages that a package.xml names, and where."""
    for statement in statements(source):
        if statement.text and (statement.tag == "name" or statement.tag.endswith("depend")):
            start = source.text.find(statement.text, statement.span.end - 1)
            if start >= 0:
                yield statement.text, Span(source, start, start + len(statement.text))


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
    paths = (declared and snapshot.folder / declared, *installed)
    return next((path for path in paths if path and is_file(path)), None)


_READ, _WRITE = 2, 3


class Highlight(Part, frozen=True):
    """A range with the same subject as the cursor's; `kind` 3 marks the definition."""

    range: Range
    kind: int


class Subject(NamedTuple):
    """The subject of a position: a definition, or the interface of that name."""

    context: InterfaceContext
    name: ir.TypeName
    element: Element | None


def subject_at(state: ServerState, params: PositionParams) -> Subject | None:
    """Return the subject of a position; between definitions, the file's interface."""
    context = state.context(params.text_document.uri)
    if context is None:
        return None
    spot = spot_at(state, context, params.position)
    if spot is None or spot.part == "comment":
        return Subject(context, context.interface.name, None)
    if spot.part == "type":
        target = spot.element.target
        return Subject(context, target, None) if target else None
    return Subject(context, context.interface.name, spot.element)


def definition(state: ServerState, params: PositionParams) -> Location | None:
    """Return the definition of the subject at a position."""
    if package := named_package(state, params):
        return manifest_definition(package, state)
    subject = subject_at(state, params)
    if subject is None:
        return None
    if subject.element is not None:
        return state.location(subject.element.name, subject.context.snapshot)
    return top(subject.name, subject.context.snapshot, state)


def type_definition(state: ServerState, params: PositionParams) -> Location | None:
    """Return the definition of the type of the field at a position."""
    subject = subject_at(state, params)
    if subject is None:
        return None
    target = subject.element.target if subject.element else subject.name
    return top(target, subject.context.snapshot, state) if target else None


def top(name: ir.TypeName, snapshot: Snapshot, state: ServerState) -> Location | None:
    """Return the beginning of the file of an interface."""
    source = text_of(name, snapshot)
    return state.location(Span(source, 0, 0), snapshot) if source else None


def references(state: ServerState, params: ReferenceParams) -> list[Location]:
    """Return the uses of the subject at a position in all folders, and its definition."""
    if package := named_package(state, params):
        return manifest_references(package, params, state)
    subject = subject_at(state, params)
    if subject is None:
        return []
    if subject.element is not None:
        spans = list(mentions(subject.element, subject.context))
        if not params.context.include_declaration:
            del spans[0]
        return [state.location(span, subject.context.snapshot) for span in spans]
    first = top(subject.name, subject.context.snapshot, state)
    declared = [first] if first and params.context.include_declaration else []
    snapshot, path = (
        subject.context.snapshot,
        subject.context.snapshot.path_of(subject.context.source),
    )
    used = [state.location(span, holder) for holder, span in users(subject.name, snapshot, state)]
    workspace = state.workspace_of(path)
    span = workspace.declaration(path, subject.name.package) if workspace else None
    used += [state.location(span, snapshot)] if span else []
    return list(dict.fromkeys((*declared, *used)))


def mentions(element: Element, context: InterfaceContext) -> Iterator[Span]:
    """Yield the definition of a field or constant, and its mentions in comments of the file.

    Comments mention constants by name. Field names are often words, so they need backticks.
    """
    yield element.name
    name = re.escape(element.body.name.text)
    if not name:
        return
    is_constant = isinstance(element.meaning, ir.Constant)
    pattern = re.compile(rf"\b{name}\b" if is_constant else rf"(?<=`){name}(?=`)")
    for span in comments(context):
        for match in pattern.finditer(span.text):
            yield span.at(*match.span())


def comments(context: InterfaceContext) -> Iterator[Span]:
    """Yield every comment of a file."""
    from idlc.language.parse import parse

    for section in parse(context.source).sections:
        for line in section.lines:
            if line.comment:
                start = line.start + len(line.code)
                yield Span(context.source, start, start + len(line.comment))


def highlights(state: ServerState, params: PositionParams) -> list[Highlight]:
    """Return the ranges of the document that have the same subject as a position."""
    subject = subject_at(state, params)
    if subject is None:
        return []
    if subject.element is not None:
        first, *mentioned = mentions(subject.element, subject.context)
        places = [Highlight(state.range(span), _READ) for span in mentioned]
        return [Highlight(state.range(first), _WRITE), *places]
    return [
        Highlight(state.range(element.type), _READ)
        for element in elements(subject.context.source, subject.context.interface)
        if element.target == subject.name
    ]


def built_in_text(_state: ServerState, params: TextDocumentContentParams) -> dict[str, str]:
    """Return the text of `idlc:/jazzy/std_msgs/msg/Header.msg`."""
    scheme, _, path = params.uri.partition(":")
    distro, _, name = path.strip("/").partition("/")
    stem, _, _kind = name.rpartition(".")
    source = None
    if scheme == "idlc" and distro in BY_NAME and stem.count("/") == 2:
        package, kind, interface = stem.split("/")
        if kind in ir.KINDS:
            source = catalog.source(ir.TypeName(package, kind, interface), BY_NAME[distro])
    if source is None:
        raise RequestError(INVALID_PARAMS, f"there is no document `{params.uri}`")
    return {"text": source.text}
