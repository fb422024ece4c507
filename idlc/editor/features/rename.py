"""Other names for fields, constants and interfaces, with all that uses them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import msgspec

from idlc.check.package.cmake import calls
from idlc.compare.changes import LEVELS, Change
from idlc.compare.packages import called, compare
from idlc.diagnostics.report import Edit, Report, apply, first_few
from idlc.diagnostics.source import Span
from idlc.diagnostics.terminal import counted
from idlc.editor.edits import document_edit, of_documents
from idlc.editor.elements import Element, spot
from idlc.editor.features.navigation import mentions
from idlc.editor.protocol import uris
from idlc.editor.protocol.framing import REQUEST_FAILED, RequestError
from idlc.editor.protocol.parts import (
    AskedFileRenames,
    AskedRename,
    AtPosition,
    Part,
    Range,
    TextEdit,
)
from idlc.editor.users import states, users, uses
from idlc.editor.world import Known, Renaming, World
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


class Renamed(Part, frozen=True):
    """What would be renamed."""

    range: Range
    placeholder: str


class Annotated(TextEdit, frozen=True):
    """An edit that the user is asked about."""

    annotation_id: str


class Move(Part, frozen=True, tag="rename", tag_field="kind"):
    """A file that gets another name, as an operation of a workspace edit."""

    old_uri: str
    new_uri: str
    annotation_id: str | None = None


def prepare(world: World, asked: AtPosition) -> Renamed | None:
    """Return the name at a position, `None` if it is none of this workspace's."""
    world.projects.notice_changes()  # of which a client may not have told yet
    known = world.known(asked.text_document.uri)
    found = spot(world, known, asked.position) if known else None
    if known is None or found is None:
        return None
    if found.part == "name" and found.element.meaning is not None:
        return Renamed(world.range(found.span), found.span.text)
    target = found.element.target
    if found.part == "type" and target is not None and _home(target, known, world):
        span = _last(found.element.type)
        return Renamed(world.range(span), span.text)
    return None


def _last(span: Span) -> Span:
    """Return a type's name without its package."""
    return span.at(span.text.rfind("/") + 1, len(span.text))


def can_move_files(world: World) -> bool:
    """Return whether the client renames files where an edit says so."""
    return world.supports("workspace", "workspaceEdit", "resourceOperations", "rename")


def _home(name: ir.TypeName, asking: Known, world: World) -> Known | None:
    """Return the interface that a file means by a name, if it is one of the workspace's.

    Where its folder knows it from elsewhere, as what is installed, another folder may have it.
    """
    for state in sorted(states(world), key=lambda one: one is not asking.state):
        for interface, source in state.interfaces.values():
            if interface.name == name:
                return Known(state, interface, source)
    return None


def rename(world: World, asked: AskedRename) -> dict[str, object] | None:
    """Return the edits that rename what stands at a position, and say what they break."""
    world.projects.forget()
    known = world.known(asked.text_document.uri)
    found = spot(world, known, asked.position) if known else None
    if known is None or found is None or prepare(world, asked) is None:
        raise RequestError(REQUEST_FAILED, "there is no name of this workspace here")
    if found.part == "type":
        target = found.element.target
        home = _home(target, known, world) if target else None
        assert home is not None
        return rename_interface(home, asked.text_document.uri, asked.new_name, known, world)
    return _rename_definition(found.element, known, asked.new_name, world)


def _rename_definition(element: Element, known: Known, new: str, world: World) -> dict[str, object]:
    is_constant = isinstance(element.meaning, ir.Constant)
    valid = names.is_constant_name(new) if is_constant else names.is_field_name(new)
    if not valid:
        hint = names.CONSTANT_HINT if is_constant else names.FIELD_HINT
        raise RequestError(REQUEST_FAILED, f"`{new}` cannot be such a name: {hint}")
    others = element.message.constants if is_constant else element.message.fields
    if any(one.name == new and one is not element.meaning for one in others):
        raise RequestError(REQUEST_FAILED, f"there is a `{new}` already")
    edits = [Edit(span, new) for span in mentions(element, known)]
    uri = world.uri(known.state.path_of(known.source))
    changed = {uri: [TextEdit(world.range(one.span), one.text) for one in edits]}
    changes = _changes(known, apply(known.source.text, edits)[0], world)
    title = f"Rename {element.body.name.text} to {new}"
    return _answer(changed, None, title, changes, known, world)


def _changes(known: Known, text: str, world: World) -> Iterable[Change] | None:
    """Return what another text for a file breaks, `None` if one of the versions has errors."""
    path = known.state.path_of(known.source)
    project = world.projects.of(path)
    after = project.workspace.state_with(path, text) if project else None
    interface = after.interfaces[path][0] if after and path in after.interfaces else None
    if after is None or interface is None:
        return None
    old, new = known.state.model_of(known.interface), after.model_of(interface)
    name = {interface.name}
    return compare(old.only(name), new.only(name)).changes if old and new else None


def rename_interface(
    home: Known, uri: str, new: str, asking: Known, world: World
) -> dict[str, object] | None:
    """Return the edits for another name of an interface, with the renaming of its file.

    It was asked for in the document `uri`, which `asking` is about.
    """
    old = home.interface.name
    path = home.state.path_of(home.source)
    if not names.is_message_name(new):
        raise RequestError(REQUEST_FAILED, f"`{new}` cannot be such a name: {names.MESSAGE_HINT}")
    target = path.with_name(f"{new}.{old.kind}")
    if len(target.name) > LONGEST_NAME:
        raise RequestError(REQUEST_FAILED, f"no file can have a name of {len(target.name)} letters")
    if new == old.name:
        return None
    if os.path.lexists(target) or world.documents.at(target):
        raise RequestError(REQUEST_FAILED, f"there is a `{target.name}` already")
    if not is_file(path):
        raise RequestError(REQUEST_FAILED, f"save `{path.name}` first: there is no file to rename")
    if not can_move_files(world):
        raise RequestError(REQUEST_FAILED, _CANNOT_MOVE)
    report = Report()
    edits = _edits_of_users(home, new, report, world)
    if problem := next(iter(report), None):
        raise RequestError(REQUEST_FAILED, f"nothing is renamed: {BUILD}: {problem.message}")
    here = world.path(uri)
    used = users(old, home.state, world)
    spans = (_last(one) for state, one in used if state.path_of(one.source) == here)
    own = dict.fromkeys(Edit(Span(asking.source, one.start, one.end), new) for one in spans)
    world.renaming = Renaming(path, target, uri, apply(asking.source.text, list(own))[0])
    move = Move(world.uri(path), uris.from_path(target))
    renamed = msgspec.structs.replace(home.interface, name=old._replace(name=new))
    changes = [called(home.interface, renamed)]
    return _answer(edits, move, f"Rename {old.name} to {new}", changes, home, world)


def files(world: World, asked: AskedFileRenames) -> dict[str, object] | None:
    """Return the edits that follow from interface files getting other names.

    Some clients also ask this about a file that an answer of `rename` has them move. Documents
    that are open have the edits of that answer by then. What else it edits may be in buffers that
    the client does not tell of, so it is not edited again.
    """
    world.projects.forget()
    edits: dict[str, list[TextEdit]] = {}
    report = Report()
    for one in {each.old_uri: each for each in asked.files}.values():
        old, new = uris.to_path(one.old_uri), uris.to_path(one.new_uri)
        known = world.known(one.old_uri)
        if not (old and new and known and _is_other_name(old, new)):
            continue
        is_own = world.renaming is not None and _is_under_way(world.renaming, old, new, world)
        found = _edits_of_users(known, new.stem, report, world)
        for uri, some in found.items():
            if not is_own or world.documents.get(uri):
                edits.setdefault(uri, []).extend(some)
    for problem in report:
        world.tell(
            "window/showMessage", {"type": 2, "message": f"{BUILD} is left: {problem.message}"}
        )
    return of_documents(edits, world) if edits else None


def _is_other_name(old: Path, new: Path) -> bool:
    """Return whether a file gets another name by which an interface can be called."""
    is_valid = names.is_message_name(new.stem)
    return is_valid and old.parent == new.parent and old.suffix == new.suffix


def _is_under_way(renaming: Renaming, old: Path, new: Path, world: World) -> bool:
    """Return whether the client makes the edits of an answer, and now moves this file for it."""
    if (renaming.old, renaming.new) != (old, new):
        return False
    known = world.known(renaming.uri)
    return known is not None and known.source.text == renaming.text


def _edits_of_users(
    known: Known, new: str, report: Report, world: World
) -> dict[str, list[TextEdit]]:
    """Return the edits of all files that name an interface: its users, and CMakeLists.txt.

    Two folders may hold the same file, also by a link: it is edited once, where it is open.
    """
    old, path = known.interface.name, known.state.path_of(known.source)
    used = users(old, known.state, world)
    places = [(state.path_of(span.source), _last(span)) for state, span in used]
    places += [(Path(span.source.path), span) for span in _in_cmake(old, path, report, world)]
    places.sort(key=lambda place: world.documents.at(place[0]) is None)
    edited: dict[Path, Path] = {}
    edits: dict[str, dict[TextEdit, None]] = {}
    for at, span in places:
        if edited.setdefault(at.resolve(), at) == at:
            edits.setdefault(world.uri(at), {})[TextEdit(world.range(span), new)] = None
    return {uri: list(some) for uri, some in edits.items()}


def _in_cmake(name: ir.TypeName, path: Path, report: Report, world: World) -> Iterator[Span]:
    """Yield where CMakeLists.txt of a package names an interface file."""
    cmake = path.parent.parent / BUILD
    root = Root(cmake.parent, world.documents.texts())
    if not root.is_file(cmake):
        return
    source = root.read_source(cmake, str(cmake), report)
    pattern = re.compile(rf"(?<![\w/]){name.kind}/({re.escape(name.name)})\.{name.kind}(?![.-]?\w)")
    for place in (place for one in calls(source) for place in one.places) if source else ():
        if match := pattern.search(place.text):
            yield Span(place.source, place.start + match.start(1), place.start + match.end(1))


def _answer(
    edits: Mapping[str, list[TextEdit]],
    move: Move | None,
    title: str,
    changes: Iterable[Change] | None,
    known: Known,
    world: World,
) -> dict[str, object]:
    """Return the edits, which say what they break before anybody makes them."""
    what, is_broken = _what_breaks(changes, known, world)
    support = ("workspace", "workspaceEdit")
    if not (
        world.supports(*support, "changeAnnotationSupport")
        and world.supports(*support, "documentChanges")
    ):
        world.tell("window/showMessage", {"type": 2, "message": f"{title}: {what}"})
        if move is None:
            return of_documents(edits, world)
        return {"documentChanges": [*(document_edit(*one, world) for one in edits.items()), move]}
    marked = (
        document_edit(uri, (Annotated(e.range, e.new_text, _ANNOTATION) for e in some), world)
        for uri, some in edits.items()
    )
    moves = [msgspec.structs.replace(move, annotation_id=_ANNOTATION)] if move else []
    note = {"label": title, "description": what, "needsConfirmation": is_broken}
    return {"documentChanges": [*marked, *moves], "changeAnnotations": {_ANNOTATION: note}}


def _what_breaks(changes: Iterable[Change] | None, known: Known, world: World) -> tuple[str, bool]:
    """Return what a rename breaks, in words, and whether it breaks something."""
    if changes is None:
        return "there are errors, so idlc cannot say what this breaks", True
    broken = {level for one in changes for level in one.levels}
    levels = ", ".join(level for level in LEVELS if level in broken)
    if not levels:
        return "breaks nothing that is sent", False
    name = known.interface.name
    holders: dict[ir.TypeName, set[ir.TypeName]] = {}
    for state, span, target in uses(world):
        holder = state.interfaces[state.path_of(span.source)][0].name
        holders.setdefault(target, set()).add(holder)
    direct = sorted(map(str, holders.get(name, ())))
    what = f"breaks {levels} for whoever uses `{name}`"
    what += f": {first_few(direct, NAMED)}" if direct else ""
    if "hash" in broken and known.state.library.distro.has_hashes:
        reached = {name}
        waiting = [name]
        while waiting:
            new = holders.get(waiting.pop(), set()) - reached
            reached |= new
            waiting += new
        what += f"; changes the type hash of {counted(len(reached), 'interface')}"
    return what, True
