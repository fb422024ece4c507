"""Docstrings of generated classes: the file's comments, and what the types do not say."""

from __future__ import annotations

from idlc.emit import literals, pynames
from idlc.model import ir


def message(structure: ir.Message, summary: str) -> list[str]:
    """Return the lines of a message's docstring; `summary` stands in for a missing comment."""
    lines = [literals.prose(line) for line in structure.comment] or [summary]
    if len(lines) > 1 and lines[1]:
        lines.insert(1, "")
    lines += _hidden(structure)
    described = [c for c in structure.constants if c.comment or c.unit]
    if structure.fields:
        lines += ["", "Attributes:"]
        for field in structure.fields:
            lines += literals.wrapped(_field(field), 8, 4)
    if described:
        lines += ["", "Constants:"]
        for constant in described:
            lines += literals.wrapped(_constant(constant), 8, 4)
    return lines


def _hidden(structure: ir.Message) -> list[str]:
    """Return how to call the methods that fields hide."""
    hidden = [field.name for field in structure.fields if pynames.hides_method(field.name)]
    if not hidden:
        return []
    name = pynames.class_(structure.name)
    text = (
        f"Fields hide the methods of the same name ({', '.join(hidden)}): "
        f"`super({name}, message)` still has them, and `super({name}, {name})` those of the class."
    )
    return ["", *literals.wrapped(text, 0, 0)]


def _field(field: ir.Field) -> str:
    facts = ", ".join((type_text(field.type), *_limits(field.type)))
    return f"{pynames.field(field.name)}: {facts}{_rest(field)}"


def _constant(constant: ir.Constant) -> str:
    return f"{constant.name}: {type_text(constant.type)}{_rest(constant)}"


def _rest(described: ir.Field | ir.Constant) -> str:
    """Return the unit and the comment of a field or constant."""
    unit = f" [{literals.prose(described.unit)}]" if described.unit else ""
    words = " ".join(literals.prose(line).strip() for line in described.comment)
    return f"{unit}. {words}".rstrip()


def type_text(type_: ir.FieldType) -> str:
    """Return a type as interface files spell it."""
    match type_:
        case ir.Array(element, size):
            return f"{type_text(element)}[{size}]"
        case ir.Sequence(element, bound):
            return f"{type_text(element)}[{'' if bound is None else f'<={bound}'}]"
        case ir.String(wide, bound):
            return ("wstring" if wide else "string") + ("" if bound is None else f"<={bound}")
        case ir.Ref(target):
            return f"{target.package}/{target.name}"
        case ir.Primitive(name):
            return name
        case ir.Unknown():
            raise ValueError("an unknown type cannot be emitted")


def _limits(type_: ir.FieldType) -> tuple[str, ...]:
    """Return the range of an integer in words; what the type itself says is not repeated."""
    element = ir.element_of(type_)
    if isinstance(element, ir.Primitive) and element.name != "byte":
        info = element.info
        if info.low is not None and info.size < 8:
            return (f"{info.low} to {info.high}",)
    return ()
