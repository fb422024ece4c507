"""Where reading stands, while emitting: a variable and a distance, and what is known modulo 8."""

from __future__ import annotations

import msgspec

from idlc.emit.codec.alignment import Alignment


class Cursor(msgspec.Struct, frozen=True):
    """The position `base + offset`, or `offset` alone."""

    base: str
    offset: int
    known: Alignment

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
        return Cursor(self.base, self.offset + size, self.known.after(size))

    def at(self, base: str, offset: int = 0) -> Cursor:
        """Return the same position, held by another variable."""
        return Cursor(base, offset, self.known)

    def where(self, known: Alignment) -> Cursor:
        """Return the position with other knowledge of it."""
        return Cursor(self.base, self.offset, known)


#: The end of the header.
START = Cursor("", 4, Alignment(8, 4))
