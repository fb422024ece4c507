"""Many serialized messages of one type as a numpy structured array, without making messages.

Where the fields of a message are depends on the sizes of its texts and sequences alone. So one
message is walked field by field; all others of the same length that have the same sizes in the
same places, mostly all, are copied with it, field by field for all at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from struct import Struct
from typing import Any, NamedTuple

import numpy as np

from ..codec import order_of
from ..errors import DecodeError
from .batches import failed
from .typeinfo import FieldInfo, fields_of, type_name

#: Messages of more different layouts are not what columns are for.
MOST_LAYOUTS = 1000
#: Nor are texts of which few are long: all take as much room as the longest. So many bytes are
#: always taken, and more only up to so many for each byte of the messages.
ALWAYS_TAKEN = 1 << 28
MOST_PER_BYTE = 100


class Shape(NamedTuple):
    """What a column holds: numbers of a dtype, texts up to a size, or a structure of columns.

    `length` is the number of elements of an array or sequence.
    """

    element: str | int | dict[str, Shape]
    length: int | None = None


class Leaf(NamedTuple):
    """Where all numbers, or all texts, of one column are in a message.

    `path` leads to the column; a number in it is an index. `repeats` has the count and distance
    in bytes of what repeats around and in the column, outermost first.
    """

    path: tuple[str | int, ...]
    offset: int
    dtype: str
    repeats: tuple[tuple[int, int], ...] = ()


def to_columns(kind: type, buffers: Iterable[Any]) -> Any:
    """Return one row for each buffer."""
    name = type_name(kind)
    raws = [raw if type(raw) is bytes else memoryview(raw).cast("B") for raw in buffers]
    sizes = np.fromiter(map(len, raws), np.int64, len(raws))
    parts: list[tuple[np.ndarray[Any, Any], _Walk, np.ndarray[Any, Any]]] = []
    for size in dict.fromkeys(sizes.tolist()):
        rows = np.flatnonzero(sizes == size)
        chosen = raws if len(rows) == len(raws) else [raws[row] for row in rows]
        joined = bytearray().join(chosen)
        block = np.frombuffer(joined, np.uint8).reshape(len(rows), size)
        while len(rows):
            if len(parts) == MOST_LAYOUTS:
                raise ValueError(
                    f"the messages have more than {MOST_LAYOUTS} different layouts"
                )
            walk = _walk(raws[rows[0]], name, int(rows[0]))
            same = walk.same_layout(block)
            parts.append((rows[same], walk, block if same.all() else block[same]))
            rows, block = rows[~same], block[~same]
    shape = parts[0][1].shape if parts else Shape(_absent(name))
    for rows, walk, _ in parts[1:]:
        shape = _merged(shape, walk.shape, f"[{rows[0]}]")
    dtype = _dtype(shape)
    wanted = len(raws) * dtype.itemsize
    if wanted > max(ALWAYS_TAKEN, MOST_PER_BYTE * int(sizes.sum())):
        raise ValueError(
            f"the columns would take {wanted:,} bytes for {sizes.sum():,} bytes of messages, "
            f"as each text takes as much as the longest of its column"
        )
    return _filled(parts, dtype, len(raws))


def _filled(parts: Any, dtype: Any, count: int) -> Any:
    """Return the rows that the parts hold."""
    result = np.zeros(count, dtype)
    for rows, walk, block in parts:
        target = result if len(rows) == count else np.zeros(len(rows), dtype)
        for leaf in walk.leaves:
            _copy(leaf, block, target)
        if target is not result:
            result[rows] = target
    return result


def _copy(leaf: Leaf, block: Any, rows: Any) -> None:
    """Copy one column out of many messages of one layout."""
    target = rows
    for step in leaf.path:
        target = target[step] if isinstance(step, str) else target[..., step]
    counts, distances = zip((len(block), block.shape[1]), *leaf.repeats, strict=True)
    dtype = np.dtype(leaf.dtype)
    source: Any = np.ndarray(counts, dtype, block, leaf.offset, distances)
    # every byte but zero is true
    target[...] = source.view(np.uint8) != 0 if dtype.kind == "b" else source


def _dtype(shape: Shape) -> Any:
    element = shape.element
    if isinstance(element, dict):
        made: Any = np.dtype([(name, _dtype(inner)) for name, inner in element.items()])
    else:
        made = np.dtype(f"S{element or 1}" if isinstance(element, int) else element)
    return made if shape.length is None else np.dtype((made, (shape.length,)))


def _merged(one: Shape, other: Shape, path: str) -> Shape:
    """Return the shape that holds both; raise ValueError if none does."""
    if one.length != other.length:
        raise ValueError(
            f"{path}: has {other.length} elements and {one.length} in a message before; "
            f"a column needs the same number in each"
        )
    mine, theirs = one.element, other.element
    if isinstance(mine, int) and isinstance(theirs, int):
        return Shape(max(mine, theirs), one.length)
    if isinstance(mine, dict) and isinstance(theirs, dict):
        inner = {
            name: _merged(shape, theirs[name], f"{path}.{name}")
            for name, shape in mine.items()
        }
        return Shape(inner, one.length)
    return one


def _absent(name: str) -> dict[str, Shape]:
    """Return the columns of a structure of which there is none."""
    return {field.name: _absent_field(field) for field in fields_of(name)}


def _absent_field(field: FieldInfo) -> Shape:
    count = 0 if field.is_sequence else field.size
    if field.nested:
        return Shape(_absent(field.nested), count)
    return Shape(0 if field.text else _code(field), count)


def _walk(raw: Any, name: str, index: int) -> _Walk:
    """Return the layout of one message, the one at `index`."""
    try:
        return _Walk(bytes(raw), name)
    except DecodeError as error:
        failed(error, index)


class _Walk:
    """The layout of one message: its columns, and the sizes that it depends on."""

    def __init__(self, data: bytes, name: str) -> None:
        self.data = data
        self.order = order_of(data)
        self.at = 4
        self.leaves: list[Leaf] = []
        #: Where the header and all sizes are that decide about the layout.
        self.sizes = [slice(0, 2)]
        self.shape = Shape(self.structure(name, ()))

    def same_layout(self, block: Any) -> Any:
        """Return which rows of a block, messages as long as this one, have its layout."""
        same = np.ones(len(block), bool)
        for place in self.sizes:
            wanted = np.frombuffer(self.data[place], np.uint8)
            same &= (block[:, place] == wanted).all(axis=1)
        return same

    def structure(self, name: str, path: tuple[str | int, ...]) -> dict[str, Shape]:
        """Walk over a structure."""
        fields = fields_of(name)
        if not fields:
            self.take(1, 1, path)
        return {field.name: self.field(field, (*path, field.name)) for field in fields}

    def field(self, field: FieldInfo, path: tuple[str | int, ...]) -> Shape:
        """Walk over a field."""
        if not field.is_list:
            return self.element(field, path)
        count = self.size(path) if field.size is None else field.size
        if field.primitive is not None:
            if count:
                self.numbers(field, path, count)
            return Shape(_code(field), count)
        self.room(count * (4 if field.text else 1), path)
        shapes = list(self.elements(field, path, count))
        shape = shapes[0] if shapes else _absent_field(field)
        for other in shapes[1:]:
            shape = _merged(shape, other, _text(path))
        return Shape(shape.element, count)

    def elements(
        self, field: FieldInfo, path: tuple[str | int, ...], count: int
    ) -> Iterator[Shape]:
        """Walk over elements; if two have the same layout by themselves, so have all."""
        starts, sizes = [], len(self.sizes)
        for index in range(count):
            starts.append((self.at, len(self.leaves)))
            yield self.element(field, (*path, index))
            if (
                index == 1
                and len(self.sizes) == sizes
                and self.repeat(starts, count, path)
            ):
                return

    def repeat(
        self, starts: list[tuple[int, int]], count: int, path: tuple[str | int, ...]
    ) -> bool:
        """Replace the columns of the first two elements by those of all, if they repeat."""
        (first_at, first), (second_at, second) = starts
        distance = second_at - first_at
        pairs = list(zip(self.leaves[first:second], self.leaves[second:], strict=True))
        if any(one.offset + distance != other.offset for one, other in pairs):
            return False
        depth = len(path)
        whole = [
            leaf._replace(
                path=leaf.path[:depth] + leaf.path[depth + 1 :],
                repeats=((count, distance), *leaf.repeats),
            )
            for leaf, _ in pairs
        ]
        self.leaves[first:] = whole
        self.at = first_at
        self.take(count * distance, 1, path)
        return True

    def element(self, field: FieldInfo, path: tuple[str | int, ...]) -> Shape:
        """Walk over one value."""
        if field.nested:
            return Shape(self.structure(field.nested, path))
        if field.primitive is not None:
            self.numbers(field, path)
            return Shape(_code(field))
        if field.wide:
            raise ValueError(f"{_text(path)} is a wstring, which no column can hold")
        size = self.size(path)
        start = self.take(size, 1, path)
        if size:
            self.leaves.append(Leaf(path, start, f"S{size}"))
        return Shape(size)

    def numbers(
        self, field: FieldInfo, path: tuple[str | int, ...], count: int | None = None
    ) -> None:
        """Walk over a number, or an array of them."""
        assert field.primitive is not None
        size = field.primitive.size
        start = self.take(size * (1 if count is None else count), size, path)
        repeats = () if count is None else ((count, size),)
        dtype = self.order + _code(field)
        self.leaves.append(Leaf(path, start, dtype, repeats))

    def size(self, path: tuple[str | int, ...]) -> int:
        """Walk over a size, on which all that follows depends."""
        at = self.take(4, 4, path)
        self.sizes.append(slice(at, at + 4))
        found: int = Struct(self.order + "I").unpack_from(self.data, at)[0]
        return found

    def take(self, size: int, align: int, path: tuple[str | int, ...]) -> int:
        """Go over some bytes; return where they are."""
        start = self.at + (4 - self.at) % align
        self.at = start
        self.room(size, path)
        self.at = start + size
        return start

    def room(self, size: int, path: tuple[str | int, ...]) -> None:
        """Raise DecodeError if there are not so many bytes."""
        left = max(0, len(self.data) - self.at)
        if size > left:
            problem = f"{size} bytes expected, {left} bytes left"
            raise DecodeError(problem, _text(path), self.at)


def _code(field: FieldInfo) -> str:
    assert field.primitive is not None
    return {"c": "u1", "?": "?"}.get(field.primitive.code) or np.dtype(
        field.primitive.name
    ).str[1:]


def _text(path: tuple[str | int, ...]) -> str:
    return "".join(f"[{one}]" if isinstance(one, int) else f".{one}" for one in path)[
        1:
    ]
