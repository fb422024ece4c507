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


def docstring(lines: list[str], *, one_line: bool) -> str:
    """Return finished lines (see `prose`) as they stand after the opening quotes of a docstring.

    With `one_line`, the closing quotes follow if there is but one.
    """
    first = lines[0].lstrip()
    if one_line and len(lines) == 1 and first.endswith('"') and not first.endswith('\\"'):
        first = first[:-1] + '\\"'  # would join the closing quotes
    if first.startswith('"'):
        first = "\\" + first
    return "\n".join([first, *lines[1:]])


def wrapped(words: str, indent: int, hanging: int = 0) -> list[str]:
    """Return words on lines that fit when they are indented, all but the first by `hanging` too."""
    width = WIDTH - 4 - indent
    if len(words) <= width:
        return [words]
    return textwrap.wrap(
        words,
        width,
        subsequent_indent=" " * hanging,
        break_long_words=False,
        break_on_hyphens=False,
    )
