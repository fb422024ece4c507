"""A shared library for Linux: the ELF file of an image.

readable     headers, notes, symbols, relocations, constants
executable   code
writable     what is read-only after loading (up to the end of a page), then data
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from itertools import chain
from struct import pack, pack_into
from typing import NamedTuple


class Machine(NamedTuple):
    """A processor and its machine code.

    `code` is that of functions in hexadecimal digits; `holes` are the places in a function that
    depend on where something else is, with its name in the assembler text.
    `fill(code, at, address, target)` fills the one at `at`, which will be at `address`.
    """

    number: int
    relative: int
    absolute: int
    page: int
    properties: bytes
    code: Mapping[str, str]
    holes: Mapping[str, Mapping[int, str]]
    fill: Callable[[bytearray, int, int, int], None]


_WORD = 0xFFFF_FFFF_FFFF_FFFF


class ElfSection:
    """Content of one kind. `pointers` are the words of it that will hold an address."""

    def __init__(self, data: bytes = b"", align: int = 8) -> None:
        self.align = align
        self.data = bytearray(data)
        self.address = 0
        self.pointers: list[tuple[int, SectionPlace]] = []

    def put(self, data: bytes, align: int = 1) -> SectionPlace:
        """Add bytes; return their location."""
        self.data += bytes(-len(self.data) % align)
        place = SectionPlace(self, len(self.data))
        self.data += data
        return place

    def words(self, *values: int | SectionPlace | None) -> SectionPlace:
        """Add words of 8 bytes: numbers, addresses, NULL; return their location.

        C structures are rows of words. Smaller values are in the low bytes of a word, and larger
        ones wrap, as in C.
        """
        numbers = [value & _WORD if isinstance(value, int) else 0 for value in values]
        place = self.put(pack(f"<{len(values)}Q", *numbers), 8)
        for index, value in enumerate(values):
            if isinstance(value, SectionPlace):
                self.pointers.append((place.offset + 8 * index, value))
        return place


class SectionPlace(NamedTuple):
    """A location in a section."""

    section: ElfSection
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
        self.constants, self.code = ElfSection(), ElfSection(align=16)
        self.tables, self.data = ElfSection(), ElfSection()
        self.exports: dict[str, SectionPlace] = {}
        self.imports: dict[str, SectionPlace] = {}
        self.needed: list[str] = []
        self.holes: list[tuple[int, SectionPlace]] = []
        self._strings: dict[str, SectionPlace] = {}
        self._functions: dict[tuple[object, ...], SectionPlace] = {}

    def string(self, text: str) -> SectionPlace:
        """Return the location of `text` as a C string; equal ones are stored once."""
        if text not in self._strings:
            self._strings[text] = self.constants.put(text.encode() + b"\0")
        return self._strings[text]

    def function(self, name: str, **symbols: SectionPlace) -> SectionPlace:
        """Return a function of the machine's, with these places for the symbols in its text."""
        key = (name, *((symbol, id(at), offset) for symbol, (at, offset) in symbols.items()))
        if key not in self._functions:
            code, holes = self.machine.code[name], self.machine.holes.get(name, {})
            place = self._functions[key] = self.code.put(bytes.fromhex(code), 16)
            self.holes += [(place.offset + at, symbols[name]) for at, name in holes.items()]
        return self._functions[key]

    def imported(self, symbol: str, library: str) -> SectionPlace:
        """Return the word that will hold the address of another library's function."""
        if library not in self.needed:
            self.needed.append(library)
        if symbol not in self.imports:
            self.imports[symbol] = self.tables.words(None)
        return self.imports[symbol]


#: Sizes of the file's header, of a segment's and of a section's; of a symbol and a relocation.
HEADER, SEGMENT, SECTION, SYMBOL, RELOCATION = 64, 56, 64, 24, 24
NOTE_OF_CONTENT = pack("<3I4s20x", 4, 20, 3, b"GNU")  # NT_GNU_BUILD_ID
FUNCTION = 0x12  # STB_GLOBAL, STT_FUNC
READ, WRITE, EXECUTE = 4, 2, 1


class SectionKind(NamedTuple):
    """The kind of a section in its header: type, flags, linked section, size of entries."""

    type: int
    flags: int = 2  # SHF_ALLOC
    link: str = ""
    entry: int = 0


#: All sections in the file's order, by segment.
KINDS = {
    READ: {
        ".note.gnu.property": SectionKind(7),
        ".note.gnu.build-id": SectionKind(7),
        ".hash": SectionKind(5, link=".dynsym", entry=4),
        ".dynsym": SectionKind(11, link=".dynstr", entry=SYMBOL),
        ".dynstr": SectionKind(3),
        ".rela.dyn": SectionKind(4, link=".dynsym", entry=RELOCATION),
        ".rodata": SectionKind(1),
    },
    READ | EXECUTE: {".text": SectionKind(1, flags=6)},
    READ | WRITE: {
        ".dynamic": SectionKind(6, flags=3, link=".dynstr", entry=16),
        ".data.rel.ro": SectionKind(1, flags=3),
        ".data": SectionKind(1, flags=3),
    },
}
#: The dynamic tags of the loader, besides the needed libraries: SONAME, HASH, STRTAB, SYMTAB,
#: STRSZ, SYMENT, RELA, RELASZ, RELAENT, RELACOUNT, FLAGS, FLAGS_1, NULL.
TAGS = (14, 4, 5, 6, 10, 11, 7, 8, 9, 0x6FFFFFF9, 30, 0x6FFFFFFB, 0)
NOW, NODELETE = 1, 8  # rclcpp closes the library before it uses its handles for the last time
#: Besides loaded segments, those that locate something or declare a property.
SEGMENTS = len(KINDS) + 6


def shared_library(image: Image, name: str) -> bytes:
    """Return the content of the file called `name`."""
    return _File(image, name).link()


class _File:
    def __init__(self, image: Image, name: str) -> None:
        self.image = image
        self.name = name
        self.symbols = [*sorted(image.imports), *sorted(image.exports)]
        self.pointed = [s for s in (image.tables, image.data) if s.pointers]
        names = [*image.needed, name, *self.symbols]
        starts, text = _strings(names)
        self.start = dict(zip(names, starts, strict=True))
        words = len(image.needed) + len(TAGS)
        relocations = sum(len(s.pointers) for s in self.pointed) + len(image.imports)
        self.sections = {
            ".note.gnu.property": ElfSection(image.machine.properties),
            ".note.gnu.build-id": ElfSection(NOTE_OF_CONTENT, 4),
            ".hash": ElfSection(_hash_table(self.symbols)),
            ".dynsym": ElfSection(bytes(SYMBOL * (1 + len(self.symbols)))),
            ".dynstr": ElfSection(text, 1),
            ".rela.dyn": ElfSection(bytes(RELOCATION * relocations)),
            ".rodata": image.constants,
            ".text": image.code,
            ".dynamic": ElfSection(bytes(16 * words)),
            ".data.rel.ro": image.tables,
            ".data": image.data,
        }
        self.offsets: dict[str, int] = {}
        self.loaded: list[tuple[int, ...]] = []

    def link(self) -> bytes:
        """Return the file."""
        end = self._lay_out()
        self._relocate()
        self._fill_symbols()
        self._fill_dynamic()
        kinds = {name: kind for part in KINDS.values() for name, kind in part.items()}
        names = [*self.sections, ".shstrtab"]
        starts, text = _strings(names)
        table = end + len(text) + -(end + len(text)) % 8
        header = pack(
            "<4s5B7x2HI3QI6H", b"\x7fELF", 2, 1, 1, 0, 0, 3, self.image.machine.number, 1, 0,
            HEADER, table, 0, HEADER, SEGMENT, SEGMENTS, SECTION, len(names) + 1, len(names),
        )  # fmt: skip
        file = bytearray(table)
        parts: list[tuple[int, bytes | bytearray]] = [(0, header + self._segments()), (end, text)]
        parts += [(self.offsets[name], section.data) for name, section in self.sections.items()]
        for at, data in parts:
            file[at : at + len(data)] = data
        file += bytes(SECTION)
        for start, (name, section) in zip(starts, self.sections.items(), strict=False):
            kind = kinds[name]
            where = (section.address, self.offsets[name], len(section.data))
            link = 1 + names.index(kind.link) if kind.link else 0
            local = 1 if name == ".dynsym" else 0  # symbols that nobody else sees: the first one
            refers = (link, local, section.align, kind.entry)
            file += pack("<2I4Q2I2Q", start, kind.type, kind.flags, *where, *refers)
        file += pack("<2I4Q2I2Q", starts[-1], 3, 0, 0, end, len(text), 0, 0, 1, 0)
        at = self.offsets[".note.gnu.build-id"] + len(NOTE_OF_CONTENT) - 20
        file[at : at + 20] = hashlib.sha256(file).digest()[:20]
        return bytes(file)

    def _lay_out(self) -> int:
        """Give each section its place, and return where the last one ends in the file.

        Each segment is mapped some pages further on than it is in the file, so that it shares none.
        """
        at, page = 0, self.image.machine.page
        for index, (flags, kinds) in enumerate(KINDS.items()):
            at, distance = at + -at % 16, index * page
            if flags & WRITE:
                at += -(at + self._constant_size()) % page
            start = at
            at += 0 if index else HEADER + SEGMENT * SEGMENTS
            for name in kinds:
                section = self.sections[name]
                at += -at % section.align
                self.offsets[name] = at
                section.address = at + distance
                at += len(section.data)
            self.loaded.append((1, flags, start, start + distance, at - start, page))
        return at

    def _constant_size(self) -> int:
        """Return the size of the sections that are read-only after loading."""
        size = len(self.sections[".dynamic"].data) + len(self.image.tables.data)
        return size + -size % 8

    def _relocate(self) -> None:
        """Fill in addresses, and add a relocation for each that the loader changes."""
        machine, table, at = self.image.machine, self.sections[".rela.dyn"].data, 0
        for section in self.pointed:
            for where, place in section.pointers:
                target = place.address
                pack_into("<Q", section.data, where, target)
                address = section.address + where
                pack_into("<2Qq", table, at, address, machine.relative, target)
                at += RELOCATION
        for index, name in enumerate(sorted(self.image.imports), 1):
            info = index << 32 | machine.absolute
            pack_into("<2Qq", table, at, self.image.imports[name].address, info, 0)
            at += RELOCATION
        code = self.image.code
        for at, place in self.image.holes:
            machine.fill(code.data, at, code.address + at, place.address)

    def _fill_symbols(self) -> None:
        text = 1 + list(self.sections).index(".text")
        size = len(self.image.machine.code["get"]) // 2
        for index, name in enumerate(self.symbols, 1):
            place = self.image.exports.get(name)
            where = (text, place.address, size) if place else (0, 0, 0)
            row = (self.start[name], FUNCTION, 0, *where)
            pack_into("<I2BH2Q", self.sections[".dynsym"].data, SYMBOL * index, *row)

    def _fill_dynamic(self) -> None:
        at = {name: section.address for name, section in self.sections.items()}
        size = {name: len(section.data) for name, section in self.sections.items()}
        relative = size[".rela.dyn"] // RELOCATION - len(self.image.imports)
        values = [self.start[self.name], at[".hash"], at[".dynstr"], at[".dynsym"]]
        values += [size[".dynstr"], SYMBOL, at[".rela.dyn"], size[".rela.dyn"], RELOCATION]
        values += [relative, 8, NOW | NODELETE, 0]  # 8: BIND_NOW
        words = [(1, self.start[name]) for name in self.image.needed]  # NEEDED
        words += zip(TAGS, values, strict=True)
        pack_into(f"<{2 * len(words)}Q", self.sections[".dynamic"].data, 0, *chain(*words))

    def _segments(self) -> bytes:
        def of(kind: int, flags: int, name: str, size: int | None = None) -> tuple[int, ...]:
            section = self.sections[name]
            size = len(section.data) if size is None else size
            return kind, flags, self.offsets[name], section.address, size, section.align

        rows = [
            *self.loaded,
            of(2, READ | WRITE, ".dynamic"),
            of(4, READ, ".note.gnu.property"),
            of(4, READ, ".note.gnu.build-id"),
            of(0x6474E553, READ, ".note.gnu.property"),
            of(0x6474E552, READ, ".dynamic", self._constant_size()),  # read-only after loading
            (0x6474E551, READ | WRITE, 0, 0, 0, 16),  # the stack is not executable
        ]
        return b"".join(
            pack("<2I6Q", kind, flags, at, address, address, size, size, align)
            for kind, flags, at, address, size, align in rows
        )


def _strings(names: list[str]) -> tuple[list[int], bytes]:
    """Return the offset of each name in a string table, and the table."""
    starts, text = [], b"\0"
    for name in names:
        starts.append(len(text))
        text += name.encode() + b"\0"
    return starts, text


def _hash_table(symbols: list[str]) -> bytes:
    """Return the table by which a loader finds symbols, which count from 1."""
    buckets, chains = [0] * (len(symbols) | 1), [0] * (1 + len(symbols))
    for index, name in enumerate(symbols, 1):
        value = 0
        for byte in name.encode():
            value = (value << 4) + byte
            value = (value ^ (value & 0xF0000000) >> 24) & 0x0FFFFFFF
        bucket = value % len(buckets)
        chains[index], buckets[bucket] = buckets[bucket], index
    words = (len(buckets), len(chains), *buckets, *chains)
    return pack(f"<{len(words)}I", *words)
