"""Values that ROS 2 reads otherwise than they are written, or cannot hold (language 4)."""

from __future__ import annotations

import math
from collections.abc import Iterator

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic
from idlc.diagnostics.source import Span
from idlc.language.escapes import plain_meaning
from idlc.model import ir
from idlc.model.link import Model, own_sections
from idlc.model.lowering import lower_types
from idlc.model.lowering.lower_values import BACKSLASH_HINT, FLOAT32_MAX


def constants_and_defaults(model: Model) -> Iterator[Diagnostic]:
    """Values reach every language as they are written."""
    for message in own_sections(model):
        for constant in message.constants:
            if constant.value_span is not None:
                yield from _problems(constant.value, constant.type, constant.value_span)
        for field in message.fields:
            if field.default is not None and field.default_span is not None:
                yield from _problems(field.default.value, field.type, field.default_span)


def _problems(value: ir.Value, type_: ir.FieldType, span: Span) -> Iterator[Diagnostic]:
    element = ir.element_of(type_)
    texts = value if isinstance(value, tuple) else (value,)
    if value == () and isinstance(element, ir.Primitive) and element.name not in ("bool", "byte"):
        yield _breaks_python(span, "an empty default for a numeric sequence")
    if any(isinstance(text, str) and set(text) & set("\n\r\0") for text in texts):
        yield _breaks_python(span, "a line break or NUL in a value")
    if isinstance(value, str):
        yield from _text_problems(value, span)
    elif not isinstance(value, float):
        return
    elif not math.isfinite(value):
        message = (
            f"`{span.text}` is not finite; the code that rosidl generates for it does not compile"
        )
        hint = "use a large finite number, or set the value in code"
        yield codes.NON_FINITE_VALUE.at(span, message, hint=hint)
    elif element == ir.Primitive("float32") and abs(value) > FLOAT32_MAX:
        message = f"`{span.text}` exceeds the range of float32"
        yield codes.FLOAT32_RANGE.at(span, message, hint="use float64")


def _text_problems(value: str, span: Span) -> Iterator[Diagnostic]:
    """Yield the problems of a text that ROS 2 reads otherwise, or with more than is meant."""
    text = span.text
    is_closed = len(text) > 1 and text[0] == text[-1]
    content = text[1:-1] if is_closed and text[0] in "\"'" else text
    if "\\" in content and value != plain_meaning(content):
        message = f"ROS 2 interprets the backslashes more than once and reads {value!r}"
        yield codes.MANGLED_TEXT.at(span, message, hint=BACKSLASH_HINT)
    line, column = span.source.position(span.end)
    one_sided = text[:1] in ('"', "'") and not is_closed
    if lower_types.has_comment(text) and (one_sided or lower_types.is_comment(text)):
        message = "ROS 2 reads this comment as part of the text"
        yield codes.ODD_TEXT.at(span, message, hint=lower_types.COMMENT_HINT)
    # or a `#` is to blame, see IDL109
    elif one_sided and text[0] not in span.source.line_text(line)[column - 1 :]:
        message = f"no closing {text[0]}, so the opening quote is part of the text"
        yield codes.ODD_TEXT.at(span, message, hint="close the quotes, or remove them")


def _breaks_python(span: Span, subject: str) -> Diagnostic:
    message = f"{subject} breaks the Python code that rosidl generates"
    return codes.BREAKS_ROSIDL_PYTHON.at(
        span, message, hint="remove the default, and set the value in code"
    )
