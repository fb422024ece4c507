"""Values as Python source, and text as it stands in docstrings: nothing of it becomes code."""

from __future__ import annotations

import math
import unicodedata

from idlc.generate.templates import EscapedText
from idlc.model import ir


def string_literal(value: str) -> str:
    """Return a string literal with the quotes that formatters choose."""
    quote = '"' if value.count('"') <= value.count("'") else "'"
    if value.isascii() and value.isprintable():
        return quote + value.replace("\\", "\\\\").replace(quote, "\\" + quote) + quote
    escaped = (f"\\{c}" if c in {quote, "\\"} else printable(c) for c in value)
    return quote + "".join(escaped) + quote


def octet(value: int) -> str:
    """Return a bytes literal of one byte."""
    quote = "'" if value == ord('"') else '"'
    if value == ord("\\"):
        return 'b"\\\\"'
    return f"b{quote}{chr(value)}{quote}" if 0x20 <= value < 0x7F else f'b"\\x{value:02x}"'


def number(value: ir.Scalar) -> str:
    """Return a bool, int or float literal."""
    if isinstance(value, float) and not math.isfinite(value):
        return f'float("{value}")'
    return repr(value)


def scalar(type_: ir.Element, value: ir.Scalar) -> str:
    """Return the literal of a value of a primitive or string type."""
    if isinstance(type_, ir.String):
        return string_literal(str(value))
    if isinstance(type_, ir.Primitive) and type_.name == "byte":
        return octet(int(value))
    if isinstance(type_, ir.Primitive) and type_.name.startswith("float"):
        return number(float(value))
    return number(value)


def printable(character: str) -> str:
    """Return a character, or its escape if it does not print or reorders what does."""
    if character.isprintable() and unicodedata.category(character) not in {"Cf", "Zl", "Zp"}:
        return character
    return repr(character)[1:-1] if not character.isprintable() else f"\\u{ord(character):04x}"


def prose(line: str) -> str:
    """Return a line of a docstring."""
    if line.isascii() and line.isprintable():
        shown = line.replace("\\", "\\\\")
    else:
        shown = "".join("\\\\" if c == "\\" else printable(c) for c in line.expandtabs(4))
    return shown.replace('"""', '\\"\\"\\"').rstrip()


def between_quotes(line: str) -> EscapedText:
    """Return a line (see `prose`) that may stand between the quotes of a docstring."""
    shown = line.lstrip()
    if shown.endswith('"') and not shown.endswith('\\"'):
        shown = shown[:-1] + '\\"'  # would join the closing quotes
    return EscapedText("\\" + shown if shown.startswith('"') else shown)
