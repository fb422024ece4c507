"""Source text and ranges in it.

In: decoded text and the name a person knows it by. Out: spans that can be pointed at.
Never reads a file and never changes the text: line ends, tabs and a byte order mark stay.
"""

from __future__ import annotations

from bisect import bisect_right
from functools import cached_property
from itertools import accumulate
from typing import NamedTuple

#: The last line of a text that a node sent incomplete.
INCOMPLETE = "# idlc: constants, default values and comments of this type may be missing"


class Source:
    """One file's exact text. Compared by identity; messages show `path`.

    `file` is the file that contains the text, where `path` names only a part of it.
    """

    def __init__(self, path: str, text: str, file: str = "") -> None:
        self.path = path
        self.text = text
        self.file = file or path

    def __repr__(self) -> str:
        return f"Source({self.path!r})"

    @property
    def is_idl(self) -> bool:
        """True for IDL, which ROS 2 makes from interface files, instead of an interface file."""
        return self.path.endswith(".idl")

    @property
    def is_recorded(self) -> bool:
        """True for a definition that came with messages; never for a file of its own."""
        return self.file != self.path

    @cached_property
    def is_incomplete(self) -> bool:
        """True if constants and default values may be missing; never for a file of its own."""
        return self.is_recorded and self.text.rstrip().endswith(INCOMPLETE)

    @cached_property
    def lines(self) -> tuple[str, ...]:
        """The lines with their ends, split as `str.splitlines` does (language 1.1)."""
        return tuple(self.text.splitlines(keepends=True))

    @cached_property
    def line_starts(self) -> tuple[int, ...]:
        """Character offset of each line's first character; one entry at least."""
        return tuple(accumulate(map(len, self.lines), initial=0))[:-1] or (0,)

    def position(self, offset: int) -> tuple[int, int]:
        """Return the 1-based (line, column) of a character offset; columns count characters."""
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1

    def line_starts_after(self, offset: int) -> int:
        """Return where the line after the one at `offset` starts; the text's end at the last."""
        return (*self.line_starts, len(self.text))[bisect_right(self.line_starts, offset)]

    def line_text(self, line: int) -> str:
        """Return line `line` (1-based) without its end; empty past the last line."""
        return self.lines[line - 1].splitlines()[0] if line <= len(self.lines) else ""


class Span(NamedTuple):
    """A half-open range of character offsets in a source."""

    source: Source
    start: int
    end: int

    @property
    def text(self) -> str:
        """The characters covered."""
        return self.source.text[self.start : self.end]

    @property
    def corners(self) -> tuple[int, int, int, int]:
        """The line and column of the first character, and of the one after the last."""
        return (*self.source.position(self.start), *self.source.position(self.end))

    def at(self, start: int, end: int) -> Span:
        """Return the part from `start` to `end`, counted from this span's start."""
        return Span(self.source, self.start + start, self.start + end)
