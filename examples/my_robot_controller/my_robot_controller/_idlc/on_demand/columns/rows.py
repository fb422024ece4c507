"""Columns as a structured array of numpy, where one can hold them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .plan import Instant, Lists, Node, Numbers, Strings, Struct
from .read import table_of
from .table import Elements, Reading, Table, columns_of, instants

#: Texts take as much room as the longest of their column. So many bytes are always taken, and
#: more only up to so many for each byte of the messages.
ALWAYS_TAKEN = 1 << 28
MOST_PER_BYTE = 100


class UnevenError(Exception):
    """What a structured array cannot hold."""


def to_columns(
    kind: type,
    messages: Any,
    fields: Iterable[str] | None = None,
    ragged: bool | None = None,
    datetimes: bool = False,
) -> Any:
    """Return a row for each message, as a structured array or as Columns."""
    table, top = table_of(kind, messages, fields, datetimes)
    if not ragged:
        try:
            return _structured(table, top)
        except UnevenError as error:
            if ragged is not None:
                raise ValueError(f"{error}; ragged=True takes it") from None
    return columns_of(table, top)


def _structured(table: Table, top: Elements) -> Any:
    node = top.level.node
    dtype = _Types(table, top).dtype(node, top, "")
    wanted, there = top.total * dtype.itemsize, table.size
    if wanted > max(ALWAYS_TAKEN, MOST_PER_BYTE * there):
        raise UnevenError(
            f"the array would take {wanted:,} bytes for {there:,} bytes of messages, "
            f"as each text takes as much as the longest of its column"
        )
    result = np.zeros(top.total, dtype)
    _Filling(table, top, table.numbers(top)).fill(node, result)
    return result


class _Types:
    """Finds the dtypes of columns; raises UnevenError where there is none."""

    def __init__(self, table: Table, top: Elements) -> None:
        self.table = table
        self.top = top

    def dtype(self, node: Node, elements: Elements, path: str) -> Any:
        """Return the dtype of a column."""
        if isinstance(node, Numbers):
            made: Any = np.dtype(node.code)
            return made if node.size is None else np.dtype((made, (node.size,)))
        if isinstance(node, Instant):
            return np.dtype(node.code)
        if isinstance(node, Struct):
            return np.dtype(
                [
                    (
                        name,
                        self.dtype(inner, elements, f"{path}.{name}" if path else name),
                    )
                    for name, inner in node.fields.items()
                ]
            )
        if isinstance(node, Lists):
            count, inside = self.count(node, elements, path)
            element = self.dtype(node.element, inside, path)
            return np.dtype((element, (count,)))
        if node.text.wide:
            raise UnevenError(
                f"{path} is a wstring, which no structured array can hold"
            )
        _, sizes = self.table.strings(elements, node)
        return np.dtype(f"S{max(1, int(sizes.max(initial=0)))}")

    def count(self, node: Lists, elements: Elements, path: str) -> tuple[int, Elements]:
        """Return how many elements all have, and what these are."""
        if node.step is None:
            assert node.size is not None
            return node.size, elements
        offsets, inside = self.table.list(elements, node.step)
        counts = np.diff(offsets)
        if not len(counts):
            return node.size or 0, inside
        other = np.flatnonzero(counts != counts[0])
        if len(other):
            where = f"[{other[0]}].{path}" if elements is self.top else path
            raise UnevenError(
                f"{where}: has {counts[other[0]]} elements and {counts[0]} before; "
                f"a structured array needs the same number in each"
            )
        return int(counts[0]), inside


class _Filling(Reading):
    """Copies columns of the elements of one level into a structured array."""

    def fill(self, node: Node, target: Any) -> None:
        """Copy a column."""
        if isinstance(node, Struct):
            for name, inner in node.fields.items():
                self.fill(inner, target[name])
        elif isinstance(node, Lists):
            self.lists(node, target)
        elif isinstance(node, Strings):
            self.strings(node, target)
        else:
            target[...] = self.value(node).reshape(target.shape)

    def strings(self, node: Strings, target: Any) -> None:
        """Copy a column of strings."""
        starts, sizes = self.table.strings(self.elements, node)
        found = self.table.source.strings(starts, sizes, target.dtype.itemsize)
        target[...] = found.reshape(target.shape)

    def value(self, node: Numbers | Instant) -> Any:
        """Return numbers or times, which may be in the buffer."""
        if isinstance(node, Instant):
            return instants(
                node, self.value(node.seconds), self.value(node.nanoseconds)
            )
        numbers, big = self.numbers[node.key], self.elements.big
        if node.code == "?" or big is not None:
            return self.table.native(numbers, node.code, big)
        return numbers

    def lists(self, node: Lists, target: Any) -> None:
        """Copy a column of sequences or arrays."""
        inside = self
        if node.step is not None:
            _, inside = self.inside(node.step, self.elements.big is None)
        inside.fill(node.element, target)
