"""Messages as a table of Arrow, which says what type they are of."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from idlc.recordings.columns.read import to_columns, type_of
from idlc.recordings.columns.values import needing, record_batch
from idlc.recordings.containers.compression import missing
from idlc.runtime.typeinfo import FieldInfo, Structure


def arrow() -> Any:
    """Return pyarrow, or say how to install it."""
    try:
        import pyarrow
    except ImportError:
        raise missing("pyarrow", "tables are made by Arrow") from None
    return pyarrow


def to_arrow(
    kind: type | Structure,
    messages: Any,
    fields: Iterable[str] | None = None,
    flat: bool = False,
    datetimes: bool = False,
    dictionary: bool = False,
    on_unread: Callable[[Any], object] | None = None,
) -> Any:
    """Return a `pyarrow.Table` with a row for each message."""
    with needing("pyarrow", "to_arrow"):
        import pyarrow  # type: ignore[import-untyped,unused-ignore]
    columns = to_columns(kind, messages, fields, datetimes, on_unread)
    batch = record_batch(columns.flattened() if flat else columns, dictionary)
    structure = type_of(kind)
    metadata = {
        "ros2.type": structure.name,
        "ros2.hash": structure.hash,
        "ros2.definition": definition_of(structure),
    }
    return pyarrow.Table.from_batches([batch.replace_schema_metadata(metadata)])


def to_rows(
    kind: type | Structure,
    messages: Any,
    each: str,
    fields: Iterable[str] | None = None,
    flat: bool = False,
    **options: Any,
) -> tuple[Any, Any]:
    """Return a table with a row for each element of a list of messages, and the message of each.

    The `fields` are those of an element.
    """
    pa = arrow()
    from pyarrow import compute

    fields = (fields,) if isinstance(fields, str) else fields
    paths = (each,) if fields is None else tuple(f"{each}.{field}" for field in fields)
    table = to_arrow(kind, messages, paths, flat=True, **options)
    inner = table.schema.field(each).type if each in table.column_names else pa.null()
    is_list = pa.types.is_large_list(inner) or pa.types.is_fixed_size_list(inner)
    if not (is_list and pa.types.is_struct(inner.value_type)):
        raise ValueError(f"`{each}` of {type_of(kind).name} is not a list of messages")
    column = table[each].combine_chunks()
    batch = pa.RecordBatch.from_struct_array(column.flatten())
    rows = pa.Table.from_batches([batch]).replace_schema_metadata(table.schema.metadata)
    while flat and any(map(pa.types.is_struct, rows.schema.types)):
        rows = rows.flatten()
    return rows, compute.list_parent_indices(column)


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
