"""The position of the next value, as far as it is known while code is emitted."""

from __future__ import annotations

import msgspec

from idlc.wire.layout import Alignment, multiple_of

#: Expressions longer than this are set aside.
LONG = 40


class Position:
    """A position counted from the start of the buffer, as far as it is known.

    Its value is `text`, an expression over the variable `at`, or a number while nothing of
    variable size came before. `low` agrees with it modulo 4 and is an expression over sizes since
    the last multiple of 4. `before` are assignments that both expressions rely on.
    """

    def __init__(self, alignment: Alignment, base: str = "", low: str = "") -> None:
        self.alignment = alignment
        self._base = base
        self._offset = 0
        self._low = low
        self._low_offset = 0
        self.before: list[tuple[str, str]] = []

    @classmethod
    def variable(cls, alignment: Alignment) -> Position:
        """Return a position that is in `at` and, modulo 4, in `low`."""
        return cls(alignment, "at", "low")

    @property
    def constant(self) -> bool:
        """True if the position is a number."""
        return not self._base

    @property
    def text(self) -> str:
        """The position as an expression."""
        return _sum(self._base, self._offset)

    @property
    def low(self) -> str:
        """An expression that is equal to the position modulo 4."""
        if self.alignment.knows(4):
            return str(self.alignment.residue % 4)
        return _sum(self._low, self._low_offset % 4)

    def advance(self, size: int) -> None:
        """Go `size` bytes ahead."""
        self._offset += size
        self._low_offset += size
        self.alignment = self.alignment.after(size)

    def align(self, align: int) -> None:
        """Go to the next multiple of `align`, counted from the end of the header."""
        if self.alignment.knows(align):
            self.advance(self.alignment.padding(align))
            return
        self.shorten()
        self._base, self._offset = _align_up(self._base, self._offset, align)
        self._low, self._low_offset = _align_up(self._low, self._low_offset, align)
        self.alignment = multiple_of(align)

    def skip(self, size: str, modulus: int) -> None:
        """Go ahead by an expression, which is a multiple of `modulus`."""
        if self.alignment.knows(4):
            self._low, self._low_offset = "", self.alignment.residue % 4
        self._base = _plus(self._base, size)
        self._low = _plus(self._low, size)
        self.alignment = self.alignment.modulo(modulus)

    def shorten(self) -> None:
        """Set a long expression aside as a statement of its own."""
        if len(self.text) > LONG:
            self.before.append(("at", self.text))
            self._base, self._offset = "at", 0
        if not self.alignment.knows(4) and len(self.low) > LONG:
            self.before.append(("low", self.low))
            self._low, self._low_offset = "low", 0


def aligned_to_8(position: str) -> str:
    """Return the expression of the next multiple of 8 from an expression on."""
    base, offset = _align_up(position, 0, 8)
    return f"{base} + {offset}"


def _align_up(base: str, offset: int, align: int) -> tuple[str, int]:
    if align == 8:
        return f"({_sum(base, offset + 3)} & -8)", 4
    return f"({_sum(base, offset + align - 1)} & -{align})", 0


def _plus(base: str, size: str) -> str:
    return f"{base} + {size}" if base else size


def _sum(base: str, offset: int) -> str:
    if not base:
        return str(offset)
    return f"{base} + {offset}" if offset else base


class Cursor(msgspec.Struct, frozen=True):
    """The position `base + offset`, or `offset` alone."""

    base: str
    offset: int
    alignment: Alignment

    def text(self, by: int = 0) -> str:
        """Return the position `by` bytes further as an expression."""
        offset = self.offset + by
        if not self.base:
            return str(offset)
        if offset < 0:
            return f"{self.base} - {-offset}"
        return f"{self.base} + {offset}" if offset else self.base

    def skip(self, size: int) -> Cursor:
        """Return the position `size` bytes further."""
        return Cursor(self.base, self.offset + size, self.alignment.after(size))

    def at(self, base: str, offset: int = 0) -> Cursor:
        """Return the same position, held by another variable."""
        return Cursor(base, offset, self.alignment)

    def with_alignment(self, alignment: Alignment) -> Cursor:
        """Return the same position with another known alignment."""
        return Cursor(self.base, self.offset, alignment)


#: The end of the header.
START = Cursor("", 4, Alignment(8, 4))
