"""Tables of Arrow → files, batch by batch, whole or not at all."""

from __future__ import annotations

import os
import secrets
import sys
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

    from idlc.recordings.plain import storable, stored

    kept = storable(schema)
    with parquet.ParquetWriter(file, kept) as writer:
        for group in _groups(batches):
            table = pa.Table.from_batches([stored(one, kept) for one in group], kept)
            writer.write_table(table, row_group_size=ROWS * 2)


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
    from pyarrow import csv

    from idlc.recordings.plain import as_text, textual

    plain = textual(schema)
    with csv.CSVWriter(file, plain) as writer:
        for batch in batches:
            writer.write_batch(as_text(batch, plain))


def style_of(path: str) -> str | None:
    """Return the format that a name means."""
    return STYLES.get(Path(path).suffix.lower())


def is_folder(path: str) -> bool:
    """Return whether a path means a folder, which may have to be made."""
    return path.endswith("/") or Path(path).is_dir()


def exists(path: str) -> bool:
    """Return whether there is something at a path already."""
    return os.path.lexists(path)
