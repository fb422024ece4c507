"""The offsets of a structure's fields in its bytes (language 8), as far as they are known.

Offsets count from the end of the four bytes of the header, where alignment starts.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple, TypeAlias

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.model import derive, ir
from idlc.model.link import Model


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
        """Return the alignment `size` bytes further."""
        return Alignment(self.modulus, (self.residue + size) % self.modulus)

    def modulo(self, modulus: int) -> Alignment:
        """Return the alignment modulo no more than `modulus`."""
        modulus = min(self.modulus, modulus)
        return Alignment(modulus, self.residue % modulus)

    def meet(self, other: Alignment) -> Alignment:
        """Return the alignment that holds for both positions."""
        modulus = min(self.modulus, other.modulus)
        while self.residue % modulus != other.residue % modulus:
            modulus //= 2
        return self.modulo(modulus)


def multiple_of(align: int) -> Alignment:
    """Return the alignment of any multiple of `align`."""
    return Alignment(align, 4 % align)


#: All structures by name.
Messages: TypeAlias = Mapping[ir.TypeName, ir.Message]
#: The widest alignment in CDR.
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
    """Lays structures out, each once for each alignment at which it begins."""

    def __init__(self, messages: Messages) -> None:
        self._messages = messages
        self._sizes: dict[tuple[ir.TypeName, int], Extent] = {}

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
        """Return the alignment of a type's first value."""
        match type_:
            case ir.Primitive():
                return type_.info.size
            case ir.Array():
                return self._alignment(type_.element)
            case ir.Ref():
                return self._alignment(self._messages[type_.target].wire_fields[0].type)
        return _COUNT

    def _size(self, type_: ir.FieldType, at: int) -> Extent:
        """Return the size of a value at an offset; the least, if it varies."""
        match type_:
            case ir.Primitive():
                return Extent(type_.info.size)
            case ir.String():
                # the zero after a string is sent, the one after a wstring is not
                return Extent(_COUNT + (not type_.wide), exact=False)
            case ir.Array():
                return self._repeated(type_.element, type_.size, at)
            case ir.Ref():
                key = type_.target, at % _WIDEST
                if key not in self._sizes:
                    fields = self._messages[type_.target].wire_fields
                    self._sizes[key] = self.fields(fields, at % _WIDEST)[1]
                return self._sizes[key]
        return Extent(_COUNT, exact=False)

    def _repeated(self, element: ir.Element, count: int, at: int) -> Extent:
        """Return the size of an array: all its elements but the first are at the same distance."""
        end, exact = at, True
        for number in range(min(count, 2)):
            start = end + -end % self._alignment(element)
            size = self._size(element, start)
            repeats = count - 1 if number else 1
            end, exact = end + repeats * (start + size.size - end), size.exact
        return Extent(end - at, exact)


MAX_FIELDS = 20_000
#: Each message imports the next: ten Python frames, of which there are a thousand at most.
MAX_DEPTH = 50
#: Of all structures of a package together.
MAX_PACKAGE_FIELDS = 2_000_000


class _ContentSize(NamedTuple):
    """The number of a structure's fields, nested ones included, and the depth of its nesting."""

    fields: int
    depth: int


def report_oversized(models: Iterable[Model], report: Report) -> None:
    """Report interfaces over a limit, unless errors are why sizes are not known."""
    if not report.had_errors:
        report.extend(oversized(*models))


def oversized(*models: Model) -> Iterator[Diagnostic]:
    """Yield a problem for each own interface of models that is over a limit, or for all of a model.

    Models that were compiled together are measured together, each structure once.
    """
    sizes: dict[ir.TypeName, _ContentSize] = {}
    for model in models:
        waiting = [message.name for own in model.own for message in derive.messages(own)]
        while waiting:  # each structure after its parts; with a stack, so depth is no limit
            name = waiting[-1]
            structure = model.messages[name]
            held = structure.references
            if missing := [reference for reference in held if reference not in sizes]:
                waiting += missing
                continue
            del waiting[-1]
            sizes[name] = _ContentSize(
                len(structure.wire_fields) + sum(sizes[reference].fields for reference in held),
                1 + max((sizes[reference].depth for reference in held), default=0),
            )
        total, refused = 0, False
        for interface in model.own:
            parts = [sizes[message.name] for message in derive.messages(interface)]
            fields, depth = max(part.fields for part in parts), max(part.depth for part in parts)
            total += sum(part.fields for part in parts)
            if fields > MAX_FIELDS:
                number = f"{fields:,}" if fields < 10**12 else "more than 10^12"
                message = f"`{interface.name}` has {number} fields, including nested fields"
                hint = f"split it up; idlc generates code for at most {MAX_FIELDS:,} fields"
            elif depth > MAX_DEPTH:
                message = f"`{interface.name}` nests messages {depth} deep"
                hint = f"flatten it; idlc generates code for at most {MAX_DEPTH} levels"
            else:
                continue
            refused = True
            yield codes.STRUCTURE_TOO_LARGE.of(ir.path_of(interface), message, hint=hint)
        if total > MAX_PACKAGE_FIELDS and not refused:
            message = f"`{model.package}` has {total:,} fields, including nested fields"
            hint = f"split it; idlc generates at most {MAX_PACKAGE_FIELDS:,} fields for a package"
            yield codes.STRUCTURE_TOO_LARGE.of(model.package, message, hint=hint)
