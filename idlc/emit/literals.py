"""Values and text from interface files as Python source that cannot be anything else.

Whatever stands in a comment, a default or a constant comes out as one literal or in a docstring:
quotes, backslashes and characters that do not print are escaped. It never comes out as a comment,
where tools look for directives.
"""

from __future__ import annotations

import math
import textwrap
import unicodedata

from idlc.emit.python_lines import WIDTH
from idlc.model import ir


def text(value: str) -> str:
    """Return a string literal with the quotes that formatters choose."""
    quote = '"' if value.count('"') <= value.count("'") else "'"
    if value.isascii() and value.isprintable():
        return quote + value.replace("\\", "\\\\").replace(quote, "\\" + quote) + quote
    return quote + "".join(_escaped(c, quote) for c in value) + quote


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
        return text(str(value))
    if isinstance(type_, ir.Primitive) and type_.name == "byte":
        return octet(int(value))
    if isinstance(type_, ir.Primitive) and type_.name.startswith("float"):
        return number(float(value))
    return number(value)


def _escaped(character: str, quote: str) -> str:
    if character == quote or character == "\\":
        return "\\" + character
    return printable(character)


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


def docstring(lines: list[str], indent: int) -> list[str]:
    """Return finished lines (see `prose`) as a docstring, indented."""
    margin = " " * indent
    first, *rest = lines or [""]
    first = first.lstrip()
    if not rest:
        # A quote at the end would join the closing quotes.
        end = '\\"' if first.endswith('"') and not first.endswith('\\"') else None
        first = first[:-1] + end if end else first
        return [f'{margin}"""{_safe_start(first)}"""']
    body = [f"{margin}{line}" if line else "" for line in rest]
    return [f'{margin}"""{_safe_start(first)}', *body, f'{margin}"""']


def _safe_start(line: str) -> str:
    return "\\" + line if line.startswith('"') else line


def wrapped(words: str, indent: int, first: int) -> list[str]:
    """Return words wrapped for a docstring of class members, hanging by four columns."""
    if first + len(words) <= WIDTH - 4:
        return [" " * first + words]
    return textwrap.wrap(
        words,
        WIDTH - 4,
        initial_indent=" " * first,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
