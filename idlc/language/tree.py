"""One file's lossless syntax: every character of the text belongs to one line of the tree.

Offsets inside a definition count from the start of its line, so that the parse of equal lines
can be shared; `File.span` turns them into ranges of the file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import msgspec

from idlc.diagnostics.codes import DiagnosticCode
from idlc.diagnostics.source import Source, Span

if TYPE_CHECKING:
    from lark import Token

#: An ordinary character for ROS 2, and therefore wrong anywhere in a file (language 1.1).
BYTE_ORDER_MARK = "\ufeff"
#: The annotation before a definition, in distributions that read it (language 10).
OPTIONAL = "@optional"


class Piece(msgspec.Struct, frozen=True):
    """Some text and its offset in its line; TABs are spaces here."""

    text: str
    start: int

    @property
    def end(self) -> int:
        """The offset after the last character."""
        return self.start + len(self.text)


def piece(token: Token) -> Piece:
    """Return a token of lark as a piece of the text."""
    position: Any = token.start_pos  # Optional in lark 1.x, an int in the stubs of 0.12
    return Piece(str(token), int(position))


class Type(msgspec.Struct, frozen=True):
    """A type as written. `size` is `None` for `[]`; `brackets` is `None` without an array part."""

    whole: Piece
    name: Piece
    bound: Piece | None = None
    brackets: Piece | None = None
    at_most: bool = False
    size: Piece | None = None


class Field(msgspec.Struct, frozen=True):
    """`TYPE NAME [DEFAULT]`."""

    type: Type
    name: Piece
    default: Piece | None


class Constant(msgspec.Struct, frozen=True):
    """`TYPE NAME=VALUE`; name and value may be empty pieces."""

    type: Type
    name: Piece
    value: Piece


class Fault(msgspec.Struct, frozen=True):
    """A problem of a line or a value; `start` and `end` count from the beginning of its text."""

    code: DiagnosticCode
    message: str
    start: int
    end: int
    hint: str | None = None

    def moved(self, offset: int) -> Fault:
        """Return the same fault in a longer text that has `offset` characters before."""
        return msgspec.structs.replace(self, start=self.start + offset, end=self.end + offset)


Body: TypeAlias = Field | Constant | Fault


class Line(msgspec.Struct, frozen=True):
    """One line. `code` is the text before the comment, `comment` starts with its `#`."""

    start: int
    code: str = ""
    comment: str = ""
    newline: str = ""

    @property
    def is_indented_comment(self) -> bool:
        """True for a comment with whitespace before it."""
        return bool(self.comment) and bool(self.code) and not self.code.strip()

    @property
    def definition(self) -> str:
        """The code as a definition: TABs as spaces, nothing after it; may be empty."""
        return self.code.replace("\t", " ").rstrip()

    @property
    def after_optional(self) -> Line | None:
        """The rest of a line that begins with `@optional`; it may be empty or follow at once."""
        if not self.code.startswith(OPTIONAL):
            return None
        code = self.code[len(OPTIONAL) :].lstrip()
        start = self.start + len(self.code) - len(code)
        return Line(start, code, self.comment, self.newline)


class Section(msgspec.Struct, frozen=True):
    """The lines between two separators; `start` is the offset of the first."""

    start: int
    lines: tuple[Line, ...]


class File(msgspec.Struct, frozen=True):
    """A file: its sections and the offsets of the separators between them."""

    source: Source
    sections: tuple[Section, ...]
    separators: tuple[int, ...]

    def span(self, line: Line, piece: Piece) -> Span:
        """Return the range of a piece of a line; at least one character wide if there is one."""
        start = line.start + piece.start
        return Span(self.source, start, max(start + len(piece.text), start))
