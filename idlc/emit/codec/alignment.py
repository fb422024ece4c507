"""What is known of a position while statements are emitted."""

from __future__ import annotations

import msgspec


class Alignment(msgspec.Struct, frozen=True):
    """A position modulo `modulus` (8, 4, 2 or 1) is `residue`.

    Positions count from the start of the buffer; values align from the end of the header on, at 4.
    """

    modulus: int = 8
    residue: int = 0

    def knows(self, align: int) -> bool:
        """Return whether the padding to a multiple of `align` is known."""
        return self.modulus >= align

    def padding(self, align: int) -> int:
        """Return the bytes to the next multiple of an `align` that this knows."""
        return (4 - self.residue) % align

    def is_at(self, align: int) -> bool:
        """Return whether this is known to be a multiple of `align`."""
        return self.knows(align) and self.padding(align) == 0

    def after(self, size: int) -> Alignment:
        """Return what is known `size` bytes further."""
        return Alignment(self.modulus, (self.residue + size) % self.modulus)

    def modulo(self, modulus: int) -> Alignment:
        """Return what is known modulo no more than `modulus`."""
        modulus = min(self.modulus, modulus)
        return Alignment(modulus, self.residue % modulus)

    def meet(self, other: Alignment) -> Alignment:
        """Return only what is true of both."""
        modulus = min(self.modulus, other.modulus)
        while self.residue % modulus != other.residue % modulus:
            modulus //= 2
        return self.modulo(modulus)


def multiple_of(align: int) -> Alignment:
    """Return what is known of a multiple of `align`."""
    return Alignment(align, 4 % align)
