"""Texts above lines: hash, users and defaults of a file, and what its changes break."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from idlc.compare.changes import LEVELS
from idlc.compare.packages import compare
from idlc.diagnostics.report import first_few
from idlc.diagnostics.terminal import counted
from idlc.editor.elements import elements, users
from idlc.editor.protocol.parts import Action, Lens, OfDocument, OfRange, Part, Position, Range
from idlc.editor.state import Known, ServerState
from idlc.model import derive, ir
from idlc.model.ir import spell_value
from idlc.wire.layout import layout

if TYPE_CHECKING:
    from idlc.compare.breaking import Earlier


class Hint(Part, frozen=True):
    """A text that stands in a line without being in it."""

    position: Position
    label: str
    tooltip: str
    padding_left: bool


def hints(state: ServerState, asked: OfRange) -> list[Hint]:
    """Return the hints in a range; none where the file has errors."""
    known = state.known(asked.text_document.uri) if state.settings.inlay_hints else None
    model = known.snapshot.model_of(known.interface) if known else None
    if known is None or model is None:
        return []
    low = state.offset(known.source, asked.range.start)
    high = state.offset(known.source, asked.range.end)
    found = []
    placed = {}
    for one in elements(known.source, known.interface):
        if not low <= one.name.end <= high:
            continue
        name = one.message.name
        if name not in placed:
            fields, _ = layout(one.message, model.messages)
            placed[name] = {id(each.field): each for each in fields}
        here = placed[name].get(id(one.meaning))
        if here is not None:
            text = f"@{here.offset}, {here.size} B"
            tip = f"{here.size.in_bytes} at offset {here.offset} of the message, header not counted"
            found.append(Hint(state.range(one.name).end, text, tip, True))
    return found


_TOP = Range(Position(0, 0), Position(0, 0))
_HASH, _USERS, _BREAKS = "hash", "users", "breaks"
#: Defaults that a lens tells.
MOST_DEFAULTS = 5
#: Letters of a default that it tells.
MOST_LETTERS = 40


def lenses(state: ServerState, asked: OfDocument) -> list[Lens]:
    """Return the lenses of a file; what they say is found out when they are shown."""
    known = state.known(asked.text_document.uri) if state.settings.code_lens else None
    if known is None:
        return []
    kinds = [_HASH] if known.snapshot.library.distro.has_hashes else []
    kinds += [_USERS] if known.interface.name.kind == "msg" else []
    kinds += [_BREAKS] if _earlier(known, state) else []
    found = [Lens(_TOP, data=[asked.text_document.uri, kind]) for kind in kinds]
    return [*found, *(_defaults(known, state) if state.settings.default_lens else ())]


def resolve(state: ServerState, asked: Lens) -> Lens:
    """Return a lens with what it says."""
    if asked.command is not None:
        return asked
    uri, kind = asked.data
    return Lens(asked.range, Action(_text(state, uri, kind), ""), asked.data)


def _defaults(known: Known, state: ServerState) -> Iterator[Lens]:
    """Yield a lens above the first default of each section, which tells all of them."""
    for section in derive.sections(known.interface):
        given = [one for one in section.fields if one.default and one.name_span]
        if given:
            texts = (_default(one, section) for one in given)
            assert given[0].name_span is not None
            place = state.range(given[0].name_span).start
            says = Action(f"defaults: {first_few(texts, MOST_DEFAULTS)}", "")
            yield Lens(Range(Position(place.line, 0), Position(place.line, 0)), says)


def _default(field: ir.Field, section: ir.Message) -> str:
    """Return a field with its default, and which constant that is if it can be only one."""
    assert field.default is not None
    value = field.default.value
    same = [one for one in section.constants if (one.type, one.value) == (field.type, value)]
    own = [one for one in same if one.name.lower().startswith(f"{field.name}_")]
    named = own or same
    text = named[0].name if len(named) == 1 else spell_value(value)
    return f"{field.name} {text if len(text) <= MOST_LETTERS else text[:MOST_LETTERS] + '…'}"


def _text(state: ServerState, uri: str, kind: str) -> str:
    known = state.known(uri)
    if known is None:
        return ""
    name = known.interface.name
    if kind == _USERS:
        return counted(len(list(users(name, known.snapshot, state))), "use")
    if kind == _BREAKS:
        return _what_breaks(known, state)
    model = known.snapshot.model_of(known.interface)
    return model.describer.hash(str(name)) if model else "no type hash: there are errors"


def _earlier(known: Known, state: ServerState) -> Earlier | None:
    """Return what a file's folder is compared with, if settings name something."""
    workspace = state.workspace_of(known.snapshot.path_of(known.source))
    found = workspace.earlier(state.settings.against) if workspace else None
    return found if found and found.name else None


def _what_breaks(known: Known, state: ServerState) -> str:
    """Return what the changes of a file break against the version of the settings."""
    interface, earlier = known.interface, _earlier(known, state)
    workspace = state.workspace_of(known.snapshot.path_of(known.source))
    if earlier is None or workspace is None:
        return ""
    state.follow_git(workspace.folder, earlier.repository)
    side = workspace.before(state.settings.against)
    before = side.models.get(interface.name.package)
    after = known.snapshot.model_of(interface)
    if after is None:
        return ""
    if interface.name in side.broken:
        return f"not compared: there are errors in {earlier.name}"
    if side.error and not side.models:
        return f"not compared: {side.error}"
    if before is None or interface.name not in {one.name for one in before.own}:
        return f"nothing to compare with in {earlier.name}"
    name = {interface.name}
    changes = compare(before.only(name), after.only(name)).changes
    broken = {level for change in earlier.not_allowed(changes) for level in change.levels}
    if not broken:
        return f"breaks nothing against {earlier.name}"
    count = len(
        {
            snapshot.path_of(span.source)
            for snapshot, span in users(interface.name, known.snapshot, state)
        }
    )
    levels = ", ".join(level for level in LEVELS if level in broken)
    return f"breaks: {levels} for {counted(count, 'user')} against {earlier.name}"
