"""The syntax of an .idl file that ROS 2 made of an interface file; places count from its start."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from idlc.diagnostics.source import Source, Span
from idlc.syntax.tree import Piece


class Element(msgspec.Struct, frozen=True):
    """A type without arrays: `double`, `string<5>`, `demo__msg__Part` or `std_msgs::msg::Header`.

    `name` is the first of its parts, or with several the whole of them.
    """

    name: Piece
    parts: tuple[str, ...]
    bound: Piece | None = None


class Sequence(msgspec.Struct, frozen=True):
    """`sequence<T>` or `sequence<T, N>`."""

    element: Element
    bound: Piece | None = None


class Typedef(msgspec.Struct, frozen=True):
    """Another name for a type, or for an array of it."""

    type: Element | Sequence
    name: Piece
    size: Piece | None = None


class Value(msgspec.Struct, frozen=True):
    """A number, `TRUE` or `FALSE`; or texts in quotes, one after the other."""

    pieces: tuple[Piece, ...]

    @property
    def is_text(self) -> bool:
        """Whether it is in quotes."""
        return self.pieces[0].text.startswith('"')

    @property
    def whole(self) -> Piece:
        """A piece as long as all of it; its text is the first piece's."""
        length = self.pieces[-1].end - self.pieces[0].start
        return Piece(self.pieces[0].text.ljust(length), self.pieces[0].start)


class Annotation(msgspec.Struct, frozen=True):
    """`@name (parameter=value, ...)`."""

    name: Piece
    parameters: Mapping[str, Value]


class Constant(msgspec.Struct, frozen=True):
    """`const TYPE NAME = VALUE;`."""

    annotations: tuple[Annotation, ...]
    type: Element | Sequence
    name: Piece
    value: Value


class Constants(msgspec.Struct, frozen=True):
    """The module of a structure's constants."""

    name: Piece
    constants: tuple[Constant, ...]


class Member(msgspec.Struct, frozen=True):
    """`TYPE NAME;`."""

    annotations: tuple[Annotation, ...]
    type: Element | Sequence
    name: Piece


class Structure(msgspec.Struct, frozen=True):
    """`struct NAME { ... };`."""

    annotations: tuple[Annotation, ...]
    name: Piece
    members: tuple[Member, ...]


class File(msgspec.Struct, frozen=True):
    """A file, or with `broken` the place from which on it is none that ROS 2 makes."""

    source: Source
    package: Piece = Piece("", 0)
    kind: Piece = Piece("", 0)
    parts: tuple[Typedef | Constants | Structure, ...] = ()
    broken: Piece | None = None

    def span(self, piece: Piece) -> Span:
        """Return the place of a piece."""
        return Span(self.source, piece.start, piece.end)
