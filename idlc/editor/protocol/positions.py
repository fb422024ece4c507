"""Positions in a text, as the protocol counts them and as Python does.

The protocol's lines end at LF, CR LF or CR and nowhere else; its characters are bytes of UTF-8,
units of UTF-16 or code points, as client and server agreed. Spans count code points of a text.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache

from idlc.editor.protocol.parts import Position, Range
from idlc.language.tree import BYTE_ORDER_MARK

_LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)")


def has_mark(text: str) -> bool:
    """Return whether a text begins with a byte order mark."""
    return text.startswith(BYTE_ORDER_MARK)


def lines_of(text: str) -> list[str]:
    """Return the lines with their ends; the last has none and may be empty."""
    lines = _LINE.findall(text)
    lines.append(text[sum(map(len, lines)) :])
    return lines


def units(text: str, encoding: str) -> int:
    """Return the length of a text in an encoding."""
    if encoding == "utf-32" or text.isascii():
        return len(text)
    if encoding == "utf-8":
        return len(text.encode("utf-8", "surrogatepass"))
    return len(text) + sum(character > "\uffff" for character in text)


def characters(line: str, count: int, encoding: str) -> int:
    """Return the number of characters in the first `count` units of a line, without its end.

    A position within a character means its start.
    """
    content = line.rstrip("\r\n")
    if encoding == "utf-32" or content.isascii():
        return min(count, len(content))
    passed = 0
    for at, character in enumerate(content):
        passed += units(character, encoding)
        if passed > count:
            return at
    return len(content)


def in_lines(lines: Sequence[str], position: Position, encoding: str) -> tuple[int, int]:
    """Return the line and the character of a position; the last if it is beyond."""
    if position.line >= len(lines):
        return len(lines) - 1, len(lines[-1])
    line = lines[position.line]
    return position.line, characters(line, position.character, encoding)


class Places:
    """The places of one text in one encoding.

    With `skips_mark`, the positions do not count a byte order mark, as editors do not that drop it
    when they read a file.
    """

    def __init__(self, text: str, encoding: str, *, skips_mark: bool = False) -> None:
        self._encoding = encoding
        self._skipped = len(BYTE_ORDER_MARK) if skips_mark and has_mark(text) else 0
        text = text[self._skipped :]
        self._lines = lines_of(text)
        self._starts = [0]
        for line in self._lines[:-1]:
            self._starts.append(self._starts[-1] + len(line))

    def position(self, offset: int) -> Position:
        """Return the position of a character; within a line's end, that end."""
        offset = max(offset - self._skipped, 0)
        line = max(bisect_right(self._starts, offset) - 1, 0)
        before = self._lines[line][: offset - self._starts[line]].rstrip("\r\n")
        return Position(line, units(before, self._encoding))

    def offset(self, position: Position) -> int:
        """Return the character at a position."""
        line, at = in_lines(self._lines, position, self._encoding)
        return self._skipped + self._starts[line] + at

    def range(self, start: int, end: int) -> Range:
        """Return the range of some characters."""
        return Range(self.position(start), self.position(end))

    def __len__(self) -> int:
        return len(self._lines)


@lru_cache(maxsize=256)
def places(text: str, encoding: str, *, skips_mark: bool) -> Places:
    """Return the places of a text."""
    return Places(text, encoding, skips_mark=skips_mark)
