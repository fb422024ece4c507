"""An interface as one reads it: its fields with those of the messages in them, and all comments."""

from __future__ import annotations

from collections.abc import Iterator

from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.model.spelling import spell, spell_value
from idlc.syntax.tree import OPTIONAL

INDENT = "    "
GAP = 2
#: A column for comments further to the right than this is worse than none.
WIDEST = 60


def outline(interface: ir.Interface, model: Model) -> Iterator[str]:
    """Yield the lines; sections of services and actions are divided as in their files."""
    for number, section in enumerate(derive.sections(interface)):
        if number:
            yield "---"
        yield from (f"# {line}".rstrip() for line in section.comment)
        if section.comment and (section.constants or section.fields):
            yield ""
        rows = [*_constants(section), *_fields(section, model, 0)]
        widths = [len(code) for code, _ in rows if len(code) <= WIDEST]
        column = max(widths, default=0) + GAP
        for code, comment in rows:
            yield from _commented(code, comment, column)


def _constants(message: ir.Message) -> Iterator[tuple[str, tuple[str, ...]]]:
    for one in message.constants:
        yield f"{spell(one.type)} {one.name}={spell_value(one.value)}", one.comment


def _fields(message: ir.Message, model: Model, depth: int) -> Iterator[tuple[str, tuple[str, ...]]]:
    for field in message.fields:
        default = f" {spell_value(field.default.value)}" if field.default else ""
        unit = f" [{field.unit}]" if field.unit else ""
        *before, last = field.comment or ("",)
        comment = tuple(line for line in (*before, f"{last}{unit}".strip()) if line)
        optional = f"{OPTIONAL} " if field.optional else ""
        yield f"{INDENT * depth}{optional}{spell(field.type)} {field.name}{default}", comment
        element = ir.element_of(field.type)
        if isinstance(element, ir.Ref):
            nested = model.messages[element.target]
            constants = (
                (f"{INDENT * (depth + 1)}{code}", about) for code, about in _constants(nested)
            )
            yield from constants
            yield from _fields(nested, model, depth + 1)


def _commented(code: str, comment: tuple[str, ...], column: int) -> Iterator[str]:
    """Yield a line of code with its comment after it, the rest of that below."""
    if not comment:
        yield code
        return
    first, *rest = comment
    yield f"{code.ljust(column - GAP)}{' ' * GAP}# {first}".rstrip()
    yield from (f"{' ' * column}# {line}".rstrip() for line in rest)
