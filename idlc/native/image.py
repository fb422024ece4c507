"""What a library holds, before it is known at which address."""

from __future__ import annotations

from struct import pack
from typing import NamedTuple

from idlc.native.machine import Machine

_WORD = 0xFFFF_FFFF_FFFF_FFFF


class Section:
    """Content of one kind. `pointers` are the words of it that will hold an address."""

    def __init__(self, data: bytes = b"", align: int = 8) -> None:
        self.align = align
        self.data = bytearray(data)
        self.address = 0
        self.pointers: list[tuple[int, Place]] = []

    def put(self, data: bytes, align: int = 1) -> Place:
        """Add bytes; return where they are."""
        self.data += bytes(-len(self.data) % align)
        place = Place(self, len(self.data))
        self.data += data
        return place

    def words(self, *values: int | Place | None) -> Place:
        """Add words of 8 bytes: numbers, addresses, NULL; return where they are.

        C structures are rows of words. What is smaller lies in the low bytes of its word, and what
        is too large wraps, as in C.
        """
        numbers = [value & _WORD if isinstance(value, int) else 0 for value in values]
        place = self.put(pack(f"<{len(values)}Q", *numbers), 8)
        for index, value in enumerate(values):
            if isinstance(value, Place):
                self.pointers.append((place.offset + 8 * index, value))
        return place


class Place(NamedTuple):
    """Where something is in a section."""

    section: Section
    offset: int

    @property
    def address(self) -> int:
        """Its address, after the sections were laid out."""
        return self.section.address + self.offset


class Image:
    """A library in the making, for one processor.

    `tables` hold addresses and are never written to after loading; `data` may be.
    """

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.constants, self.code = Section(), Section(align=16)
        self.tables, self.data = Section(), Section()
        self.exports: dict[str, Place] = {}
        self.imports: dict[str, Place] = {}
        self.needed: list[str] = []
        self.holes: list[tuple[int, Place]] = []
        self._strings: dict[str, Place] = {}
        self._functions: dict[tuple[object, ...], Place] = {}

    def string(self, text: str) -> Place:
        """Return where `text` is, as C has it; equal ones are stored once."""
        if text not in self._strings:
            self._strings[text] = self.constants.put(text.encode() + b"\0")
        return self._strings[text]

    def function(self, name: str, **symbols: Place) -> Place:
        """Return a function of the machine's, with these places for the symbols in its text."""
        key = (name, *((symbol, id(at), offset) for symbol, (at, offset) in symbols.items()))
        if key not in self._functions:
            code, holes = self.machine.function(name)
            place = self._functions[key] = self.code.put(code, 16)
            self.holes += [(place.offset + at, symbols[name]) for at, name in holes.items()]
        return self._functions[key]

    def imported(self, symbol: str, library: str) -> Place:
        """Return the word that will hold the address of another library's function."""
        if library not in self.needed:
            self.needed.append(library)
        if symbol not in self.imports:
            self.imports[symbol] = self.tables.words(None)
        return self.imports[symbol]
