"""Texts above lines: hash, users and defaults of a file, and what its changes break."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from idlc.compare.changes import LEVELS
from idlc.compare.packages import compare
from idlc.diagnostics.report import first_few
from idlc.diagnostics.terminal import counted
from idlc.editor.elements import elements, users
from idlc.editor.protocol.parts import (
    Action,
    DocumentParams,
    Lens,
    Part,
    Position,
    Range,
    RangeParams,
)
from idlc.editor.state import InterfaceContext, ServerState
from idlc.model import derive, ir
from idlc.model.ir import spell_value
from idlc.wire.layout import layout

if TYPE_CHECKING:
    from idlc.compare.breaking import Baseline


class Hint(Part, frozen=True):
    """A text that the editor shows in a line and that is not part of the document."""

    position: Position
    label: str
    tooltip: str
    padding_left: bool


def hints(state: ServerState, params: RangeParams) -> list[Hint]:
    """Return the hints in a range; none where the file has errors."""
    context = state.context(params.text_document.uri) if state.settings.inlay_hints else None
    model = context.snapshot.model_of(context.interface) if context else None
    if context is None or model is None:
        return []
    low = state.offset(context.source, params.range.start)
    high = state.offset(context.source, params.range.end)
    shown = []
    placed = {}
    for element in elements(context.source, context.interface):
        if not low <= element.name.end <= high:
            continue
        name = element.message.name
        if name not in placed:
            fields, _ = layout(element.message, model.messages)
            placed[name] = {id(each.field): each for each in fields}
        placed_field = placed[name].get(id(element.meaning))
        if placed_field is not None:
            text = f"@{placed_field.offset}, {placed_field.size} B"
            size, offset = placed_field.size.in_bytes, placed_field.offset
            tip = f"{size} at offset {offset} of the message, header not counted"
            shown.append(Hint(state.range(element.name).end, text, tip, True))
    return shown


_TOP = Range(Position(0, 0), Position(0, 0))
_HASH, _USERS, _BREAKS = "hash", "users", "breaks"
#: Defaults that a lens lists.
MOST_DEFAULTS = 5
#: Letters that it shows of a default.
MOST_LETTERS = 40


def lenses(state: ServerState, params: DocumentParams) -> list[Lens]:
    """Return the lenses of a file; `resolve` computes their texts when they are shown."""
    context = state.context(params.text_document.uri) if state.settings.code_lens else None
    if context is None:
        return []
    kinds = [_HASH] if context.snapshot.library.distro.has_hashes else []
    kinds += [_USERS] if context.interface.name.kind == "msg" else []
    kinds += [_BREAKS] if _baseline(context, state) else []
    of_file = [Lens(_TOP, data=[params.text_document.uri, kind]) for kind in kinds]
    return [*of_file, *(_defaults(context, state) if state.settings.default_lens else ())]


def resolve(state: ServerState, lens: Lens) -> Lens:
    """Return a lens with its text."""
    if lens.command is not None:
        return lens
    uri, kind = lens.data
    return Lens(lens.range, Action(_text(state, uri, kind), ""), lens.data)


def _defaults(context: InterfaceContext, state: ServerState) -> Iterator[Lens]:
    """Yield a lens above the first default of each section, which lists all of them."""
    for section in derive.sections(context.interface):
        with_default = [field for field in section.fields if field.default and field.name_span]
        if with_default:
            texts = (_default(field, section) for field in with_default)
            assert with_default[0].name_span is not None
            place = state.range(with_default[0].name_span).start
            says = Action(f"defaults: {first_few(texts, MOST_DEFAULTS)}", "")
            yield Lens(Range(Position(place.line, 0), Position(place.line, 0)), says)


def _default(field: ir.Field, section: ir.Message) -> str:
    """Return a field with its default, by the name of a constant if only one has that value."""
    assert field.default is not None
    value = field.default.value
    same = [
        constant
        for constant in section.constants
        if (constant.type, constant.value) == (field.type, value)
    ]
    own = [constant for constant in same if constant.name.lower().startswith(f"{field.name}_")]
    named = own or same
    text = named[0].name if len(named) == 1 else spell_value(value)
    return f"{field.name} {text if len(text) <= MOST_LETTERS else text[:MOST_LETTERS] + '…'}"


def _text(state: ServerState, uri: str, kind: str) -> str:
    context = state.context(uri)
    if context is None:
        return ""
    name = context.interface.name
    if kind == _USERS:
        return counted(len(list(users(name, context.snapshot, state))), "use")
    if kind == _BREAKS:
        return _what_breaks(context, state)
    model = context.snapshot.model_of(context.interface)
    return model.describer.hash(str(name)) if model else "no type hash: there are errors"


def _baseline(context: InterfaceContext, state: ServerState) -> Baseline | None:
    """Return the version that a file's folder is compared with, if settings name one."""
    workspace = state.workspace_of(context.snapshot.path_of(context.source))
    baseline = workspace.baseline(state.settings.against) if workspace else None
    return baseline if baseline and baseline.name else None


def _what_breaks(context: InterfaceContext, state: ServerState) -> str:
    """Return a sentence on what a file's changes break against the version of the settings."""
    interface, baseline = context.interface, _baseline(context, state)
    workspace = state.workspace_of(context.snapshot.path_of(context.source))
    if baseline is None or workspace is None:
        return ""
    state.follow_git(workspace.folder, baseline.repository)
    side = workspace.before(state.settings.against)
    before = side.models.get(interface.name.package)
    after = context.snapshot.model_of(interface)
    if after is None:
        return ""
    if interface.name in side.broken:
        return f"not compared: there are errors in {baseline.name}"
    if side.error and not side.models:
        return f"not compared: {side.error}"
    if before is None or interface.name not in {own.name for own in before.own}:
        return f"nothing to compare with in {baseline.name}"
    name = {interface.name}
    changes = compare(before.only(name), after.only(name)).changes
    broken = {level for change in baseline.not_allowed(changes) for level in change.levels}
    if not broken:
        return f"breaks nothing against {baseline.name}"
    count = len(
        {
            snapshot.path_of(span.source)
            for snapshot, span in users(interface.name, context.snapshot, state)
        }
    )
    levels = ", ".join(level for level in LEVELS if level in broken)
    return f"breaks: {levels} for {counted(count, 'user')} against {baseline.name}"
