"""Renaming fields, constants and interfaces, with everything that uses them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import msgspec

from idlc.check.package.manifest import calls
from idlc.compare.changes import LEVELS, Change
from idlc.compare.packages import compare, renamed_interface
from idlc.diagnostics.report import Edit, Report, apply, first_few
from idlc.diagnostics.source import Span
from idlc.diagnostics.terminal import counted
from idlc.editor.elements import (
    Element,
    document_edit,
    of_documents,
    snapshots,
    spot_at,
    users,
    uses,
)
from idlc.editor.features.navigation import mentions
from idlc.editor.protocol import uris
from idlc.editor.protocol.framing import REQUEST_FAILED, RequestError
from idlc.editor.protocol.parts import (
    Part,
    PositionParams,
    Range,
    RenameFilesParams,
    RenameParams,
    TextEdit,
)
from idlc.editor.state import InterfaceContext, Renaming, ServerState
from idlc.model import ir, names
from idlc.project.files import is_file
from idlc.project.root import Root

#: The file that lists the interface files of a package.
BUILD = "CMakeLists.txt"
#: Letters of the longest name that a file can have on usual disks.
LONGEST_NAME = 255
#: Users that a warning names.
NAMED = 5
_ANNOTATION = "idlc.rename"
_CANNOT_MOVE = (
    "a message is renamed with its file, and this editor does not rename files for a server; "
    "Emacs does with idlc.el, as docs/editors.md says"
)


class PrepareRenameResult(Part, frozen=True):
    """The range and the name that would be renamed."""

    range: Range
    placeholder: str


class AnnotatedTextEdit(TextEdit, frozen=True):
    """An edit that the user confirms."""

    annotation_id: str


class Move(Part, frozen=True, tag="rename", tag_field="kind"):
    """A file that gets another name, as an operation of a workspace edit."""

    old_uri: str
    new_uri: str
    annotation_id: str | None = None


def prepare(state: ServerState, params: PositionParams) -> PrepareRenameResult | None:
    """Return the name at a position, `None` if it is none of this workspace's."""
    state.notice_changes()  # which a client may not have reported yet
    context = state.context(params.text_document.uri)
    spot = spot_at(state, context, params.position) if context else None
    if context is None or spot is None:
        return None
    if spot.part == "name" and spot.element.meaning is not None:
        return PrepareRenameResult(state.range(spot.span), spot.span.text)
    target = spot.element.target
    if spot.part == "type" and target is not None and _home(target, context, state):
        span = _last(spot.element.type)
        return PrepareRenameResult(state.range(span), span.text)
    return None


def _last(span: Span) -> Span:
    """Return a type's name without its package."""
    return span.at(span.text.rfind("/") + 1, len(span.text))


def can_move_files(state: ServerState) -> bool:
    """Return whether the client renames files where an edit says so."""
    return state.supports("workspace", "workspaceEdit", "resourceOperations", "rename")


def _home(
    name: ir.TypeName, asking: InterfaceContext, state: ServerState
) -> InterfaceContext | None:
    """Return the interface that a file refers to by a name, if it is one of the workspace's.

    Where its folder finds the name elsewhere, as in an install prefix, another folder may have it.
    """
    for snapshot in sorted(snapshots(state), key=lambda snapshot: snapshot is not asking.snapshot):
        for interface, source in snapshot.interfaces.values():
            if interface.name == name:
                return InterfaceContext(snapshot, interface, source)
    return None


def rename(state: ServerState, params: RenameParams) -> dict[str, object] | None:
    """Return the edits that rename the element at a position, annotated with what they break."""
    state.forget()
    context = state.context(params.text_document.uri)
    spot = spot_at(state, context, params.position) if context else None
    if context is None or spot is None or prepare(state, params) is None:
        raise RequestError(REQUEST_FAILED, "there is no name of this workspace here")
    if spot.part == "type":
        target = spot.element.target
        home = _home(target, context, state) if target else None
        assert home is not None
        return rename_interface(home, params.text_document.uri, params.new_name, context, state)
    return _rename_definition(spot.element, context, params.new_name, state)


def _rename_definition(
    element: Element, context: InterfaceContext, new: str, state: ServerState
) -> dict[str, object]:
    is_constant = isinstance(element.meaning, ir.Constant)
    valid = names.is_constant_name(new) if is_constant else names.is_field_name(new)
    if not valid:
        hint = names.CONSTANT_HINT if is_constant else names.FIELD_HINT
        raise RequestError(REQUEST_FAILED, f"`{new}` cannot be such a name: {hint}")
    siblings = element.message.constants if is_constant else element.message.fields
    if any(definition.name == new and definition is not element.meaning for definition in siblings):
        raise RequestError(REQUEST_FAILED, f"there is a `{new}` already")
    edits = [Edit(span, new) for span in mentions(element, context)]
    uri = state.uri(context.snapshot.path_of(context.source))
    changed = {uri: [TextEdit(state.range(edit.span), edit.text) for edit in edits]}
    changes = _changes(context, apply(context.source.text, edits)[0], state)
    title = f"Rename {element.body.name.text} to {new}"
    return _answer(changed, None, title, changes, context, state)


def _changes(context: InterfaceContext, text: str, state: ServerState) -> Iterable[Change] | None:
    """Return the changes that a new text of a file makes; `None` if a version has errors."""
    path = context.snapshot.path_of(context.source)
    workspace = state.workspace_of(path)
    after = workspace.snapshot_with(path, text) if workspace else None
    interface = after.interfaces[path][0] if after and path in after.interfaces else None
    if after is None or interface is None:
        return None
    old, new = context.snapshot.model_of(context.interface), after.model_of(interface)
    name = {interface.name}
    return compare(old.only(name), new.only(name)).changes if old and new else None


def rename_interface(
    home: InterfaceContext, uri: str, new: str, asking: InterfaceContext, state: ServerState
) -> dict[str, object] | None:
    """Return the edits for another name of an interface, with the renaming of its file.

    The request came from the document `uri`, whose context is `asking`.
    """
    old = home.interface.name
    path = home.snapshot.path_of(home.source)
    if not names.is_message_name(new):
        raise RequestError(REQUEST_FAILED, f"`{new}` cannot be such a name: {names.MESSAGE_HINT}")
    target = path.with_name(f"{new}.{old.kind}")
    if len(target.name) > LONGEST_NAME:
        raise RequestError(REQUEST_FAILED, f"no file can have a name of {len(target.name)} letters")
    if new == old.name:
        return None
    if os.path.lexists(target) or state.documents.at(target):
        raise RequestError(REQUEST_FAILED, f"there is a `{target.name}` already")
    if not is_file(path):
        raise RequestError(REQUEST_FAILED, f"save `{path.name}` first: there is no file to rename")
    if not can_move_files(state):
        raise RequestError(REQUEST_FAILED, _CANNOT_MOVE)
    report = Report()
    edits = _edits_of_users(home, new, report, state)
    if problem := next(iter(report), None):
        raise RequestError(REQUEST_FAILED, f"nothing is renamed: {BUILD}: {problem.message}")
    document_path = state.path(uri)
    used = users(old, home.snapshot, state)
    spans = (
        _last(span) for snapshot, span in used if snapshot.path_of(span.source) == document_path
    )
    own = dict.fromkeys(Edit(Span(asking.source, span.start, span.end), new) for span in spans)
    state.renaming = Renaming(path, target, uri, apply(asking.source.text, list(own))[0])
    move = Move(state.uri(path), uris.from_path(target))
    renamed = msgspec.structs.replace(home.interface, name=old._replace(name=new))
    changes = [renamed_interface(home.interface, renamed)]
    return _answer(edits, move, f"Rename {old.name} to {new}", changes, home, state)


def files(state: ServerState, params: RenameFilesParams) -> dict[str, object] | None:
    """Return the edits that follow from interface files getting other names.

    Some clients also request this for a file that an answer of `rename` has them move. Open
    documents have the edits of that answer by then. Other files that it edits may be in buffers
    that the client does not report, so they are not edited again.
    """
    state.forget()
    edits: dict[str, list[TextEdit]] = {}
    report = Report()
    for file in {each.old_uri: each for each in params.files}.values():
        old, new = uris.to_path(file.old_uri), uris.to_path(file.new_uri)
        context = state.context(file.old_uri)
        if not (old and new and context and _is_other_name(old, new)):
            continue
        is_own = state.renaming is not None and _is_under_way(state.renaming, old, new, state)
        by_uri = _edits_of_users(context, new.stem, report, state)
        for uri, some in by_uri.items():
            if not is_own or state.documents.get(uri):
                edits.setdefault(uri, []).extend(some)
    for problem in report:
        state.notify(
            "window/showMessage", {"type": 2, "message": f"{BUILD} is left: {problem.message}"}
        )
    return of_documents(edits, state) if edits else None


def _is_other_name(old: Path, new: Path) -> bool:
    """Return whether a file gets another name that an interface can have."""
    is_valid = names.is_message_name(new.stem)
    return is_valid and old.parent == new.parent and old.suffix == new.suffix


def _is_under_way(renaming: Renaming, old: Path, new: Path, state: ServerState) -> bool:
    """Return whether the client applies the edits of an answer, and now moves this file for it."""
    if (renaming.old, renaming.new) != (old, new):
        return False
    context = state.context(renaming.uri)
    return context is not None and context.source.text == renaming.text


def _edits_of_users(
    context: InterfaceContext, new: str, report: Report, state: ServerState
) -> dict[str, list[TextEdit]]:
    """Return the edits of all files that name an interface: its users, and CMakeLists.txt.

    Two folders may hold the same file, also by a link: it is edited once, where it is open.
    """
    old, path = context.interface.name, context.snapshot.path_of(context.source)
    used = users(old, context.snapshot, state)
    places = [(snapshot.path_of(span.source), _last(span)) for snapshot, span in used]
    places += [(Path(span.source.path), span) for span in _in_cmake(old, path, report, state)]
    places.sort(key=lambda place: state.documents.at(place[0]) is None)
    edited: dict[Path, Path] = {}
    edits: dict[str, dict[TextEdit, None]] = {}
    for at, span in places:
        if edited.setdefault(at.resolve(), at) == at:
            edits.setdefault(state.uri(at), {})[TextEdit(state.range(span), new)] = None
    return {uri: list(some) for uri, some in edits.items()}


def _in_cmake(name: ir.TypeName, path: Path, report: Report, state: ServerState) -> Iterator[Span]:
    """Yield the spans in which a package's CMakeLists.txt names an interface file."""
    cmake = path.parent.parent / BUILD
    root = Root(cmake.parent, state.documents.texts())
    if not root.is_file(cmake):
        return
    source = root.read_source(cmake, str(cmake), report)
    pattern = re.compile(rf"(?<![\w/]){name.kind}/({re.escape(name.name)})\.{name.kind}(?![.-]?\w)")
    for place in (place for call in calls(source) for place in call.places) if source else ():
        if match := pattern.search(place.text):
            yield Span(place.source, place.start + match.start(1), place.start + match.end(1))


def _answer(
    edits: Mapping[str, list[TextEdit]],
    move: Move | None,
    title: str,
    changes: Iterable[Change] | None,
    context: InterfaceContext,
    state: ServerState,
) -> dict[str, object]:
    """Return the edits, annotated with what they break, which the user sees before applying."""
    what, is_broken = _what_breaks(changes, context, state)
    support = ("workspace", "workspaceEdit")
    if not (
        state.supports(*support, "changeAnnotationSupport")
        and state.supports(*support, "documentChanges")
    ):
        state.notify("window/showMessage", {"type": 2, "message": f"{title}: {what}"})
        if move is None:
            return of_documents(edits, state)
        return {"documentChanges": [*(document_edit(*item, state) for item in edits.items()), move]}
    marked = (
        document_edit(
            uri, (AnnotatedTextEdit(e.range, e.new_text, _ANNOTATION) for e in some), state
        )
        for uri, some in edits.items()
    )
    moves = [msgspec.structs.replace(move, annotation_id=_ANNOTATION)] if move else []
    note = {"label": title, "description": what, "needsConfirmation": is_broken}
    return {"documentChanges": [*marked, *moves], "changeAnnotations": {_ANNOTATION: note}}


def _what_breaks(
    changes: Iterable[Change] | None, context: InterfaceContext, state: ServerState
) -> tuple[str, bool]:
    """Return a sentence on what a rename breaks, and whether it breaks anything."""
    if changes is None:
        return "there are errors, so idlc cannot say what this breaks", True
    broken = {level for change in changes for level in change.levels}
    levels = ", ".join(level for level in LEVELS if level in broken)
    if not levels:
        return "breaks nothing that is sent", False
    name = context.interface.name
    holders: dict[ir.TypeName, set[ir.TypeName]] = {}
    for snapshot, span, target in uses(state):
        holder = snapshot.interfaces[snapshot.path_of(span.source)][0].name
        holders.setdefault(target, set()).add(holder)
    direct = sorted(map(str, holders.get(name, ())))
    what = f"breaks {levels} for whoever uses `{name}`"
    what += f": {first_few(direct, NAMED)}" if direct else ""
    if "hash" in broken and context.snapshot.library.distro.has_hashes:
        reached = {name}
        waiting = [name]
        while waiting:
            new = holders.get(waiting.pop(), set()) - reached
            reached |= new
            waiting += new
        what += f"; changes the type hash of {counted(len(reached), 'interface')}"
    return what, True
