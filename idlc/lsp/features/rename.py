"""Other names for fields, constants and interfaces, with all that uses them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec

from idlc.breaking.change import LEVELS, Change
from idlc.breaking.packages import called, compare
from idlc.diagnostics.edits import apply
from idlc.diagnostics.report import Edit, Report, first_few
from idlc.diagnostics.source import Span
from idlc.disk.read import is_file
from idlc.driver.workspace import State
from idlc.lsp.elements import Element, spot
from idlc.lsp.features.navigation import mentions
from idlc.lsp.protocol import uris
from idlc.lsp.protocol.errors import REQUEST_FAILED, RequestError
from idlc.lsp.protocol.parts import AskedFileRenames, AskedRename, AtPosition, Part, Range, TextEdit
from idlc.lsp.users import users
from idlc.lsp.world import Known, World
from idlc.model import ir, names

#: Users that a warning names.
NAMED = 5
_ANNOTATION = "idlc.rename"


class Renamed(Part, frozen=True):
    """What would be renamed."""

    range: Range
    placeholder: str


class FileEdits(msgspec.Struct):
    """Edits by URI, and what is renamed after them."""

    edits: dict[str, list[TextEdit]]
    moves: list[tuple[str, str]] = []


def prepare(world: World, asked: AtPosition) -> Renamed | None:
    """Return the name at a position, `None` if it is none of this workspace's."""
    known = world.known(asked.text_document.uri)
    found = spot(world, known, asked.position) if known else None
    if known is None or found is None:
        return None
    if found.part == "name" and found.element.meaning is not None:
        return Renamed(world.range(found.span), found.span.text)
    target = found.element.target
    if found.part == "type" and target is not None and _home(target, world):
        span = _last(found.element.type)
        return Renamed(world.range(span), span.text)
    return None


def _last(span: Span) -> Span:
    """Return a type's name without its package."""
    return span.at(span.text.rfind("/") + 1, len(span.text))


def _home(name: ir.TypeName, world: World) -> Known | None:
    """Return an interface whose file is one of the workspace's."""
    for project in world.projects.all():
        state = project.state(world.documents)
        for interface, source in state.interfaces.values() if state else ():
            if interface.name == name:
                assert state is not None
                return Known(state, interface, source)
    return None


def rename(world: World, asked: AskedRename) -> dict[str, object]:
    """Return the edits that rename what stands at a position, and say what they break."""
    known = world.known(asked.text_document.uri)
    found = spot(world, known, asked.position) if known else None
    if known is None or found is None or prepare(world, asked) is None:
        raise RequestError(REQUEST_FAILED, "there is no name of this workspace here")
    if found.part == "type":
        target = found.element.target
        home = _home(target, world) if target else None
        assert home is not None
        return _rename_interface(home, asked.new_name, world)
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
    found = FileEdits({uri: [TextEdit(world.range(one.span), one.text) for one in edits]})
    changes = _changes(known, apply(known.source.text, edits)[0], world)
    old = element.body.name.text
    return _answer(found, f"Rename {old} to {new}", changes, known.interface.name, world)


def _changes(known: Known, text: str, world: World) -> Iterable[Change]:
    """Return what another text for a file breaks, where both versions are sound."""
    path = known.state.path_of(known.source)
    project = world.projects.of(path)
    after = project.workspace.state_with(path, text) if project else None
    interface = after.interfaces[path][0] if after and path in after.interfaces else None
    if after is None or interface is None:
        return ()
    old, new = known.state.model_of(known.interface), after.model_of(interface)
    name = {interface.name}
    return compare(old.only(name), new.only(name)).changes if old and new else ()


def _rename_interface(home: Known, new: str, world: World) -> dict[str, object]:
    """Return the edits for another name of a message, with the renaming of its file."""
    old = home.interface.name
    path = home.state.path_of(home.source)
    target = path.with_name(f"{new}.{old.kind}")
    if not names.is_message_name(new):
        raise RequestError(REQUEST_FAILED, f"`{new}` cannot be such a name: {names.MESSAGE_HINT}")
    if new != old.name and (is_file(target) or world.documents.at(target)):
        raise RequestError(REQUEST_FAILED, f"there is a `{target.name}` already")
    if not world.supports("workspace", "workspaceEdit", "documentChanges"):
        raise RequestError(REQUEST_FAILED, "this editor cannot rename files")
    found = FileEdits(_edits_of_users(old, new, path, world))
    found.moves.append((world.uri(path), uris.from_path(target)))
    renamed = msgspec.structs.replace(home.interface, name=old._replace(name=new))
    title = f"Rename {old.name} to {new}"
    return _answer(found, title, [called(home.interface, renamed)], old, world)


def files(world: World, asked: AskedFileRenames) -> dict[str, object] | None:
    """Return the edits that follow from interface files getting other names."""
    edits: dict[str, list[TextEdit]] = {}
    for one in asked.files:
        old, new = uris.to_path(one.old_uri), uris.to_path(one.new_uri)
        known = world.known(one.old_uri)
        if old and new and known and old.parent == new.parent and old.suffix == new.suffix:
            name = known.interface.name
            for uri, some in _edits_of_users(name, new.stem, old, world).items():
                edits.setdefault(uri, []).extend(some)
    return _document_changes(FileEdits(edits), None, world) if edits else None


def _edits_of_users(
    old: ir.TypeName, new: str, path: Path, world: World
) -> dict[str, list[TextEdit]]:
    """Return the edits of all files that name an interface: its users, and CMakeLists.txt."""
    edits: dict[str, list[TextEdit]] = {}
    for state, span in users(old, world):
        uri = world.uri(state.path_of(span.source))
        edits.setdefault(uri, []).append(TextEdit(world.range(_last(span)), new))
    for span in _in_cmake(old, path, world):
        uri = world.uri(Path(span.source.path))
        edits.setdefault(uri, []).append(TextEdit(world.range(span), new))
    return edits


def _in_cmake(name: ir.TypeName, path: Path, world: World) -> Iterator[Span]:
    """Yield where CMakeLists.txt of a package names an interface file."""
    cmake = path.parent.parent / "CMakeLists.txt"
    if not is_file(cmake):
        return
    source = world.documents.unsaved().read_source(cmake, str(cmake), Report())
    pattern = rf"(?<![\w/]){name.kind}/({re.escape(name.name)})\.{name.kind}(?!\w)"
    for match in re.finditer(pattern, source.text) if source else ():
        assert source is not None
        yield Span(source, *match.span(1))


def _answer(
    found: FileEdits, title: str, changes: Iterable[Change], name: ir.TypeName, world: World
) -> dict[str, object]:
    """Return the edits, which say what they break before anybody makes them."""
    broken = {level for one in changes for level in one.levels}
    levels = ", ".join(level for level in LEVELS if level in broken)
    used = sorted({_holder(state, span) for state, span in users(name, world)})
    what = f"breaks {levels} for whoever uses `{name}`" if levels else "breaks nothing that is sent"
    what += f": {first_few(used, NAMED)}" if used and levels else ""
    support = ("workspace", "workspaceEdit", "changeAnnotationSupport")
    if not (world.supports(*support) and world.supports(*support[:2], "documentChanges")):
        world.tell("window/showMessage", {"type": 2, "message": f"{title}: {what}"})
        return _document_changes(found, None, world)
    note = {"label": title, "description": what, "needsConfirmation": bool(levels)}
    return _document_changes(found, note, world)


def _holder(state: State, span: Span) -> str:
    """Return the name of the interface in whose file a span is."""
    return str(state.interfaces[state.path_of(span.source)][0].name)


def _document_changes(
    found: FileEdits, note: dict[str, object] | None, world: World
) -> dict[str, object]:
    from idlc.lsp.edits import document_edit, of_documents

    if note is None and not found.moves:
        return of_documents(found.edits, world)
    mark = {"annotationId": _ANNOTATION} if note else {}
    changes = [
        document_edit(uri, ({"range": e.range, "newText": e.new_text, **mark} for e in some), world)
        for uri, some in found.edits.items()
    ]
    changes += [
        {"kind": "rename", "oldUri": old, "newUri": new, **mark} for old, new in found.moves
    ]
    annotations = {"changeAnnotations": {_ANNOTATION: note}} if note else {}
    return {"documentChanges": changes, **annotations}
