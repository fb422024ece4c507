"""The content of a library on disk, read from its bytes, which are not trusted."""

from __future__ import annotations

from struct import error, unpack_from
from typing import NamedTuple

from idlc.generate.native.elf import SECTION, SYMBOL
from idlc.generate.native.layouts import LAYOUTS
from idlc.generate.native.library import AUTHOR, identity_stamp

#: Longer names are no symbols of type support.
LONGEST = 2000
_HEADER = b"\x7fELF\2\1\1"  # of 64 bits, little-endian
_SHARED, _SYMBOLS = 3, 11
_CONSTANTS = (1, 2)  # content that is mapped, and neither written to nor run


class Inspected(NamedTuple):
    """A library: its processor's number, the symbols that it defines, and the stamp of idlc.

    That is `None` in a library that idlc did not make.
    """

    machine: int
    symbols: frozenset[str]
    stamp: bytes | None


class _SectionHeader(NamedTuple):
    type: int
    flags: int
    at: int
    size: int
    link: int


def inspect(data: bytes) -> Inspected | None:
    """Return the content of a file; `None` if it is no shared library for Linux, or truncated."""
    try:
        kind, machine = unpack_from("<2H", data, 16)
        (start,), (count,) = unpack_from("<Q", data, 40), unpack_from("<H", data, 60)
        end = start + count * SECTION
        if not data.startswith(_HEADER) or kind != _SHARED or end > len(data):
            return None
        rows = range(start, end, SECTION)
        sections = [_SectionHeader(*unpack_from("<4xIQ8x2QI", data, row)) for row in rows]
        (table, *_) = (part for part in sections if part.type == _SYMBOLS)
        if table.at + table.size > len(data):
            return None
        names = sections[table.link].at
        symbols = set()
        for at in range(table.at, table.at + table.size - SYMBOL + 1, SYMBOL):
            name, is_defined = unpack_from("<I2xH", data, at)
            text = data[names + name : names + name + LONGEST].partition(b"\0")[0]
            if is_defined and text:
                symbols.add(text.decode("ascii", "replace"))
    except (error, ValueError, IndexError, OverflowError):
        return None
    size = len(identity_stamp(LAYOUTS["jazzy"]))
    constants = (part.at for part in sections if (part.type, part.flags) == _CONSTANTS)
    stamps = (data[at : at + size] for at in constants)
    stamp = next((stamp for stamp in stamps if stamp.startswith(AUTHOR)), None)
    return Inspected(machine, frozenset(symbols), stamp)
