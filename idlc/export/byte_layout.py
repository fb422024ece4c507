"""Where the fields of a structure stand in its bytes (language 8), as far as that is known.

Offsets count from the end of the four bytes of the header, from where values align.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple, TypeAlias

from idlc.model import ir

Messages: TypeAlias = Mapping[ir.TypeName, ir.Message]
#: The widest alignment that there is.
_WIDEST = 8
_COUNT = 4


class Extent(NamedTuple):
    """A number of bytes: exactly that many, or at least."""

    size: int
    exact: bool = True

    def __str__(self) -> str:
        return f"{self.size}" if self.exact else f"≥{self.size}"

    @property
    def in_bytes(self) -> str:
        """The number in words, such as `1 byte`."""
        return f"{self} byte" if self == Extent(1) else f"{self} bytes"


class Placed(NamedTuple):
    """A field with its offset and its size, without the padding before it."""

    field: ir.Field
    offset: Extent
    size: Extent


def layout(message: ir.Message, messages: Messages) -> tuple[list[Placed], Extent]:
    """Return the fields of a structure that was linked without errors, and the size of all."""
    return _Layouts(messages).fields(message.wire_fields, 0)


class _Layouts:
    """Lays structures out; each is laid out once for each alignment that it begins at."""

    def __init__(self, messages: Messages) -> None:
        self._messages = messages
        self._known: dict[tuple[ir.TypeName, int], Extent] = {}

    def fields(self, fields: Iterable[ir.Field], start: int) -> tuple[list[Placed], Extent]:
        """Return fields from an offset on, and the bytes to the end of the last."""
        placed = []
        at, exact = start, True
        for field in fields:
            at += -at % self._alignment(field.type)
            size = self._size(field.type, at)
            placed.append(Placed(field, Extent(at, exact), size._replace(exact=size.exact)))
            at, exact = at + size.size, exact and size.exact
        return placed, Extent(at - start, exact)

    def _alignment(self, type_: ir.FieldType) -> int:
        """Return what the first value of a type aligns to."""
        match type_:
            case ir.Primitive():
                return type_.info.size
            case ir.Array():
                return self._alignment(type_.element)
            case ir.Ref():
                return self._alignment(self._messages[type_.target].wire_fields[0].type)
        return _COUNT

    def _size(self, type_: ir.FieldType, at: int) -> Extent:
        """Return the size of a value at an offset; of what varies, the least."""
        match type_:
            case ir.Primitive():
                return Extent(type_.info.size)
            case ir.String():
                # the zero after a string is sent, the one after a wstring is not
                return Extent(_COUNT + (not type_.wide), exact=False)
            case ir.Array():
                return self._repeated(type_.element, type_.size, at)
            case ir.Ref():
                return self._structure(type_.target, at % _WIDEST)
        return Extent(_COUNT, exact=False)

    def _structure(self, name: ir.TypeName, residue: int) -> Extent:
        known = self._known.get((name, residue))
        if known is None:
            known = self.fields(self._messages[name].wire_fields, residue)[1]
            self._known[name, residue] = known
        return known

    def _repeated(self, element: ir.Element, count: int, at: int) -> Extent:
        """Return the size of an array; after eight elements at most, all repeats."""
        start, exact = at, True
        seen: dict[int, tuple[int, int]] = {}
        left = count
        while left:
            if (residue := at % _WIDEST) in seen:
                left_then, at_then = seen[residue]
                rounds = left // (left_then - left)
                at += rounds * (at - at_then)
                left -= rounds * (left_then - left)
                seen.clear()
                if not left:
                    break
            seen[at % _WIDEST] = left, at
            at += -at % self._alignment(element)
            size = self._size(element, at)
            at, exact, left = at + size.size, exact and size.exact, left - 1
        return Extent(at - start, exact)
