"""Descriptions of definitions and types: comment, unit, range, default, bytes, hash."""

from __future__ import annotations

import re
from collections.abc import Iterator

from idlc.documents.show import outline
from idlc.editor.documents import is_built_in
from idlc.editor.elements import Element, section_names, spot_at
from idlc.editor.protocol.parts import Markup, Part, PositionParams, Range
from idlc.editor.state import ServerState
from idlc.editor.workspace import Snapshot
from idlc.model import derive, ir
from idlc.model.ir import is_range, spell, spell_value
from idlc.model.link import Model
from idlc.wire.layout import Extent, Placed, layout

#: Lines of a message that are shown.
MOST_LINES = 40


class Hover(Part, frozen=True):
    """A text about a range."""

    contents: Markup
    range: Range | None = None


def hover(state: ServerState, params: PositionParams) -> Hover | None:
    """Return the description of the element at a position; between definitions, of the file."""
    context = state.context(params.text_document.uri)
    if context is None:
        return None
    spot = spot_at(state, context, params.position)
    snapshot = context.snapshot
    if spot is None or spot.part == "comment":
        return Hover(Markup("\n\n".join(_interface(context.interface, snapshot))))
    element = spot.element
    if spot.part == "type" and element.target is not None:
        interface = next(
            (
                model.interfaces[element.target]
                for model in snapshot.models.values()
                if element.target in model.interfaces
            ),
            None,
        )
        if interface is None:
            return None
        return Hover(Markup("\n\n".join(_interface(interface, snapshot))), state.range(spot.span))
    if element.meaning is None:
        return None
    text = "\n\n".join(filter(None, _definition(element, context.interface, snapshot)))
    return Hover(Markup(text), state.range(spot.span))


def _definition(element: Element, interface: ir.Interface, snapshot: Snapshot) -> Iterator[str]:
    meaning = element.meaning
    assert meaning is not None
    if isinstance(meaning, ir.Constant):
        yield code([f"{spell(meaning.type)} {meaning.name}={spell_value(meaning.value)}"])
    else:
        default = f" {spell_value(meaning.default.value)}" if meaning.default else ""
        yield code([f"{spell(meaning.type)} {meaning.name}{default}"])
    yield prose(meaning.comment)
    says_range = meaning.unit is not None and is_range(meaning.unit)
    facts = [f"{'range' if says_range else 'unit'}: `{meaning.unit}`"] if meaning.unit else []
    facts += _limits(meaning.type, has_range=says_range)
    if isinstance(meaning, ir.Field):
        facts += [f"default: `{spell_value(meaning.default.value)}`"] if meaning.default else []
        placed = placed_fields(element.message, interface, snapshot)
        facts += [_bytes(each) for each in placed[0] if each.field is meaning] if placed else []
    yield "  \n".join(facts)


def _limits(type_: ir.FieldType, *, has_range: bool) -> list[str]:
    """Return the limits of a type's values, where it is not any float or text."""
    facts = []
    element = ir.element_of(type_)
    if isinstance(element, ir.Primitive) and element.info.low is not None and not has_range:
        facts.append(f"range: `{element.info.low}` to `{element.info.high}`")
    if isinstance(element, ir.String) and element.bound is not None:
        facts.append(f"length: at most {element.bound} characters")
    if isinstance(type_, ir.Sequence) and type_.bound is not None:
        facts.append(f"elements: at most {type_.bound}")
    return facts


def _bytes(placed: Placed) -> str:
    return f"on the wire: {placed.size.in_bytes} at offset {placed.offset}"


def placed_fields(
    message: ir.Message, interface: ir.Interface, snapshot: Snapshot
) -> tuple[list[Placed], Extent] | None:
    """Return the offsets of the fields of a section in its bytes, `None` if there are errors."""
    model = snapshot.model_of(interface)
    return layout(message, model.messages) if model else None


def _interface(interface: ir.Interface, snapshot: Snapshot) -> Iterator[str]:
    """Yield the paragraphs that describe an interface."""
    yield f"**{interface.name}**"
    model = snapshot.model_of(interface)
    if model is None:
        yield prose(derive.sections(interface)[0].comment)
        return
    yield code(shortened(list(outline(interface, model))))
    yield "  \n".join(_sizes(interface, model))
    if model.distro.has_hashes:
        yield f"`{model.describer.hash(str(interface.name))}`"
    if interface.source is not None and is_built_in(interface.source):
        # the catalogue has no comments
        package = interface.name.package
        page = f"https://docs.ros.org/en/{model.distro.name}/p/{package}/"
        yield f"[{prose((package,))} in the documentation of ROS 2]({page})"


def _sizes(interface: ir.Interface, model: Model) -> Iterator[str]:
    names = section_names(interface) or ("",)
    for name, section in zip(names, derive.sections(interface), strict=True):
        of = f" of the {name.lower()}" if name else ""
        yield f"on the wire{of}: {layout(section, model.messages)[1].in_bytes}"


def shortened(lines: list[str]) -> list[str]:
    """Return the first lines of a definition, with a remark that counts the others."""
    more = [f"# {len(lines) - MOST_LINES} more lines"] if len(lines) > MOST_LINES else []
    return lines[:MOST_LINES] + more


def code(lines: list[str]) -> str:
    """Return lines as a code block, with a fence that they cannot end."""
    text = "\n".join(lines)
    fence = "`" * max(3, 1 + max((len(run) for run in _runs(text)), default=0))
    return f"{fence}rosmsg\n{text}\n{fence}"


def _runs(text: str) -> Iterator[str]:
    """Yield each run of backticks."""
    return iter(re.findall("`+", text))


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
    return blanks + (
        f"{mark}\\" if mark.isdigit() else "".join(f"\\{character}" for character in mark)
    )
