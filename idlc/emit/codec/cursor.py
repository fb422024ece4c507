"""Where reading stands, while emitting: a variable and a distance, and what is known modulo 8."""

from __future__ import annotations

import msgspec


class Cursor(msgspec.Struct, frozen=True):
    """The position `base + offset`, or `offset` alone; modulo `modulus` it is `residue`."""

    base: str = ""
    offset: int = 4
    modulus: int = 8
    residue: int = 4

    def text(self, by: int = 0) -> str:
        """Return the position `by` bytes further as an expression."""
        offset = self.offset + by
        if not self.base:
            return str(offset)
        if offset < 0:
            return f"{self.base} - {-offset}"
        return f"{self.base} + {offset}" if offset else self.base

    def padding(self, align: int) -> int:
        """Return the bytes to the next multiple of a known `align`, from the header's end on."""
        return (4 - self.residue) % align

    def aligned(self, align: int) -> bool:
        """Whether this is known to be a multiple of `align`, counted from the header's end."""
        return self.modulus >= align and self.padding(align) == 0

    def skip(self, size: int) -> Cursor:
        """Return the position `size` bytes further."""
        residue = (self.residue + size) % self.modulus
        return Cursor(self.base, self.offset + size, self.modulus, residue)

    def at(self, base: str, offset: int = 0) -> Cursor:
        """Return the same position, held by another variable."""
        return Cursor(base, offset, self.modulus, self.residue)

    def known(self, modulus: int, residue: int) -> Cursor:
        """Return the position with other knowledge of it."""
        return Cursor(self.base, self.offset, modulus, residue % modulus)

    def meet(self, other: Cursor) -> Cursor:
        """Return this with only that knowledge that is also true of `other`."""
        modulus = min(self.modulus, other.modulus)
        while self.residue % modulus != other.residue % modulus:
            modulus //= 2
        return self.known(modulus, self.residue)
