"""What is known, while emitting, of the position at which the next value will stand."""

from __future__ import annotations


class Position:
    """A position counted from the start of the buffer, as far as it is known.

    Its residue modulo `modulus` (8, 4, 2 or 1) is `residue`. Its value is `text`, an expression
    over the variable `at`, or a number while nothing of variable size came before. `low` agrees
    with it modulo 4 and is an expression over sizes since the last multiple of 4.
    """

    def __init__(self, modulus: int = 8, residue: int = 0, base: str = "", low: str = "") -> None:
        self.modulus = modulus
        self.residue = residue
        self._base = base
        self._offset = 0
        self._low = low
        self._low_offset = 0

    @classmethod
    def variable(cls, modulus: int, residue: int) -> Position:
        """Return a position that is in `at` and, modulo 4, in `low`."""
        return cls(modulus, residue % modulus, "at", "low")

    def known(self, align: int) -> bool:
        """Whether the residue modulo `align` is known."""
        return self.modulus >= align

    def aligned(self, align: int) -> bool:
        """Whether this is known to be a multiple of `align`, counted from the header's end."""
        return self.known(align) and (4 - self.residue) % align == 0

    @property
    def constant(self) -> bool:
        """Whether the position is a number."""
        return not self._base

    @property
    def text(self) -> str:
        """The position as an expression."""
        return _sum(self._base, self._offset)

    @property
    def low(self) -> str:
        """An expression that is equal to the position modulo 4."""
        if self.known(4):
            return str(self.residue % 4)
        return _sum(self._low, self._low_offset % 4)

    def advance(self, size: int) -> None:
        """Go `size` bytes ahead."""
        self._offset += size
        self._low_offset += size
        self.residue = (self.residue + size) % self.modulus

    def align(self, align: int) -> None:
        """Go to the next multiple of `align`, counted from the end of the header."""
        if self.known(align):
            self.advance((4 - self.residue) % align)
            return
        self._base, self._offset = align_up(self.text, align), 0
        self._low, self._low_offset = align_up(self.low, align), 0
        self.modulus, self.residue = align, 4 % align

    def skip(self, size: str, modulus: int) -> None:
        """Go ahead by an expression, which is a multiple of `modulus`."""
        self._base = f"{self.text} + {size}"
        self._low = size if self.low == "0" else f"{self.low} + {size}"
        self._offset = self._low_offset = 0
        self.modulus = min(self.modulus, modulus)
        self.residue %= self.modulus

    def meet(self, other: Position) -> Position:
        """Return a variable position of which only that is known that is true of both."""
        modulus = min(self.modulus, other.modulus)
        while self.residue % modulus != other.residue % modulus:
            modulus //= 2
        return Position.variable(modulus, self.residue)


def align_up(position: str, align: int) -> str:
    """Return the expression of the next multiple of `align` from an expression on."""
    if align == 8:
        return f"({position} + 3 & -8) + 4"
    return f"({position} + {align - 1} & -{align})"


def _sum(base: str, offset: int) -> str:
    if not base:
        return str(offset)
    return f"{base} + {offset}" if offset else base
