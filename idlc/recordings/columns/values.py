"""Columns of serialized messages."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np


class Column:
    """The base of Texts, Ragged and Columns: access to elements, as of a list."""

    __slots__ = ()

    def __len__(self) -> int:
        raise NotImplementedError

    def __getitem__(self, place: Any) -> Any:
        raise NotImplementedError

    def __iter__(self) -> Iterator[Any]:
        return map(self.__getitem__, range(len(self)))

    def __repr__(self) -> str:
        more = ", ..." if len(self) > 3 else ""
        shown = ", ".join(map(repr, self[:3].to_list()))
        return f"<{type(self).__name__} of {len(self)}: {shown}{more}>"

    def to_list(self) -> list[Any]:
        """Return the elements as objects of Python, as `to_dict` of messages has them."""
        raise NotImplementedError

    def _index(self, place: Any) -> int:
        """Return the index of one element, counted from the front."""
        index: int = range(len(self))[place]
        return index


class _Sliced(Column):
    """Elements that are slices of `values`, from each of `offsets` to the next one."""

    __slots__ = ("offsets", "values")

    def __init__(self, offsets: Any, values: Any) -> None:
        self.offsets = offsets
        self.values = values

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def sizes(self) -> Any:
        """The sizes of the elements."""
        return np.diff(self.offsets)

    def _slice(self, place: slice) -> Any:
        first, last, step = place.indices(len(self))
        if step != 1:
            raise ValueError("a slice of this column cannot have a step")
        offsets = self.offsets[first : max(first, last) + 1]
        values = self.values[offsets[0] : offsets[-1]]
        return type(self)(offsets - offsets[0], values)

    def _part(self, index: int) -> Any:
        return self.values[self.offsets[index] : self.offsets[index + 1]]


class Texts(_Sliced):
    """A column of texts: `values` are their bytes in UTF-8, one after the other."""

    __slots__ = ()

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return self._slice(place)
        return self._part(self._index(place)).tobytes().decode()

    def to_list(self) -> list[str]:
        """Return the texts."""
        raw = self.values.tobytes()
        ends = self.offsets.tolist()
        if raw.isascii():
            text = raw.decode()
            return [text[a:b] for a, b in pairwise(ends)]
        return [raw[a:b].decode() for a, b in pairwise(ends)]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.array(self.to_list(), dtype=dtype or str)


class Ragged(_Sliced):
    """A column of sequences: `values` are their elements, a column of its own."""

    __slots__ = ()

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return self._slice(place)
        return self._part(self._index(place))

    def to_list(self) -> list[Any]:
        """Return a list for each sequence."""
        elements = column_list(self.values)
        ends = self.offsets.tolist()
        return [elements[a:b] for a, b in pairwise(ends)]

    def stacked(self) -> Any:
        """Return numbers as an array of two dimensions or more.

        Raises ValueError where a sequence has another size than the first.
        """
        sizes = self.sizes
        values: Any = self.values
        if not isinstance(values, np.ndarray):
            raise TypeError("only numbers can be stacked")
        other = np.flatnonzero(sizes != sizes[:1])
        if len(other):
            raise ValueError(f"[{other[0]}] has {sizes[other[0]]} elements and [0] has {sizes[0]}")
        size = int(sizes[0]) if len(sizes) else 0
        return values.reshape(len(self), size, *values.shape[1:])


class Columns(Column):
    """Columns by name, with a row for each message or element."""

    __slots__ = ("_columns", "_count")

    def __init__(self, columns: dict[str, Any], count: int) -> None:
        self._columns = columns
        self._count = count

    def __len__(self) -> int:
        return self._count

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __getitem__(self, place: Any) -> Any:
        """Return a column by its name, a row as a dictionary, or some rows."""
        if isinstance(place, str):
            if place in self._columns:
                return self._columns[place]
            raise KeyError(f"no column {place!r}, but {', '.join(self._columns)}")
        if isinstance(place, slice):
            count = len(range(self._count)[place])
            columns = {name: column[place] for name, column in self._columns.items()}
            return Columns(columns, count)
        index = self._index(place)
        return self[index : index + 1].to_list()[0]

    def keys(self) -> list[str]:
        """Return the names of the columns."""
        return list(self._columns)

    def to_list(self) -> list[dict[str, Any]]:
        """Return each row as a dictionary."""
        if not self._columns:
            return [{} for _ in range(self._count)]
        lists = map(column_list, self._columns.values())
        names = self.keys()
        return [dict(zip(names, row, strict=True)) for row in zip(*lists, strict=True)]

    def flat(self) -> dict[str, Any]:
        """Return all columns that are no Columns, by names such as "header.stamp.sec"."""
        result: dict[str, Any] = {}
        for name, column in self._columns.items():
            if isinstance(column, Columns):
                inner = column.flat()
                result |= {f"{name}.{below}": leaf for below, leaf in inner.items()}
            else:
                result[name] = column
        return result


def column_list(column: Any) -> Any:
    """Return any column's elements as objects of Python."""
    return column.tolist() if isinstance(column, np.ndarray) else column.to_list()
