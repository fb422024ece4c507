"""What differs from processor to processor: numbers of the file format, and code."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple


class Machine(NamedTuple):
    """A processor and its machine code.

    A function of it ends where the next one begins. `holes` are the places in `code` that depend
    on where something else is, with its name in the assembler text; `fill(code, at, here, target)`
    fills the one at `at`, which will be at the address `here`.
    """

    number: int
    relative: int
    absolute: int
    page: int
    properties: bytes
    code: bytes
    entries: Mapping[str, int]
    holes: Mapping[int, str]
    fill: Callable[[bytearray, int, int, int], None]

    def function(self, name: str) -> tuple[bytes, dict[int, str]]:
        """Return the code of a function, and its holes by their places in it."""
        start = self.entries[name]
        end = min((at for at in self.entries.values() if at > start), default=len(self.code))
        holes = {at - start: symbol for at, symbol in self.holes.items() if start <= at < end}
        return self.code[start:end], holes
