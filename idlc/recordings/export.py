"""Tables of Arrow → files, batch by batch, whole or not at all."""

from __future__ import annotations

import json
import os
import secrets
import sys
from base64 import b64encode
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from idlc.recordings.errors import RecordingError

if TYPE_CHECKING:
    import pyarrow as pa

#: What a name ends with, and the format that it means.
STYLES = {
    ".parquet": "parquet",
    ".pq": "parquet",
    ".arrow": "arrow",
    ".feather": "arrow",
    ".ipc": "arrow",
    ".csv": "csv",
}
#: A group of rows of a Parquet file ends with the batch that makes it so large.
ROWS, BYTES = 1 << 17, 1 << 26


@contextmanager
def whole_file(path: str) -> Iterator[BinaryIO]:
    """Give a file that takes the place of another at the end, if nothing fails until then."""
    target = Path(path)
    draft = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with draft.open("xb") as file:
            yield file
        draft.replace(target)
    except OSError as error:
        reason = error.strerror or error
        raise RecordingError(f"`{target}` cannot be written: {reason}") from None
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def write(batches: Iterator[pa.RecordBatch], schema: pa.Schema, file: Any, style: str) -> None:
    """Write batches to an open file in a format."""
    if style == "parquet":
        _parquet(batches, schema, file)
    elif style == "csv":
        _csv(batches, schema, file)
    else:
        _arrow(batches, schema, file, stream=file is sys.stdout.buffer)


def _parquet(batches: Iterator[pa.RecordBatch], schema: pa.Schema, file: Any) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    with parquet.ParquetWriter(file, schema) as writer:
        for group in _groups(batches):
            writer.write_table(pa.Table.from_batches(group, schema), row_group_size=ROWS * 2)


def _groups(batches: Iterator[pa.RecordBatch]) -> Iterator[list[pa.RecordBatch]]:
    group: list[pa.RecordBatch] = []
    rows = size = 0
    for batch in batches:
        group.append(batch)
        rows, size = rows + batch.num_rows, size + batch.nbytes
        if rows >= ROWS or size >= BYTES:
            yield group
            group, rows, size = [], 0, 0
    if group:
        yield group


def _arrow(
    batches: Iterator[pa.RecordBatch], schema: pa.Schema, file: Any, *, stream: bool
) -> None:
    import pyarrow as pa

    # a file has its index at the end, which nobody can ask a pipe for
    with (pa.ipc.new_stream if stream else pa.ipc.new_file)(file, schema) as writer:
        for batch in batches:
            writer.write_batch(batch)


def _csv(batches: Iterator[pa.RecordBatch], schema: pa.Schema, file: Any) -> None:
    import pyarrow as pa
    from pyarrow import csv

    plain = pa.schema([field.with_type(_plain(field.type)) for field in schema])
    with csv.CSVWriter(file, plain) as writer:
        for batch in batches:
            pairs = zip(batch.columns, plain, strict=True)
            columns = [_as_text(column, field.type) for column, field in pairs]
            writer.write_batch(pa.RecordBatch.from_arrays(columns, schema=plain))


def _plain(kind: pa.DataType) -> pa.DataType:
    """Return the type that a column has in a CSV file, which knows no lists."""
    from pyarrow import types

    if types.is_duration(kind):
        return _of("int64")
    if types.is_nested(kind) or types.is_large_binary(kind) or types.is_binary(kind):
        return _of("string")
    return _plain(kind.value_type) if types.is_dictionary(kind) else kind


def _of(name: str) -> pa.DataType:
    import pyarrow as pa

    return pa.type_for_alias(name)


def _as_text(column: pa.Array, kind: pa.DataType) -> pa.Array:
    """Return a column of another type: lists are JSON, bytes are in base64."""
    import pyarrow as pa

    if column.type == kind:
        return column
    if kind != _of("string"):
        return column.cast(kind)
    return pa.array([json.dumps(_value(one), default=_base64) for one in column.to_pylist()], kind)


def _value(one: Any) -> Any:
    return _base64(one) if isinstance(one, bytes) else one


def _base64(one: Any) -> str:
    return b64encode(one).decode() if isinstance(one, bytes) else str(one)


def style_of(path: str) -> str | None:
    """Return the format that a name means."""
    return STYLES.get(Path(path).suffix.lower())


def is_folder(path: str) -> bool:
    """Return whether a path means a folder, which may have to be made."""
    return path.endswith("/") or Path(path).is_dir()


def exists(path: str) -> bool:
    """Return whether there is something at a path already."""
    return os.path.lexists(path)
