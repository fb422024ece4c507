"""Value text + type → the value, or the fault of the text (language 3 and 4).

Part of the model, not of the syntax, because the meaning of a literal depends on its type.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from contextlib import suppress
from typing import TypeAlias

from idlc.diagnostics import codes
from idlc.language.escapes import EscapeError, read_back, through_idl
from idlc.language.tree import Fault
from idlc.model import ir

QUOTES = ('"', "'")
#: Elements that a default may have; each takes about a kilobyte on its way.
MAX_ELEMENTS = 200_000


def elements(inside: str) -> list[tuple[str, int]] | Fault:
    """Split at commas; each element with its offset."""
    pieces: list[tuple[str, int]] = []
    at = 0
    for part in inside.split(",") if inside else []:
        stripped = part.strip()
        pieces.append((stripped, at + len(part) - len(part.lstrip())))
        if not stripped:
            end = at + max(len(part), 1)
            return Fault(codes.ARRAY_VALUE, "an element is missing", at, end, "remove the comma")
        at += len(part) + 1
    return pieces


def string_elements(inside: str) -> list[tuple[str, int]] | Fault:
    """Split as rosidl's scanner does, wrong turns included (language 4)."""
    pieces: list[tuple[str, int]] = []
    ends = {quote: _Ends(inside, quote) for quote in QUOTES}
    at = 0
    while at < len(inside) and len(pieces) <= MAX_ELEMENTS:
        at = _after_blanks(inside, at)
        if at == len(inside) or inside[at] == ",":
            return Fault(codes.ARRAY_VALUE, "an element is missing", at, at + 1, "remove the comma")
        quoted = False
        for quote in QUOTES:
            if inside.startswith(quote, at):
                quoted = True
                end = ends[quote].after(at)
                if end == -1:
                    message = f"this element has no closing {quote}"
                    hint = (
                        "an element cannot end with an escaped quote; use the other kind of quote"
                    )
                    return Fault(codes.BAD_VALUE, message, at, len(inside), hint)
                element = inside[at + 1 : at + end + 1].replace(f"\\{quote}", quote)
                # upstream strips every element, quoted ones included
                pieces.append((element.strip(), at))
                at += end + 2
        if not quoted:
            comma = inside.find(",", at)
            end = len(inside) if comma < 0 else comma
            pieces.append((inside[at:end].strip(), at))
            at = end
        at = _after_blanks(inside, at)
        at += inside.startswith(",", at)
    return pieces


def _after_blanks(text: str, at: int) -> int:
    """Return the offset of the first character from `at` on that is no space."""
    match = re.compile("[^ ]").search(text, at)  # compiled once, by re
    return match.start() if match else len(text)


class _Ends:
    """The ends of quoted texts as rosidl finds them, without its quadratic search.

    Upstream goes from one escaped quote to the next, and counts from the last of them instead of
    from the start, so it may search the same text again and again.
    """

    def __init__(self, text: str, quote: str) -> None:
        self._text = text
        self._quote = quote
        #: offset -> the closing quote, the offset after the last escaped one, the offset before it
        self._ends: dict[int, tuple[int, int, int]] = {}

    def after(self, start: int) -> int:
        """Return the length of the text quoted at `start`; -1 if nothing ends it."""
        path = [start]
        while path[-1] not in self._ends:
            quote = path[-1]
            at = self._text.find(self._quote, quote + 1)
            if at < 0 or self._text[at - 1] != "\\":
                self._ends[quote] = (at, quote, quote)
            else:
                path.append(at + 1)
        following = path.pop()
        for quote in reversed(path):
            end, last, before = self._ends[following]
            self._ends[quote] = (end, last, quote if last == following else before)
            following = quote
        end, last, before = self._ends[start]
        return -1 if end < 0 else end - 1 - before


FLOAT32_MAX = 3.402823466e38
#: Longer texts are judged by Python's own conversion: patterns take much memory for them.
LONG = 1000


NumberValue: TypeAlias = bool | int | float
BACKSLASH_HINT = "write `\\\\\\\\` for each backslash in the value"


def scalar(type_: ir.Primitive | ir.String, text: str) -> NumberValue | str | Fault:
    """Return the value that `text` spells for a scalar type."""
    return _text(type_, text) if isinstance(type_, ir.String) else _number(type_.name, text)


def default(type_: ir.FieldType, text: str) -> ir.Default | Fault:
    """Return the declared default of a field whose type is no message."""
    if isinstance(type_, (ir.Array, ir.Sequence)):
        return _array_default(type_, text)
    assert isinstance(type_, (ir.Primitive, ir.String))
    value = scalar(type_, text)
    if isinstance(value, Fault):
        return value
    if isinstance(value, float) and not math.isfinite(value):
        # the .idl holds the bare word, whose sign its parser loses (language 3)
        return ir.Default(value, str(abs(value)))
    return ir.Default(value, str(value))


def _fault(code: codes.DiagnosticCode, text: str, message: str, hint: str) -> Fault:
    return Fault(code, message, 0, len(text), hint)


def _shown(text: str) -> str:
    return f"`{text}`" if len(text) <= 40 else f"`{text[:37]}...`"


def _number(type_: str, text: str) -> NumberValue | Fault:
    from idlc.language.definition import pattern  # loads lark

    info = ir.PRIMITIVES[type_]
    form, noun, hint = "INTEGER", "an integer", "a number such as `10`, `-3`, `0xff` or `0b101`"
    # as rosidl does: decimal first, leading zeros allowed, then by prefix
    readers: list[Callable[[str], NumberValue]] = [int, lambda text: int(text, 0)]
    if type_ == "bool":
        form, noun, hint = "BOOLEAN", "a bool", "`true`, `false`, `1` or `0`"
        readers = [lambda text: text.lower() in ("true", "1")]
    elif info.low is None:
        form, noun, hint = "REAL", "a number", "a number such as `1`, `-0.5` or `1e-3`"
        readers = [float]
    is_long = len(text) > LONG and type_ != "bool"
    for reader in readers if is_long or re.fullmatch(pattern(form), text) else ():
        with suppress(ValueError):
            value = reader(text)
            if info.low is None or info.high is None or info.low <= value <= info.high:
                return value
            hint = f"{type_} holds {info.low} to {info.high}"
            return _fault(codes.OUT_OF_RANGE, text, f"{_shown(text)} is out of range", hint)
    message = f"{_shown(text)} is not {noun}" if text else "the value is missing"
    return _fault(codes.BAD_VALUE, text, message, f"write {hint}")


def _text(type_: ir.String, text: str) -> str | Fault:
    raw = _unquote(type_, text)
    if isinstance(raw, Fault):
        return raw
    try:
        return through_idl(raw)
    except EscapeError as error:
        offset = text.find(raw)
        start, end = error.start + offset, error.end + offset
        if offset < 0:  # quotes were un-escaped, so offsets differ
            start, end = 0, len(text)
        message = f"ROS 2's tools fail on {error}"
        return Fault(codes.BAD_ESCAPE, message, start, end, BACKSLASH_HINT)


def _unquote(type_: ir.String, text: str) -> str | Fault:
    """Return a string value as rosidl's adapter takes it: without its quotes, escapes untouched."""
    raw = text
    for quote in QUOTES:
        if text.startswith(quote) and text.endswith(quote):
            raw = text[1:-1]
            inner = re.search(rf"(?<!\\){quote}", raw)
            if inner:
                start = 1 + inner.start()
                message = f"a {quote} inside {quote}...{quote}"
                hint = f"write `\\{quote}` for a quote inside quotes"
                return Fault(codes.BAD_VALUE, message, start, start + 1, hint)
            raw = raw.replace(f"\\{quote}", quote)
            break
    if type_.bound is None or len(raw) <= type_.bound:
        return raw
    message = f"the text has {len(raw)} characters, but the bound is {type_.bound}"
    hint = f"shorten it, or raise the bound to {len(raw)}"
    return _fault(codes.STRING_TOO_LONG, text, message, hint)


def _array_default(type_: ir.Array | ir.Sequence, text: str) -> ir.Default | Fault:
    if not (text.startswith("[") and text.endswith("]")) or text == "[":
        hint = "write `[1, 2, 3]`"
        return _fault(
            codes.ARRAY_VALUE, text, "the default value of an array must be in brackets", hint
        )
    inside, element = text[1:-1], type_.element
    assert isinstance(element, (ir.Primitive, ir.String))
    message = f"the default value has more than {MAX_ELEMENTS:,} elements"
    too_many = _fault(codes.TOO_LARGE, text, message, "set the value in code")
    if not isinstance(element, ir.String) and inside.count(",") >= MAX_ELEMENTS:
        return too_many
    split = string_elements if isinstance(element, ir.String) else elements
    pieces = split(inside)
    if isinstance(pieces, Fault):
        return pieces.moved(1)
    if len(pieces) > MAX_ELEMENTS:
        return too_many
    if (wrong := wrong_length(type_, len(pieces), text)) is not None:
        return wrong
    values: list[NumberValue | str] = []
    for piece, start in pieces:
        value = (
            _unquote(element, piece) if isinstance(element, ir.String) else scalar(element, piece)
        )
        if isinstance(value, Fault):
            # a quoted element's offsets are lost with its escapes; its start is near enough
            return value.moved(1 + start)
        values.append(value)
    return _array_value(tuple(values), text)


def _array_value(values: tuple[NumberValue | str, ...], text: str) -> ir.Default | Fault:
    """Take the values through the pipeline, where they travel as the text of a Python tuple."""
    literal = repr(values).replace("\\", "\\\\").replace('"', '\\"')
    try:
        annotation = read_back(literal, text)
        return ir.Default(python_tuple(annotation), annotation)
    except EscapeError as error:
        hint = "write the character as an escape such as `\\u20ac`"
        message = f"ROS 2's tools fail on {error}"
        return Fault(codes.BAD_ESCAPE, message, error.start, error.end, hint)
    except ValueError:
        hint = "only finite numbers can be defaults of an array"
        return _fault(codes.BAD_VALUE, text, "ROS 2's tools cannot read this default", hint)


def python_tuple(text: str) -> tuple[ir.Scalar, ...]:
    """Return the value of a Python tuple; raise ValueError for a text that is none."""
    import ast
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # unknown escapes, which the text is full of
        try:
            value = ast.literal_eval(text)
        except (SyntaxError, MemoryError, RecursionError) as error:
            raise ValueError(text) from error
    if not isinstance(value, tuple):
        raise ValueError(text)
    return value


def wrong_length(type_: ir.Array | ir.Sequence, count: int, text: str) -> Fault | None:
    """Return the fault of a default with this number of elements, or `None`."""
    if isinstance(type_, ir.Array):
        expected, wrong = f"exactly {type_.size}", count != type_.size
    else:
        expected, wrong = f"at most {type_.bound}", type_.bound is not None and count > type_.bound
    if not wrong:
        return None
    hint = f"give {expected} elements"
    return _fault(
        codes.ARRAY_LENGTH, text, f"the value has {count} elements instead of {expected}", hint
    )
