"""The content of a library on disk, read from its bytes, which are not trusted."""

from __future__ import annotations

from collections.abc import Iterator
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


def inspect(data: bytes) -> Inspected | None:
    """Return the content of a file; `None` if it is no shared library for Linux, or truncated."""
    try:
        kind, machine = unpack_from("<2H", data, 16)
        if not data.startswith(_HEADER) or kind != _SHARED:
            return None
        sections = list(_sections(data))
        symbols = frozenset(_symbols(data, sections))
        return Inspected(machine, symbols, _identity_stamp(data, sections))
    except (error, ValueError, IndexError, OverflowError):
        return None


class _SectionHeader(NamedTuple):
    type: int
    flags: int
    at: int
    size: int
    link: int


def _sections(data: bytes) -> Iterator[_SectionHeader]:
    (table,) = unpack_from("<Q", data, 40)
    (count,) = unpack_from("<H", data, 60)
    if table + count * SECTION > len(data):
        raise ValueError("torn")
    for index in range(count):
        yield _SectionHeader(*unpack_from("<4xIQ8x2QI", data, table + index * SECTION))


def _symbols(data: bytes, sections: list[_SectionHeader]) -> Iterator[str]:
    (table, *_) = (part for part in sections if part.type == _SYMBOLS)
    if table.at + table.size > len(data):
        raise ValueError("torn")
    names = sections[table.link]
    for at in range(table.at, table.at + table.size - SYMBOL + 1, SYMBOL):
        name, defined = unpack_from("<I2xH", data, at)
        text = data[names.at + name : names.at + name + LONGEST].partition(b"\0")[0]
        if defined and text:
            yield text.decode("ascii", "replace")


def _identity_stamp(data: bytes, sections: list[_SectionHeader]) -> bytes | None:
    size = len(identity_stamp(LAYOUTS["jazzy"]))
    starts = (part.at for part in sections if (part.type, part.flags) == _CONSTANTS)
    texts = (data[start : start + size] for start in starts)
    return next((text for text in texts if text.startswith(AUTHOR)), None)
