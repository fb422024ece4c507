"""Columns as a table of Arrow, built of the buffers of numpy's arrays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from idlc.recordings.columns.plan import Instant, Lists, Node, Numbers, Struct, Text, flat_nodes
from idlc.recordings.columns.read import table_of, type_of
from idlc.recordings.columns.values import Columns
from idlc.runtime.typeinfo import FieldInfo, Structure

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
    node, columns = top.level.node, table.columns(top)
    if flat:
        node, columns = Struct(flat_nodes(node)), Columns(columns.flat(), len(columns))
    batch = pyarrow.RecordBatch.from_struct_array(_array(pyarrow, node, columns, dictionary))
    structure = type_of(kind)
    metadata = {
        "ros2.type": structure.name,
        "ros2.hash": structure.hash,
        "ros2.definition": definition_of(structure),
    }
    return pyarrow.Table.from_batches([batch.replace_schema_metadata(metadata)])


def _array(pa: Any, node: Node, column: Any, dictionary: bool) -> Any:
    """Return the array of a column. `pa.array` would import pandas."""

    def of_buffers(type_: Any, *buffers: Any, children: Any = None) -> Any:
        every = [None, *map(pa.py_buffer, buffers)]
        return pa.Array.from_buffers(type_, len(column), every, children=children)

    if isinstance(node, Struct):
        arrays = [
            _array(pa, inner, column[name], dictionary) for name, inner in node.fields.items()
        ]
        pairs = zip(node.fields, arrays, strict=True)
        type_ = pa.struct([pa.field(name, array.type) for name, array in pairs])
        return of_buffers(type_, children=arrays)
    if isinstance(node, Lists):
        is_bytes = isinstance(node.element, Numbers) and column.values.dtype == np.uint8
        if node.size is None and is_bytes:
            return of_buffers(pa.large_binary(), column.offsets, column.values)
        inner = _array(pa, node.element, column.values, dictionary)
        if node.size is not None:
            return of_buffers(pa.list_(inner.type, node.size), children=[inner])
        return of_buffers(pa.large_list(inner.type), column.offsets, children=[inner])
    if isinstance(node, Text):
        texts = of_buffers(pa.large_string(), column.offsets, column.values)
        return texts.dictionary_encode() if dictionary else texts
    if isinstance(node, Instant):
        return of_buffers(getattr(pa, TIMES[node.code])("ns"), column.view(np.int64))
    if node.size is not None and column.dtype == np.uint8:
        return of_buffers(pa.binary(node.size), column)
    if node.size is not None:
        inner = _array(pa, node._replace(size=None), column.reshape(-1), dictionary)
        return pa.FixedSizeListArray.from_arrays(inner, node.size)
    if column.dtype == np.bool_:
        return of_buffers(pa.bool_(), np.packbits(column, bitorder="little"))
    return of_buffers(pa.from_numpy_dtype(column.dtype), column)


def definition_of(structure: Structure) -> str:
    """Return a type's definition and those it refers to, as recordings have them.

    MCAP calls this form ros2msg.
    """
    needed = [structure]
    for type_ in needed:
        nested = (field.nested for field in type_.fields if field.nested)
        needed += [other for other in dict.fromkeys(nested) if other not in needed]
    others = (
        f"{'=' * 80}\nMSG: {_short_name(other.name)}\n{_message_text(other)}"
        for other in needed[1:]
    )
    return "".join([_message_text(structure), *others])


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
