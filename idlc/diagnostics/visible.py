"""Text of unknown origin made fit for a terminal, and the columns that it takes there."""

from __future__ import annotations

import re
import unicodedata

TAB_STOP = 4
#: Control, format, surrogate, private-use and unassigned characters, line and paragraph ends.
_HIDDEN = frozenset(("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"))
#: Control characters, those of the direction of writing included, other than tabs and line feeds.
_CONTROL = re.compile("[\\0-\\x08\\x0b-\\x1f\\x7f-\\x9f\\u2028-\\u202e\\u2066-\\u2069]")


def visible(text: str, column: int = 0) -> str:
    """Return `text` with tabs expanded and every invisible character spelled out.

    `column` is where it starts, which decides how far a tab reaches.
    """
    if text.isascii() and text.isprintable():
        return text
    parts: list[str] = []
    for character in text:
        tab = " " * (TAB_STOP - column % TAB_STOP)
        part = tab if character == "\t" else _spelled(character)
        parts.append(part)
        column += display_width(part)
    return "".join(parts)


def one_line(text: str) -> str:
    """Return `text` made visible, line ends and tabs included."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(_spelled(character) for character in text)


def printable(text: str) -> str:
    """Return text of any number of lines with its control characters spelled out.

    What writing needs stays, such as the joiners of scripts and emoji.
    """
    return _CONTROL.sub(lambda found: _spelled(found[0]), text)


def _spelled(character: str) -> str:
    code = ord(character)
    if code < 0x20:
        return chr(0x2400 + code)
    if code == 0x7F:
        return "\u2421"
    if code < 0x7F or unicodedata.category(character) not in _HIDDEN:
        return character
    return f"<U+{code:04X}>"


def display_width(text: str) -> int:
    """Return the terminal columns of visible text: wide characters two, combining ones none."""
    if text.isascii():
        return len(text)
    return sum(_width(character) for character in text)


def _width(character: str) -> int:
    if unicodedata.category(character) in ("Mn", "Me"):
        return 0
    return 2 if unicodedata.east_asian_width(character) in "WF" else 1
