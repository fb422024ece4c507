"""Definitions, references, highlights, and the texts of built-in interfaces."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from idlc.check.package.manifest import declaration
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.editor.documents import TOP
from idlc.editor.elements import Element, comments, elements, spot_at, users, uses
from idlc.editor.parts import Location, PositionParams, ReferenceParams, Uri
from idlc.editor.protocol import INVALID_PARAMS, RequestError
from idlc.editor.state import InterfaceContext, ServerState
from idlc.editor.workspace import Snapshot
from idlc.model import catalog, ir
from idlc.model.distros import BY_NAME
from idlc.project.files import is_file
from idlc.project.package_xml import statements
from idlc.project.prefixes import ament_prefixes
from idlc.project.root import MANIFEST, Root


def _named_package(state: ServerState, params: PositionParams) -> str | None:
    """Return the package that is named at a position of a package.xml."""
    path = state.path(params.text_document.uri)
    source = _source(path, state) if path and path.name == MANIFEST else None
    if source is None:
        return None
    offset = state.offset(source, params.position)
    return next((name for name, at in _packages(source) if at.start <= offset <= at.end), None)


def _manifest_definition(package: str, state: ServerState) -> Location | None:
    """Return the package.xml of a package, or one of its built-in interfaces."""
    for snapshot in state.snapshots():
        if path := _file(package, snapshot):
            return Location(state.uri(path), TOP)
    for snapshot in state.snapshots():
        for name in snapshot.library.interfaces(package)[:1]:
            return _top(name, snapshot, state)
    return None


def _manifest_references(package: str, state: ServerState, *, declared: bool) -> list[Location]:
    """Return the uses of a package's messages, and the declarations in other packages."""
    locations = [
        state.location(at, snapshot.folder)
        for snapshot, at, used in uses(state)
        if used.package == package
    ]
    for path in dict.fromkeys(_manifests(state)):
        source = _source(path, state)
        for name, at in _packages(source) if source else ():
            is_own = source is not None and source.text[: at.start].rstrip().endswith("<name>")
            if name == package and (declared or not is_own):
                locations.append(Location(state.uri(path), state.range(at)))
    return locations


def _source(path: Path, state: ServerState) -> Source | None:
    """Return the text of a package.xml, as an editor has it if it is open."""
    return Root(path.parent, state.texts()).read_source(path, str(path), Report())


def _packages(source: Source) -> Iterator[tuple[str, Span]]:
    """Yield the packages that a package.xml names, and where."""
    for statement in statements(source):
        if statement.text and (statement.tag == "name" or statement.tag.endswith("depend")):
            start = source.text.find(statement.text, statement.span.end - 1)
            if start >= 0:
                yield statement.text, Span(source, start, start + len(statement.text))


def _manifests(state: ServerState) -> Iterator[Path]:
    """Yield the package.xml files of the packages in all folders."""
    for snapshot in state.snapshots():
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


class Subject(NamedTuple):
    """The subject of a position: a definition, or the interface of that name."""

    name: ir.TypeName
    element: Element | None = None


def _subject_at(context: InterfaceContext, params: PositionParams) -> Subject | None:
    """Return the subject of a position; between definitions, the file's interface."""
    spot = spot_at(context, params.position)
    if spot is None or spot.part == "comment":
        return Subject(context.interface.name)
    if spot.part == "type":
        return Subject(spot.element.target) if spot.element.target else None
    return Subject(context.interface.name, spot.element)


def definition(state: ServerState, params: PositionParams) -> Location | None:
    """Return the definition of the subject at a position."""
    if package := _named_package(state, params):
        return _manifest_definition(package, state)
    context = state.context(params.text_document.uri)
    subject = _subject_at(context, params) if context else None
    if context is None or subject is None:
        return None
    if subject.element is not None:
        return state.location(subject.element.name, context.snapshot.folder)
    return _top(subject.name, context.snapshot, state)


def type_definition(context: InterfaceContext, params: PositionParams) -> Location | None:
    """Return the definition of the type of the field at a position."""
    subject = _subject_at(context, params)
    if subject is None:
        return None
    target = subject.element.target if subject.element else subject.name
    return _top(target, context.snapshot, context.state) if target else None


def _top(name: ir.TypeName, snapshot: Snapshot, state: ServerState) -> Location | None:
    """Return the beginning of the file of an interface."""
    source = snapshot.source(name)
    return state.location(Span(source, 0, 0), snapshot.folder) if source else None


def references(state: ServerState, params: ReferenceParams) -> list[Location]:
    """Return the uses of the subject at a position in all folders, and its definition."""
    declared = params.context.include_declaration
    if package := _named_package(state, params):
        return _manifest_references(package, state, declared=declared)
    context = state.context(params.text_document.uri)
    subject = _subject_at(context, params) if context else None
    if context is None or subject is None:
        return []
    snapshot = context.snapshot
    if subject.element is not None:
        spans = [*mentions(subject.element, context)][0 if declared else 1 :]
        return [state.location(span, snapshot.folder) for span in spans]
    first = _top(subject.name, snapshot, state) if declared else None
    used = users(subject.name, snapshot, state)
    locations = [state.location(span, holder.folder) for holder, span in used]
    facts = context.workspace.facts(context.path)
    if facts and (span := declaration(facts, subject.name.package)):
        locations.append(state.location(span, snapshot.folder))
    return list(dict.fromkeys((*([first] if first else ()), *locations)))


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
    for _, span in comments(context):
        for match in pattern.finditer(span.text):
            yield span.at(*match.span())


_READ, _WRITE = 2, 3


def highlights(context: InterfaceContext, params: PositionParams) -> list[dict[str, object]]:
    """Return the ranges of the document with the subject of a position; its definition first."""
    subject = _subject_at(context, params)
    if subject is None:
        return []
    if subject.element is not None:
        spans, kinds = [*mentions(subject.element, context)], [_WRITE]
    else:
        spans, kinds = [e.type for e in elements(context) if e.target == subject.name], []
    kinds += [_READ] * (len(spans) - len(kinds))
    return [
        {"range": context.state.range(span), "kind": kind}
        for span, kind in zip(spans, kinds, strict=True)
    ]


def built_in_text(_state: ServerState, params: Uri) -> dict[str, str]:
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
