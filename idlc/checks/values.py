"""Values that ROS 2 accepts and that then mean something else, or break somebody's code."""

from __future__ import annotations

import math

from idlc.checks.sections import sections
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Span
from idlc.model import ir
from idlc.model.link import Model
from idlc.model.lowering import slips
from idlc.model.lowering.literals import BACKSLASH_HINT, FLOAT32_MAX
from idlc.syntax.escapes import plain_meaning


def constants_and_defaults(model: Model, report: Report) -> None:
    """Values reach every language as they are written."""
    for message in sections(model):
        for constant in message.constants:
            if constant.value_span is not None:
                report.extend(_problems(constant.value, constant.type, constant.value_span))
        for field in message.fields:
            if field.default is not None and field.default_span is not None:
                report.extend(_problems(field.default.value, field.type, field.default_span))


def _problems(value: ir.Value, type_: ir.FieldType, span: Span) -> list[Diagnostic]:
    element = ir.element_of(type_)
    if isinstance(value, tuple):
        if not value and isinstance(element, ir.Primitive) and element.name not in ("bool", "byte"):
            return [_breaks_python(span, "an empty default of a numeric sequence")]
        return _broken_text(value, span)
    if isinstance(value, str):
        return [*_broken_text((value,), span), *_mangled_text(value, span), *_odd_text(span)]
    if isinstance(value, float):
        return _number(value, element, span)
    return []


def _number(value: float, element: ir.Element, span: Span) -> list[Diagnostic]:
    if not math.isfinite(value):
        message = f"`{span.text}` is not finite; what rosidl generates for it does not compile"
        hint = "use a large finite number, or set the value in code"
        return [codes.NON_FINITE_VALUE.at(span, message, hint=hint)]
    if element == ir.Primitive("float32") and abs(value) > FLOAT32_MAX:
        message = f"`{span.text}` is beyond what a float32 holds"
        return [codes.FLOAT32_RANGE.at(span, message, hint="use float64")]
    return []


def _broken_text(values: tuple[ir.Scalar, ...], span: Span) -> list[Diagnostic]:
    if any(isinstance(text, str) and set(text) & set("\n\r\0") for text in values):
        return [_breaks_python(span, "a line break or NUL in a value")]
    return []


def _mangled_text(value: str, span: Span) -> list[Diagnostic]:
    text = span.text
    if len(text) > 1 and text[0] == text[-1] and text[0] in "\"'":
        text = text[1:-1]
    if "\\" not in text or value == plain_meaning(text):
        return []
    message = f"ROS 2 interprets the backslashes more than once and reads {value!r}"
    return [codes.MANGLED_TEXT.at(span, message, hint=BACKSLASH_HINT)]


def _odd_text(span: Span) -> list[Diagnostic]:
    """Find what looks like quotes or a comment and is part of the text."""
    text = span.text
    one_sided = text[:1] in ('"', "'") and (len(text) == 1 or text[-1] != text[0])
    if slips.has_comment(text) and (one_sided or slips.is_comment(text)):
        message = "what looks like a comment is part of the text"
        return [codes.ODD_TEXT.at(span, message, hint=slips.COMMENT_HINT)]
    if one_sided and text[0] not in _rest_of_line(span):  # or a `#` is to blame, see IDL109
        message = f"the text is not closed by {text[0]}, which therefore is part of it"
        return [codes.ODD_TEXT.at(span, message, hint="close the quotes, or leave them out")]
    return []


def _rest_of_line(span: Span) -> str:
    line, column = span.source.position(span.end)
    return span.source.line_text(line)[column - 1 :]


def _breaks_python(span: Span, what: str) -> Diagnostic:
    message = f"{what} breaks the Python code that rosidl generates"
    return codes.BREAKS_ROSIDL_PYTHON.at(span, message, hint="remove it, and set the value in code")
