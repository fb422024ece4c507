"""Columns of serialized messages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import numpy as np

#: In a structured array texts take as much room as the longest of their column. So many bytes are
#: always taken, and more only up to so many for each byte of the columns.
ALWAYS_TAKEN = 1 << 28
MOST_PER_BYTE = 100


class Column:
    """The base of Texts, Ragged and Columns: access to elements, as of a list."""

    __slots__ = ()

    def __iter__(self: Any) -> Iterator[Any]:
        return map(self.__getitem__, range(len(self)))

    def __repr__(self: Any) -> str:
        more = ", ..." if len(self) > 3 else ""
        shown = ", ".join(map(repr, self[:3].to_list()))
        return f"<{type(self).__name__} of {len(self)}: {shown}{more}>"

    def _index(self: Any, place: Any) -> int:
        """Return the index of one element, counted from the front."""
        index: int = range(len(self))[place]
        return index


class _Sliced(Column):
    """Elements that are slices of `values`, from each of `offsets` to the next one.

    `size` is that of every element if the type has a fixed one.
    """

    __slots__ = ("offsets", "size", "values")

    def __init__(self, offsets: Any, values: Any, size: int | None = None) -> None:
        self.offsets = offsets
        self.values = values
        self.size = size

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def sizes(self) -> Any:
        """The sizes of the elements."""
        return np.diff(self.offsets)

    def __getitem__(self, place: Any) -> Any:
        if not isinstance(place, slice):
            index = self._index(place)
            return self.values[self.offsets[index] : self.offsets[index + 1]]
        first, last, step = place.indices(len(self))
        if step != 1:
            raise ValueError("a slice of this column cannot have a step")
        offsets = self.offsets[first : max(first, last) + 1]
        values = self.values[offsets[0] : offsets[-1]]
        return type(self)(offsets - offsets[0], values, self.size)


class Texts(_Sliced):
    """A column of texts: `values` are their bytes in UTF-8, one after the other."""

    __slots__ = ()

    def __getitem__(self, place: Any) -> Any:
        element = super().__getitem__(place)
        return element if isinstance(place, slice) else element.tobytes().decode()

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

    def to_list(self) -> list[Any]:
        """Return a list for each sequence, of elements as `to_dict` of messages has them."""
        elements = column_list(self.values)
        return [elements[a:b] for a, b in pairwise(self.offsets.tolist())]

    def stacked(self) -> Any:
        """Return numbers as an array of two dimensions or more.

        Raises ValueError where a sequence has another size than the first.
        """
        sizes, values = self.sizes, self.values
        if not isinstance(values, np.ndarray):
            raise TypeError("only numbers can be stacked")
        other = self.uneven()
        if other is not None:
            raise ValueError(f"[{other}] has {sizes[other]} elements and [0] has {sizes[0]}")
        size = int(sizes[0]) if len(sizes) else 0
        return values.reshape(len(self), size, *values.shape[1:])

    def uneven(self) -> int | None:
        """Return the index of the first sequence that has another size than the first one."""
        other = np.flatnonzero(self.sizes != self.sizes[:1])
        return int(other[0]) if len(other) else None


class Columns(Column):
    """Columns by name, with a row for each message or element."""

    __slots__ = ("_columns", "_count", "_times")

    def __init__(
        self, columns: dict[str, Any], count: int, times: Mapping[str, str] | None = None
    ) -> None:
        """Name times and durations in `times`, with numpy's code, such as "M8[ns]"."""
        self._columns = columns
        self._count = count
        self._times = times or {}

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
            columns = {name: column[place] for name, column in self._columns.items()}
            return Columns(columns, len(range(self._count)[place]), self._times)
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
        return [dict(zip(self._columns, row, strict=True)) for row in zip(*lists, strict=True)]

    def structured(self) -> Any:
        """Return a structured array, with texts as bytes in UTF-8.

        Raises ValueError where it cannot hold them: where a sequence has another size than the
        first, or where the longest text would take room in each row that few of them need.
        """
        dtype = _dtype(self, "[{}]")
        needed, present = self._count * dtype.itemsize, _size_of(self)
        if needed > max(ALWAYS_TAKEN, MOST_PER_BYTE * present):
            raise ValueError(
                f"the array would take {needed:,} bytes for {present:,} bytes of columns, "
                f"as each text takes as much as the longest of its column"
            )
        result = np.zeros(self._count, dtype)
        _fill(result, self)
        return result

    @property
    def times(self) -> Mapping[str, str]:
        """The columns that are times and durations, with numpy's code of each."""
        return self._times

    def flat(self) -> dict[str, Any]:
        """Return all columns that are no Columns, by names such as "header.stamp.sec"."""
        result: dict[str, Any] = {}
        for name, column in self._columns.items():
            if isinstance(column, Columns):
                result |= {f"{name}.{below}": leaf for below, leaf in column.flat().items()}
            else:
                result[name] = column
        return result

    def flattened(self) -> Columns:
        """Return the columns of `flat()`."""
        return Columns(self.flat(), self._count)

    def dated(self) -> Columns:
        """Return the columns with times as datetime64 and durations as timedelta64."""
        columns = {
            name: _dated(column, self._times.get(name)) for name, column in self._columns.items()
        }
        return Columns(columns, self._count)

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame` with the columns of `flat()`, and times as datetime64[ns]."""
        with needing("pandas", "to_pandas"):
            import pandas  # noqa: F401 # pyarrow would not say how to install it
        with needing("pyarrow", "to_pandas"):
            return record_batch(self.dated().flattened()).to_pandas()

    def to_polars(self) -> Any:
        """Return a `polars.DataFrame` with the columns of `flat()`, and times as Datetime."""
        with needing("polars", "to_polars"):
            import polars
        with needing("pyarrow", "to_polars"):
            return polars.from_arrow(record_batch(self.dated().flattened()))


def _dated(column: Any, code: str | None) -> Any:
    """Return a column as `dated` has it; `code` is numpy's if it has times."""
    if isinstance(column, Ragged):
        return Ragged(column.offsets, _dated(column.values, code), column.size)
    if isinstance(column, Columns) and code:
        seconds, nanoseconds = dict(column).values()
        column = seconds.astype(np.int64) * 1_000_000_000 + nanoseconds
    if isinstance(column, Columns):
        return column.dated()
    return column.view(code) if code else column


# tables of Arrow


@contextmanager
def needing(library: str, method: str) -> Iterator[None]:
    """Say how to install a library that a method imports."""
    try:
        yield
    except ImportError as error:
        what = f"{method} needs {library}, which cannot be imported ({error})"
        raise ImportError(f"{what}: pip install {library}", name=library) from error


def record_batch(columns: Columns, dictionary: bool = False) -> Any:
    """Return a `pyarrow.RecordBatch` with the buffers of columns.

    With `dictionary`, texts are dictionary-encoded.
    """
    import pyarrow

    return pyarrow.RecordBatch.from_struct_array(_arrow(pyarrow, columns, dictionary))


#: The constructors of times in Arrow, by the kind of their dtype.
TIMES = {"M": "timestamp", "m": "duration"}


def _arrow(pa: Any, column: Any, dictionary: bool) -> Any:
    """Return the array of a column. `pa.array` would import pandas."""

    def of_buffers(type_: Any, *buffers: Any, children: Any = None) -> Any:
        valid = None
        if isinstance(column, np.ma.MaskedArray):
            mask = np.ma.getmaskarray(column)
            valid = pa.py_buffer(np.packbits(~mask, bitorder="little"))
        every = [valid, *map(pa.py_buffer, buffers)]
        return pa.Array.from_buffers(type_, len(column), every, children=children)

    if isinstance(column, Columns):
        arrays = {name: _arrow(pa, inner, dictionary) for name, inner in dict(column).items()}
        type_ = pa.struct([pa.field(name, array.type) for name, array in arrays.items()])
        return of_buffers(type_, children=[*arrays.values()])
    if isinstance(column, Texts):
        texts = of_buffers(pa.large_string(), column.offsets, column.values)
        return texts.dictionary_encode() if dictionary else texts
    if isinstance(column, Ragged):
        values = column.values
        is_numbers = isinstance(values, np.ndarray) and values.ndim == 1
        if is_numbers and values.dtype == np.uint8:
            return of_buffers(pa.large_binary(), column.offsets, values)
        inner = _arrow(pa, values, dictionary)
        if column.size is not None:
            return of_buffers(pa.list_(inner.type, column.size), children=[inner])
        return of_buffers(pa.large_list(inner.type), column.offsets, children=[inner])
    if column.ndim > 1 and column.dtype == np.uint8:
        return of_buffers(pa.binary(column.shape[1]), column)
    if column.ndim > 1:
        inner = _arrow(pa, column.reshape(-1), dictionary)
        return pa.FixedSizeListArray.from_arrays(inner, column.shape[1])
    if column.dtype.kind in TIMES:
        return of_buffers(getattr(pa, TIMES[column.dtype.kind])("ns"), column.view(np.int64))
    if column.dtype == np.bool_:
        return of_buffers(pa.bool_(), np.packbits(column, bitorder="little"))
    return of_buffers(pa.from_numpy_dtype(column.dtype), column)


# structured arrays


def _dtype(column: Any, path: str) -> Any:
    """Return the dtype of a column at a path, in which `{}` stands for the row."""
    if isinstance(column, Columns):
        inner = dict(column).items()
        return np.dtype([(name, _dtype(inside, f"{path}.{name}")) for name, inside in inner])
    if isinstance(column, np.ma.MaskedArray):
        row = int(np.ma.getmaskarray(column).argmax())
        raise ValueError(f"{path.format(row)}: is missing; a structured array has no gaps")
    if isinstance(column, np.ndarray):
        return np.dtype((column.dtype, column.shape[1:]))
    sizes = column.sizes
    if isinstance(column, Texts):
        return np.dtype(f"S{max(1, int(sizes.max(initial=0)))}")
    other = column.uneven()
    if other is not None:
        raise ValueError(
            f"{path.format(other)}: has {sizes[other]} elements and {sizes[0]} before; "
            f"a structured array needs the same number in each"
        )
    element = _dtype(column.values, path.removeprefix("[{}]."))
    return np.dtype((element, (int(sizes[0]) if len(sizes) else 0,)))


def _size_of(column: Any) -> int:
    """Return the number of bytes in a column."""
    if isinstance(column, Columns):
        return sum(map(_size_of, dict(column).values()))
    if isinstance(column, np.ndarray):
        return column.nbytes
    return int(column.offsets.nbytes) + _size_of(column.values)


def _fill(target: Any, column: Any) -> None:
    """Copy a column to where a structured array has it."""
    if isinstance(column, Columns):
        for name, inner in dict(column).items():
            _fill(target[name], inner)
    elif isinstance(column, Ragged):
        _fill(target, column.values)
    elif isinstance(column, Texts):  # numpy has all as wide
        rows, width = column.values, target.itemsize
        if len(rows) != len(column) * width:
            rows = np.zeros((len(column), width), np.uint8)
            rows[np.arange(width) < column.sizes[:, None]] = column.values
        rows = np.ascontiguousarray(rows).reshape(-1).view(f"S{width}")
        target[...] = rows.reshape(target.shape)
    else:
        target[...] = column.reshape(target.shape)


def column_list(column: Any) -> Any:
    """Return any column's elements as objects of Python."""
    return column.tolist() if isinstance(column, np.ndarray) else column.to_list()
