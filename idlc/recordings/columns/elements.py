"""Elements of lists of numbers as columns: `position.elbow` by name, `covariance[8]` by index.

The names of elements are texts in a list beside, such as `name` of a JointState.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence, Sized
from typing import Any, NamedTuple

import numpy as np

from idlc.diagnostics.text import did_you_mean
from idlc.recordings.columns.values import Columns, Ragged
from idlc.runtime.typeinfo import Structure

_INDEX = re.compile(r"\[\d{1,9}\]", re.ASCII)
#: A warning lists at most so many names of elements, of at most so many characters.
MOST_NAMES = 100


class MissingElementWarning(UserWarning):
    """Many messages, but none of them has an element of that name."""


class ElementError(ValueError):
    """The names in a message do not say which element is meant; `row` counts messages from 0."""

    def __init__(self, row: int, problem: str) -> None:
        super().__init__(f"[{row}]: {problem}")
        self.row = row
        self.problem = problem


class ListElement(NamedTuple):
    """An element of the list `values`, by its place or its name, which is in the list `names`."""

    path: str
    values: str
    place: int = 0
    name: str = ""
    names: str = ""

    def column(self, columns: Columns) -> Any:
        """Return the values of the element in each message; those that it lacks are masked."""
        values = _at(columns, self.values)
        if isinstance(values, Ragged):
            starts, sizes, numbers = values.offsets[:-1], values.sizes, values.values
        else:
            sizes = np.full(len(values), values.shape[1])
            if self.place >= values.shape[1]:
                what = f"`{self.values}` has {values.shape[1]} elements, and no `{self.path}`"
                raise ValueError(what)
            starts, numbers = np.arange(len(values)) * values.shape[1], values.reshape(-1)
        if self.names:
            rows, indexes = self._places(_at(columns, self.names), sizes)
        else:
            rows = np.flatnonzero(self.place < sizes)
            indexes = self.place
        present = numbers[starts[rows] + indexes]
        if len(rows) == len(sizes):
            return present
        result = np.ma.MaskedArray(np.zeros(len(sizes), numbers.dtype), mask=True)
        result[rows] = present
        return result

    def index_in(self, names: Sequence[str], values: Sized) -> int | None:
        """Return the index of the element in one message, or None if the message lacks it."""
        if self.name not in names or not len(values):
            return None
        if names.count(self.name) > 1:
            raise ElementError(0, self._twice())
        if len(names) != len(values):
            raise ElementError(0, self._unequal(len(names), len(values)))
        return names.index(self.name)

    def _twice(self) -> str:
        return f"`{self.names}` has `{self.name}` more than once"

    def _unequal(self, names: int, values: int) -> str:
        return f"`{self.names}` has {names} names, and `{self.values}` has {values} elements"

    def _places(self, names: Ragged, sizes: Any) -> tuple[Any, Any]:
        """Return the messages that have the element, and its index in each."""
        texts, name = names.values, self.name.encode()
        places = np.flatnonzero(texts.sizes == len(name))
        for number, byte in enumerate(name):
            places = places[texts.values[texts.offsets[places] + number] == byte]
        rows = np.searchsorted(names.offsets, places, "right") - 1
        indexes = places - names.offsets[rows]
        twice = rows[1:][np.diff(rows) == 0]
        if len(twice):
            raise ElementError(int(twice[0]), self._twice())
        other = rows[(sizes[rows] != names.sizes[rows]) & (sizes[rows] > 0)]
        if len(other):
            row = int(other[0])
            raise ElementError(row, self._unequal(names.sizes[row], sizes[row]))
        if not len(rows) and len(names):
            self.warn(texts[:MOST_NAMES].to_list(), len(names))
        present = sizes[rows] > 0
        return rows[present], indexes[present]

    def warn(self, texts: list[str], count: int) -> None:
        """Warn that none of so many messages has the element, but others, with these names."""
        where = f"any of {count:,} messages"
        warnings.warn(MissingElementWarning(self.missing(texts, where)), stacklevel=2)

    def missing(self, texts: Iterable[str], where: str) -> str:
        """Return the sentence about messages that have these names instead."""
        known = sorted({text for text in texts if len(text) <= MOST_NAMES})
        hint = did_you_mean(self.name, known) or f"it has {', '.join(known) or 'none'}"
        return f"`{self.names}` has no `{self.name}` in {where}: {hint}"


def _at(columns: Columns, path: str) -> Any:
    column: Any = columns
    for name in path.split("."):
        column = column[name]
    return column


def element_of(structure: Structure, path: str) -> ListElement | None:
    """Return the element at a path, or None if the path leads to a field, or nowhere.

    Raises ValueError for an element that no message has, or that no list names.
    """
    inside: Structure | None = structure
    before = ""
    parts = path.split(".")
    for count, part in enumerate(parts, 1):
        fields = () if inside is None else inside.fields
        start = part.partition("[")[0]
        field = next((field for field in fields if field.name == start), None)
        if field is None:
            return None
        if field.is_list and field.primitive is not None:
            rest = ".".join(parts[count:])
            return _element(structure, path, f"{before}{start}", part[len(start) :], rest)
        inside = None if field.is_list or part != start else field.nested
        before += f"{part}."
    return None


def _element(
    structure: Structure, path: str, values: str, index: str, name: str
) -> ListElement | None:
    """Return the element of a list, which has either an index or a name."""
    if bool(index) == bool(name):
        return None
    if index:
        return ListElement(path, values, int(index[1:-1])) if _INDEX.fullmatch(index) else None
    names = names_of(structure, values)
    if len(names) == 1:
        return ListElement(path, values, name=name, names=names[0])
    several = " and ".join(f"`{name}`" for name in names)
    why = f"{several} may name" if names else "no list of texts names"
    hint = f"write an index, such as `{values}[0]`"
    raise ValueError(f"{structure.name} has no field {path!r}: {why} its elements; {hint}")


def names_of(structure: Structure, path: str) -> list[str]:
    """Return the lists of texts that may name the elements of a list.

    They are in the innermost message around the list that has any.
    """
    result: list[str] = []
    inside: Structure | None = structure
    prefix = ""
    for part in path.split("."):
        assert inside is not None
        texts = [f"{prefix}{field.name}" for field in inside.fields if field.is_list and field.text]
        result = texts or result
        inside = next(field.nested for field in inside.fields if field.name == part)
        prefix += f"{part}."
    return result


class ColumnSelection(NamedTuple):
    """Fields that are wanted, and elements of lists among them."""

    fields: tuple[str, ...]
    elements: tuple[ListElement, ...]

    @property
    def needed(self) -> tuple[str, ...]:
        """The fields that must be read."""
        lists = (path for each in self.elements for path in (each.values, each.names) if path)
        return (*self.fields, *lists)

    def columns(self, columns: Columns) -> Columns:
        """Return the columns of needed fields, with those of elements in place of their lists."""
        values = {element.path: element.column(columns) for element in self.elements}

        def placed(columns: Columns, prefix: str) -> Columns:
            result: dict[str, Any] = {}
            for name, column in dict(columns).items():
                path = f"{prefix}{name}"
                if any(f"{path}.".startswith(f"{field}.") for field in self.fields):
                    result[name] = column
                elif isinstance(column, Columns):
                    inner = placed(column, f"{path}.")
                    result |= {name: inner} if inner.keys() else {}
                for element in self.elements:
                    if element.values == path:
                        result[element.path.removeprefix(prefix)] = values[element.path]
            return Columns(result, len(columns), columns.times)

        return placed(columns, "")


def selected(structure: Structure, fields: tuple[str, ...]) -> ColumnSelection:
    """Return the fields and elements at paths."""
    every = {path: element_of(structure, path) for path in fields}
    elements = tuple(element for element in every.values() if element)
    return ColumnSelection(tuple(path for path, element in every.items() if not element), elements)
