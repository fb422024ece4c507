"""Columns as a table of Arrow, built of the buffers of numpy's arrays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from idlc.recordings.columns.plan import Instant, Lists, Node, Numbers, Strings, Struct
from idlc.recordings.columns.read import table_of, type_of
from idlc.recordings.columns.table import columns_of
from idlc.runtime.typeinfo import FieldInfo, Structure

#: Between a definition and those that it refers to.
SEPARATOR = "=" * 80
#: The unit of times in Arrow, by their dtype.
TIMES = {"M8[ns]": "timestamp", "m8[ns]": "duration"}


def to_arrow(
    kind: type | Structure,
    messages: Any,
    fields: Iterable[str] | None = None,
    flat: bool = False,
    datetimes: bool = False,
    dictionary: bool = False,
) -> Any:
    """Return a `pyarrow.Table` with a row for each message."""
    try:
        import pyarrow  # type: ignore[import-untyped,unused-ignore]
    except ImportError as error:
        raise ImportError(
            f"to_arrow needs pyarrow, which cannot be imported ({error}): pip install pyarrow",
            name="pyarrow",
        ) from error
    table, top = table_of(kind, messages, fields, datetimes)
    columns = columns_of(table, top)
    rows = _Arrays(pyarrow, dictionary).struct(top.level.node, columns)
    while flat and any(pyarrow.types.is_struct(field.type) for field in rows.type):
        rows = _flattened(pyarrow, rows)
    batch = pyarrow.RecordBatch.from_struct_array(rows)
    metadata = described(type_of(kind))
    return pyarrow.Table.from_batches([batch.replace_schema_metadata(metadata)])


def described(structure: Structure) -> dict[str, str]:
    """Return what the metadata of a schema says of the type."""
    return {
        "ros2.type": structure.name,
        "ros2.hash": structure.hash,
        "ros2.definition": definition_of(structure),
    }


def _flattened(pa: Any, struct: Any) -> Any:
    arrays, names = [], []
    for index, field in enumerate(struct.type):
        array = struct.field(index)
        if pa.types.is_struct(field.type):
            arrays += [array.field(at) for at in range(field.type.num_fields)]
            names += [f"{field.name}.{inner.name}" for inner in field.type]
        else:
            arrays.append(array)
            names.append(field.name)
    return _struct(pa, names, arrays, len(struct))


def _struct(pa: Any, names: list[str], arrays: list[Any], count: int) -> Any:
    fields = [pa.field(name, array.type) for name, array in zip(names, arrays, strict=True)]
    return pa.Array.from_buffers(pa.struct(fields), count, [None], children=arrays)


class _Arrays:
    """Makes arrays of Arrow. `pa.array` would import pandas."""

    def __init__(self, pa: Any, dictionary: bool) -> None:
        self.pa = pa
        self.dictionary = dictionary

    def array(self, node: Node, column: Any) -> Any:
        """Return the array of a column."""
        pa = self.pa
        if isinstance(node, Struct):
            return self.struct(node, column)
        if isinstance(node, Lists):
            return self.lists(node, column)
        if isinstance(node, Strings):
            buffers = [None, *map(pa.py_buffer, (column.offsets, column.values))]
            texts = pa.Array.from_buffers(pa.large_string(), len(column), buffers)
            return texts.dictionary_encode() if self.dictionary else texts
        if isinstance(node, Instant):
            type_ = getattr(pa, TIMES[node.code])("ns")
            return self.flat(type_, column.view(np.int64))
        if node.size is None:
            return self.numbers(column)
        if column.dtype == np.uint8:
            return self.flat(pa.binary(node.size), column, len(column))
        inner = self.numbers(column.reshape(-1))
        return pa.FixedSizeListArray.from_arrays(inner, node.size)

    def numbers(self, column: Any) -> Any:
        """Return the array of plain numbers."""
        pa = self.pa
        if column.dtype == np.bool_:
            bits = np.packbits(column, bitorder="little")
            return self.flat(pa.bool_(), bits, len(column))
        return self.flat(pa.from_numpy_dtype(column.dtype), column)

    def flat(self, type_: Any, values: Any, count: int | None = None) -> Any:
        """Return the array of one buffer."""
        buffers = [None, self.pa.py_buffer(values)]
        count = len(values) if count is None else count
        return self.pa.Array.from_buffers(type_, count, buffers)

    def struct(self, node: Node, column: Any) -> Any:
        """Return the array of Columns."""
        assert isinstance(node, Struct)
        arrays = [self.array(inner, column[name]) for name, inner in node.fields.items()]
        return _struct(self.pa, list(node.fields), arrays, len(column))

    def lists(self, node: Lists, column: Any) -> Any:
        """Return the array of sequences, or of arrays of what are no numbers."""
        pa = self.pa
        if node.size is not None:
            inner = self.array(node.element, column.values)
            type_ = pa.list_(inner.type, node.size)
            return pa.Array.from_buffers(type_, len(column), [None], children=[inner])
        offsets = pa.py_buffer(column.offsets)
        if isinstance(node.element, Numbers) and column.values.dtype == np.uint8:
            buffers = [None, offsets, pa.py_buffer(column.values)]
            return pa.Array.from_buffers(pa.large_binary(), len(column), buffers)
        inner = self.array(node.element, column.values)
        type_ = pa.large_list(inner.type)
        buffers = [None, offsets]
        return pa.Array.from_buffers(type_, len(column), buffers, children=[inner])


def definition_of(structure: Structure) -> str:
    """Return a type's definition and those it refers to, as recordings have them.

    MCAP calls this form ros2msg.
    """
    needed = [structure]
    for type_ in needed:
        nested = (field.nested for field in type_.fields if field.nested)
        needed += [other for other in dict.fromkeys(nested) if other not in needed]
    parts = [_message_text(structure)]
    parts += [
        f"{SEPARATOR}\nMSG: {_short_name(other.name)}\n{_message_text(other)}"
        for other in needed[1:]
    ]
    return "".join(parts)


def _message_text(structure: Structure) -> str:
    """Return a message file, or what its fields would be in one."""
    source = structure.types.sources.get(structure.name)
    if source is None or "/msg/" not in structure.name:
        source = "".join(f"{_field_type(field)} {field.name}\n" for field in structure.fields)
    return source if source.endswith("\n") else f"{source}\n"


def _field_type(field: FieldInfo) -> str:
    if field.nested:
        element = _short_name(field.nested.name)
    elif field.primitive:
        element = field.primitive.name
    else:
        bound = "" if field.text_bound is None else f"<={field.text_bound}"
        element = f"{'wstring' if field.wide else 'string'}{bound}"
    if field.size is not None:
        return f"{element}[{field.size}]"
    if field.bound is not None:
        return f"{element}[<={field.bound}]"
    return f"{element}[]" if field.is_sequence else element


def _short_name(name: str) -> str:
    package, _, short = name.split("/")
    return f"{package}/{short}"
