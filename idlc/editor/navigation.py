"""Definitions, references, highlights, and the texts of built-in interfaces."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from idlc.check.manifest import declaration
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.editor.documents import TOP
from idlc.editor.elements import Declaration, comments, elements, spot_at, users, uses
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


def _subject_at(
    context: InterfaceContext, params: PositionParams
) -> Declaration | ir.TypeName | None:
    """Return the definition at a position, or the interface that is named there.

    Between definitions, that is the file's interface.
    """
    spot = spot_at(context, params.position)
    if spot is None or spot.part == "comment":
        return context.interface.name
    return spot.element.target if spot.part == "type" else spot.element


def definition(state: ServerState, params: PositionParams) -> Location | None:
    """Return the definition of the subject at a position."""
    if package := _named_package(state, params):
        for snapshot in state.snapshots():
            home = snapshot.library.home(package)
            declared = snapshot.root.manifest(home) if home else None
            installed = (prefix / "share" / package / MANIFEST for prefix in ament_prefixes())
            for path in (declared and snapshot.folder / declared, *installed):
                if path and is_file(path):
                    return Location(state.uri(path), TOP)
        for snapshot in state.snapshots():
            for name in snapshot.library.interfaces(package)[:1]:
                return _top(name, snapshot, state)
        return None
    context = state.context(params.text_document.uri)
    subject = _subject_at(context, params) if context else None
    if context is None or subject is None:
        return None
    if isinstance(subject, Declaration):
        return state.location(subject.name, context.snapshot.folder)
    return _top(subject, context.snapshot, state)


def type_definition(context: InterfaceContext, params: PositionParams) -> Location | None:
    """Return the definition of the type of the field at a position."""
    subject = _subject_at(context, params)
    target = subject.target if isinstance(subject, Declaration) else subject
    return _top(target, context.snapshot, context.state) if target else None


def _top(name: ir.TypeName, snapshot: Snapshot, state: ServerState) -> Location | None:
    """Return the beginning of the file of an interface."""
    source = snapshot.source(name)
    return state.location(Span(source, 0, 0), snapshot.folder) if source else None


def references(state: ServerState, params: ReferenceParams) -> list[Location]:
    """Return the uses of the subject at a position in all folders, and its definition."""
    declared = params.context.include_declaration
    if package := _named_package(state, params):
        return _uses_of_package(package, state, declared=declared)
    context = state.context(params.text_document.uri)
    subject = _subject_at(context, params) if context else None
    if context is None or subject is None:
        return []
    snapshot = context.snapshot
    if isinstance(subject, Declaration):
        spans = [*mentions(subject, context)][0 if declared else 1 :]
        return [state.location(span, snapshot.folder) for span in spans]
    first = _top(subject, snapshot, state) if declared else None
    used = users(subject, snapshot, state)
    locations = [state.location(span, holder.folder) for holder, span in used]
    facts = context.workspace.facts(context.path)
    if facts and (span := declaration(facts, subject.package)):
        locations.append(state.location(span, snapshot.folder))
    return list(dict.fromkeys(filter(None, (first, *locations))))


def _uses_of_package(package: str, state: ServerState, *, declared: bool) -> list[Location]:
    """Return where fields use a package and each package.xml names it, with its own `<name>`."""
    locations = [
        state.location(at, snapshot.folder)
        for snapshot, at, used in uses(state)
        if used.package == package
    ]
    manifests = (
        snapshot.root.manifest(path.parent.parent)
        for snapshot in state.snapshots()
        for path in snapshot.interfaces
    )
    for path in dict.fromkeys(filter(None, manifests)):
        source = _source(path, state)
        for name, at in _packages(source) if source else ():
            is_own = at.source.text[: at.start].rstrip().endswith("<name>")
            if name == package and (declared or not is_own):
                locations.append(Location(state.uri(path), state.range(at)))
    return locations


def mentions(element: Declaration, context: InterfaceContext) -> Iterator[Span]:
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
    if isinstance(subject, Declaration):
        spans, first = [*mentions(subject, context)], _WRITE
    else:
        spans, first = [e.type for e in elements(context) if e.target == subject], _READ
    return [
        {"range": context.state.range(span), "kind": _READ if number else first}
        for number, span in enumerate(spans)
    ]


def built_in_text(_state: ServerState, params: Uri) -> dict[str, str]:
    """Return the text of `idlc:/jazzy/std_msgs/msg/Header.msg`."""
    scheme, _, path = params.uri.partition(":")
    distro, _, name = path.strip("/").partition("/")
    source = None
    if scheme == "idlc" and distro in BY_NAME:
        with suppress(ValueError):
            type_name = ir.TypeName.parse(name.rpartition(".")[0])
            source = catalog.source(type_name, BY_NAME[distro])
    if source is None:
        raise RequestError(INVALID_PARAMS, f"there is no document `{params.uri}`")
    return {"text": source.text}
