"""Descriptions of interfaces: hover, hints within lines, and lenses above them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from idlc.diagnostics.report import first_few
from idlc.diagnostics.terminal import counted
from idlc.editor.documents import TOP, is_built_in
from idlc.editor.elements import elements, section_names, spot_at, users
from idlc.editor.parts import DocumentParams, Lens, Position, PositionParams, Range, RangeParams
from idlc.editor.state import InterfaceContext, ServerState
from idlc.editor.workspace import Snapshot
from idlc.model import derive, ir
from idlc.model.comments import deprecation
from idlc.model.ir import is_range, spell, spell_value
from idlc.tasks.show import outline
from idlc.versions.changes import levels_of
from idlc.versions.packages import compare
from idlc.wire.layout import Placed, layout

#: Lines of a message that are shown.
MOST_LINES = 40


def markdown(paragraphs: Iterable[str]) -> dict[str, str]:
    """Return paragraphs as text for people; empty ones are left out."""
    return {"kind": "markdown", "value": "\n\n".join(filter(None, paragraphs))}


def hover(context: InterfaceContext, params: PositionParams) -> dict[str, object] | None:
    """Return the description of the element at a position; between definitions, of the file."""
    spot = spot_at(context, params.position)
    snapshot = context.snapshot
    if spot is None or spot.part == "comment":
        return {"contents": markdown(_interface(context.interface, snapshot))}
    element = spot.element
    if spot.part == "type" and element.target is not None:
        interface = snapshot.interface(element.target)
        if interface is None:
            return None
        text = markdown(_interface(interface, snapshot))
    elif element.meaning is not None:
        text = markdown(_definition(element.meaning, context))
    else:
        return None
    return {"contents": text, "range": context.state.range(spot.span)}


def _definition(meaning: ir.Field | ir.Constant, context: InterfaceContext) -> Iterator[str]:
    value = default = ""
    if isinstance(meaning, ir.Constant):
        value = f"={spell_value(meaning.value)}"
    elif meaning.default:
        default = spell_value(meaning.default.value)
        value = f" {default}"
    yield code([f"{spell(meaning.type)} {meaning.name}{value}"])
    yield "**Deprecated**" if deprecation(meaning.comment) is not None else ""
    yield prose(meaning.comment)
    facts = []
    says_range = meaning.unit is not None and is_range(meaning.unit)
    if meaning.unit:
        facts.append(f"{'range' if says_range else 'unit'}: `{meaning.unit}`")
    element = ir.element_of(meaning.type)
    if isinstance(element, ir.Primitive) and element.info.low is not None and not says_range:
        facts.append(f"range: `{element.info.low}` to `{element.info.high}`")
    if isinstance(element, ir.String) and element.bound is not None:
        facts.append(f"length: at most {element.bound} characters")
    if isinstance(meaning.type, ir.Sequence) and meaning.type.bound is not None:
        facts.append(f"elements: at most {meaning.type.bound}")
    if default:
        facts.append(f"default: `{default}`")
    if each := _placed(context).get(id(meaning)):
        facts.append(f"on the wire: {each.size.in_bytes} at offset {each.offset}")
    yield "  \n".join(facts)


def _placed(context: InterfaceContext) -> dict[int, Placed]:
    """Return the places of fields in the bytes of their section, by identity."""
    model = context.model
    if model is None:
        return {}
    layouts = (layout(part, model.messages)[0] for part in derive.sections(context.interface))
    return {id(placed.field): placed for fields in layouts for placed in fields}


def _interface(interface: ir.Interface, snapshot: Snapshot) -> Iterator[str]:
    """Yield the paragraphs that describe an interface."""
    yield f"**{interface.name}**"
    model = snapshot.model_of(interface)
    if model is None:
        yield prose(derive.sections(interface)[0].comment)
        return
    yield code(list(outline(interface, model)))
    names = section_names(interface) or ("",)
    sizes = []
    for name, section in zip(names, derive.sections(interface), strict=True):
        of = f" of the {name.lower()}" if name else ""
        sizes.append(f"on the wire{of}: {layout(section, model.messages)[1].in_bytes}")
    yield "  \n".join(sizes)
    if model.distro.has_hashes:
        yield f"`{model.describer.hash(str(interface.name))}`"
    if interface.source is not None and is_built_in(interface.source):
        # the catalogue has no comments
        package = interface.name.package
        page = f"https://docs.ros.org/en/{model.distro.name}/p/{package}/"
        yield f"[{prose((package,))} in the documentation of ROS 2]({page})"


def code(lines: list[str]) -> str:
    """Return the first lines as a code block, with a fence that they cannot end."""
    more = [f"# {len(lines) - MOST_LINES} more lines"] if len(lines) > MOST_LINES else []
    text = "\n".join(lines[:MOST_LINES] + more)
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", text)), default=0))
    return f"{fence}rosmsg\n{text}\n{fence}"


#: The start of a heading, list, quotation, table, rule or fenced code, at the start of a line.
_BLOCK = r"^\s*(?:[#>+=~|:*_-]|\d+(?=[.)]))"
#: Text in backticks, which is code in Markdown as in comments.
_CODE = r"(?<!`)`[^`]+`(?!`)"
#: Characters that Markdown may not take for text: the beginning of a span suffices.
_MARKS = (
    r"\\(?=[!-/:-@\[-`{-~])|\\$|`|<(?=[\w/!?])|&(?=[\w#])|\](?=[(\[:])"
    r"|(?<![^\W_])_+(?=\S)|[*~]+(?=\S)"
)


def prose(lines: tuple[str, ...]) -> str:
    """Return a comment as Markdown that shows it as it was written.

    Only characters with a meaning in Markdown are escaped, as some editors show each escape.
    """
    escape = re.compile(rf"{_CODE}|{_BLOCK}|{_MARKS}")
    return "  \n".join(escape.sub(_escaped, line) for line in lines)


def _escaped(match: re.Match[str]) -> str:
    text = match[0]
    if text.startswith("`") and len(text) > 1:
        return text
    blanks = text[: len(text) - len(text.lstrip())]
    mark = text.lstrip()
    escaped = f"{mark}\\" if mark.isdigit() else "".join(f"\\{character}" for character in mark)
    return blanks + escaped


def hints(context: InterfaceContext, params: RangeParams) -> list[dict[str, object]]:
    """Return the hints in a range; none where the file has errors."""
    state = context.state
    low, high = (state.offset(context.source, at) for at in (params.range.start, params.range.end))
    placed = _placed(context) if state.settings.inlay_hints else {}
    shown: list[dict[str, object]] = []
    for element in elements(context):
        place = placed.get(id(element.meaning))
        if place is not None and low <= element.name.end <= high:
            tip = f"{place.size.in_bytes} at offset {place.offset} of the message"
            hint = {
                "position": state.range(element.name).end,
                "label": f"@{place.offset}, {place.size} B",
                "tooltip": f"{tip}, without the header",
                "paddingLeft": True,
            }
            shown.append(hint)
    return shown


_HASH, _USERS, _BREAKS = "hash", "users", "breaks"
#: Defaults that a lens lists.
MOST_DEFAULTS = 5
#: Letters that it shows of a default.
MOST_LETTERS = 40


def lenses(context: InterfaceContext, params: DocumentParams) -> list[Lens]:
    """Return the lenses of a file; `resolve` computes their texts when they are shown."""
    settings = context.state.settings
    if not settings.code_lens:
        return []
    kinds = [_HASH] if context.snapshot.library.distro.has_hashes else []
    kinds += [_USERS] if context.interface.name.kind == "msg" else []
    kinds += [_BREAKS] if context.workspace.baseline.name else []
    of_file = [Lens(TOP, data=[params.text_document.uri, kind]) for kind in kinds]
    return [*of_file, *(_defaults(context) if settings.default_lens else ())]


def resolve(state: ServerState, lens: Lens) -> Lens:
    """Return a lens with its text."""
    if lens.command is not None:
        return lens
    uri, kind = lens.data
    context = state.context(uri)
    text = ""
    if context is not None and kind == _USERS:
        used = users(context.interface.name, context.snapshot, state)
        text = counted(len(list(used)), "use")
    elif context is not None and kind == _BREAKS:
        text = _what_breaks(context)
    elif context is not None:
        model, name = context.model, str(context.interface.name)
        text = model.describer.hash(name) if model else "no type hash: there are errors"
    return Lens(lens.range, {"title": text, "command": ""}, lens.data)


def _defaults(context: InterfaceContext) -> Iterator[Lens]:
    """Yield a lens above the first default of each section, which lists all of them."""
    for section in derive.sections(context.interface):
        with_default = [field for field in section.fields if field.default and field.name_span]
        if with_default:
            texts = (_default(field, section) for field in with_default)
            assert with_default[0].name_span is not None
            start = Position(context.state.range(with_default[0].name_span).start.line, 0)
            text = f"defaults: {first_few(texts, MOST_DEFAULTS)}"
            yield Lens(Range(start, start), {"title": text, "command": ""})


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


def _what_breaks(context: InterfaceContext) -> str:
    """Return a sentence on what a file's changes break against the version of the settings."""
    name, against = context.interface.name, context.workspace.baseline
    side = context.workspace.before()
    before = side.models.get(name.package)
    after = context.model
    if after is None:
        return ""
    if name in side.broken:
        return f"not compared: there are errors in {against.name}"
    if side.error and not side.models:
        return f"not compared: {side.error}"
    if before is None or name not in {own.name for own in before.own}:
        return f"no version to compare with in {against.name}"
    changes = compare(before.only({name}), after.only({name})).changes
    levels = levels_of(against.not_allowed(changes))
    if not levels:
        return f"no breaking changes against {against.name}"
    used = users(name, context.snapshot, context.state)
    count = len({snapshot.path_of(span.source) for snapshot, span in used})
    return f"breaks: {levels} for {counted(count, 'user')} against {against.name}"
