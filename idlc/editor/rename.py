"""Renaming fields, constants and interfaces, with everything that uses them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import msgspec

from idlc.diagnostics.report import Edit, Report, apply, first_few
from idlc.diagnostics.source import Span
from idlc.diagnostics.terminal import counted
from idlc.editor.documents import to_path
from idlc.editor.elements import Declaration, by_uri, spot_at, users, uses, workspace_edit
from idlc.editor.navigation import mentions
from idlc.editor.parts import PositionParams, RenameFilesParams, RenameParams, TextEdit
from idlc.editor.protocol import REQUEST_FAILED, RequestError
from idlc.editor.state import InterfaceContext, Renaming, ServerState
from idlc.model import derive, ir, names
from idlc.packaging.cmake import calls
from idlc.packaging.files import CMAKE_LISTS
from idlc.project.files import is_file
from idlc.project.root import Root
from idlc.versions.changes import Change, levels_of
from idlc.versions.packages import compare, renamed_interface

#: The file that lists the interface files of a package.
#: Letters of the longest name that a file can have on usual disks.
LONGEST_NAME = 255
#: Users that a warning names.
NAMED = 5
_CANNOT_MOVE = (
    "renaming a message renames its file, which this editor does not support; "
    "in Emacs, install rosmsg-mode.el (see docs/editors.md)"
)


def prepare(state: ServerState, params: PositionParams) -> dict[str, object] | None:
    """Return the name at a position, `None` if it is none of this workspace's."""
    state.notice_changes()  # which a client may not have reported yet
    context = state.context(params.text_document.uri)
    spot = spot_at(context, params.position) if context else None
    if context is None or spot is None:
        return None
    span = None
    if spot.part == "name" and spot.element.meaning is not None:
        span = spot.span
    elif spot.part == "type" and _home(spot.element.target, context):
        span = _last(spot.element.type)
    return {"range": state.range(span), "placeholder": span.text} if span else None


def _last(span: Span) -> Span:
    """Return a type's name without its package."""
    return span.at(span.text.rfind("/") + 1, len(span.text))


def can_move_files(state: ServerState) -> bool:
    """Return whether the client renames files where an edit says so."""
    return state.supports("workspace", "workspaceEdit", "resourceOperations", "rename")


def _home(name: ir.TypeName | None, asking: InterfaceContext) -> InterfaceContext | None:
    """Return the interface that a file refers to by a name, if it is one of the workspace's.

    Where its folder finds the name elsewhere, as in an install prefix, another folder may have it.
    """
    workspaces = asking.state.workspaces()
    for workspace in sorted(workspaces, key=lambda workspace: workspace is not asking.workspace):
        snapshot = workspace.snapshot()
        for interface, source in snapshot.interfaces.values() if snapshot else ():
            if interface.name == name and snapshot:
                return InterfaceContext(asking.state, workspace, snapshot, interface, source)
    return None


def rename(state: ServerState, params: RenameParams) -> dict[str, object] | None:
    """Return the edits that rename the element at a position, annotated with what they break."""
    state.forget()
    context = state.context(params.text_document.uri)
    spot = spot_at(context, params.position) if context else None
    if context is None or spot is None or prepare(state, params) is None:
        raise RequestError(REQUEST_FAILED, "there is no name to rename here")
    if spot.part != "type":
        return _rename_definition(spot.element, context, params.new_name)
    home = _home(spot.element.target, context)
    assert home is not None
    return rename_interface(home, params.new_name, context)


def _rename_definition(
    element: Declaration, context: InterfaceContext, new: str
) -> dict[str, object]:
    is_constant = isinstance(element.meaning, ir.Constant)
    valid = names.is_constant_name(new) if is_constant else names.is_field_name(new)
    if not valid:
        hint = names.CONSTANT_HINT if is_constant else names.FIELD_HINT
        raise RequestError(REQUEST_FAILED, f"`{new}` is not a valid name: {hint}")
    siblings = element.message.constants if is_constant else element.message.fields
    if any(definition.name == new and definition is not element.meaning for definition in siblings):
        raise RequestError(REQUEST_FAILED, f"`{new}` already exists")
    edits = [Edit(span, new) for span in mentions(element, context)]
    name, path = context.interface.name, context.path
    after = context.workspace.snapshot_with(path, apply(context.source.text, edits)[0])
    changes = None  # where a version has errors
    if after is not None and path in after.interfaces:
        before, renamed = context.model, after.model_of(after.interfaces[path][0])
        if before and renamed:
            changes = compare(before.only({name}), renamed.only({name})).changes
    edited = by_uri(edits, context.workspace.folder, context.state)
    return _answer(edited, None, f"Rename {element.body.name.text} to {new}", changes, context)


def rename_interface(
    home: InterfaceContext, new: str, asking: InterfaceContext
) -> dict[str, object] | None:
    """Return the edits for another name of an interface, with the renaming of its file.

    The request came from the document of `asking`.
    """
    state, old, path = home.state, home.interface.name, home.path
    if not names.is_message_name(new):
        raise RequestError(REQUEST_FAILED, f"`{new}` is not a valid name: {names.MESSAGE_HINT}")
    target = path.with_name(f"{new}.{old.kind}")
    if len(target.name) > LONGEST_NAME:
        raise RequestError(REQUEST_FAILED, f"a file name of {len(target.name)} letters is too long")
    if new == old.name:
        return None
    if os.path.lexists(target) or state.document_at(target):
        raise RequestError(REQUEST_FAILED, f"`{target.name}` already exists")
    if not is_file(path):
        raise RequestError(REQUEST_FAILED, f"save `{path.name}` first: there is no file to rename")
    if not can_move_files(state):
        raise RequestError(REQUEST_FAILED, _CANNOT_MOVE)
    report = Report()
    edits = _edits_of_users(home, new, report)
    if problem := next(iter(report), None):
        raise RequestError(
            REQUEST_FAILED, f"idlc renamed nothing: {CMAKE_LISTS}: {problem.message}"
        )
    used = users(old, home.snapshot, state)
    spans = (_last(span) for snapshot, span in used if snapshot.path_of(span.source) == asking.path)
    own = dict.fromkeys(Edit(Span(asking.source, span.start, span.end), new) for span in spans)
    after = apply(asking.source.text, list(own))[0]
    state.renaming = Renaming(path, target, state.uri(asking.path), after)
    move = {"oldUri": state.uri(path), "newUri": target.as_uri()}
    renamed = msgspec.structs.replace(home.interface, name=old._replace(name=new))
    changes = [renamed_interface(home.interface, renamed)]
    return _answer(edits, move, f"Rename {old.name} to {new}", changes, home)


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
        old, new = to_path(file.old_uri), to_path(file.new_uri)
        context = state.context(file.old_uri)
        if not (old and new and context and names.is_message_name(new.stem)):
            continue
        if old.parent != new.parent or old.suffix != new.suffix:
            continue
        renaming, is_own = state.renaming, False
        if renaming is not None and (renaming.old, renaming.new) == (old, new):
            asking = state.context(renaming.uri)
            is_own = asking is not None and asking.source.text == renaming.text
        for uri, some in _edits_of_users(context, new.stem, report).items():
            if not is_own or uri in state.documents:
                edits.setdefault(uri, []).extend(some)
    for problem in report:
        message = f"idlc did not edit {CMAKE_LISTS}: {problem.message}"
        state.notify("window/showMessage", {"type": 2, "message": message})
    return workspace_edit(edits, state) if edits else None


def _edits_of_users(
    context: InterfaceContext, new: str, report: Report
) -> dict[str, list[TextEdit]]:
    """Return the edits of all files that name an interface: its users, and CMakeLists.txt.

    Two folders may hold the same file, also by a link: it is edited once, where it is open.
    """
    state, old = context.state, context.interface.name
    used = users(old, context.snapshot, state)
    places = [(snapshot.path_of(span.source), _last(span)) for snapshot, span in used]
    places += [(Path(span.source.path), span) for span in _in_cmake(context, report)]
    places.sort(key=lambda place: state.document_at(place[0]) is None)
    edited: dict[Path, Path] = {}
    edits: dict[str, dict[TextEdit, None]] = {}
    for at, span in places:
        if edited.setdefault(at.resolve(), at) == at:
            edits.setdefault(state.uri(at), {})[TextEdit(state.range(span), new)] = None
    return {uri: list(some) for uri, some in edits.items()}


def _in_cmake(context: InterfaceContext, report: Report) -> Iterator[Span]:
    """Yield the spans in which a package's CMakeLists.txt names an interface file."""
    name, cmake = context.interface.name, context.path.parent.parent / CMAKE_LISTS
    root = Root(cmake.parent, context.state.texts())
    if not root.is_file(cmake):
        return
    source = root.read_source(cmake, str(cmake), report)
    pattern = re.compile(rf"(?<![\w/]){name.kind}/({re.escape(name.name)})\.{name.kind}(?![.-]?\w)")
    for place in (place for call in calls(source) for place in call.places) if source else ():
        if match := pattern.search(place.text):
            yield Span(place.source, place.start + match.start(1), place.start + match.end(1))


def _answer(
    edits: Mapping[str, list[TextEdit]],
    move: Mapping[str, str] | None,
    title: str,
    changes: Iterable[Change] | None,
    context: InterfaceContext,
) -> dict[str, object]:
    """Return the edits, annotated with what they break, which the user sees before applying."""
    state = context.state
    what, is_broken = _what_breaks(changes, context)
    capabilities = ("changeAnnotationSupport", "documentChanges")
    if all(state.supports("workspace", "workspaceEdit", name) for name in capabilities):
        note = {"label": title, "description": what, "needsConfirmation": is_broken}
        return workspace_edit(edits, state, move, note)
    state.notify("window/showMessage", {"type": 2, "message": f"{title}: {what}"})
    return workspace_edit(edits, state, move)


def _what_breaks(changes: Iterable[Change] | None, context: InterfaceContext) -> tuple[str, bool]:
    """Return a sentence on what a rename breaks, and whether it breaks anything."""
    if changes is None:
        return "because of errors, idlc cannot determine what this breaks", True
    levels = levels_of(changes)
    if not levels:
        return "no effect on sent messages", False
    name = context.interface.name
    holders: dict[ir.TypeName, set[ir.TypeName]] = {}
    for snapshot, span, target in uses(context.state):
        holder = snapshot.interfaces[snapshot.path_of(span.source)][0].name
        holders.setdefault(target, set()).add(holder)
    direct = sorted(map(str, holders.get(name, ())))
    what = f"breaks {levels} for users of `{name}`"
    what += f": {first_few(direct, NAMED)}" if direct else ""
    if "hash" in levels and context.snapshot.library.distro.has_hashes:
        reached = derive.closure([name], lambda held: holders.get(held, ()))
        what += f"; changes the type hash of {counted(len(reached), 'interface')}"
    return what, True
