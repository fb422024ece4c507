"""Tables of Arrow → files, batch by batch, whole or not at all."""

from __future__ import annotations

import json
import os
import re
import secrets
import sys
import warnings
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.model.ir import DUMMY_FIELD
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.load import MissingDefinitionWarning, OtherDefinitionWarning
from idlc.recordings.recording import RecordedTopic, Recording, UnknownTopicError
from idlc.recordings.types import BORROWED, NAMED

if TYPE_CHECKING:
    from collections.abc import Callable

    import pyarrow as pa


def storable(schema: pa.Schema) -> pa.Schema:
    """Return a schema as Parquet can hold it, which has no structs without fields.

    They get the field that ROS 2 adds for C++, for the same reason.
    """
    return _with_types(schema, lambda kind: _converted(kind, _filled_type))


def stored(batch: pa.RecordBatch, schema: pa.Schema) -> pa.RecordBatch:
    """Return a batch with the schema that is storable."""
    import pyarrow as pa

    if batch.schema == schema:
        return batch
    pairs = zip(batch.columns, schema, strict=True)
    columns = [_filled(column, field.type) for column, field in pairs]
    return pa.RecordBatch.from_arrays(columns, schema=schema)


def _with_types(schema: pa.Schema, convert: Any) -> pa.Schema:
    import pyarrow as pa

    fields = [field.with_type(convert(field.type)) for field in schema]
    return pa.schema(fields, schema.metadata)


def _converted(kind: pa.DataType, convert: Callable[[pa.DataType], pa.DataType]) -> pa.DataType:
    """Return a type with each type in it converted, inner ones first, and then itself."""
    import pyarrow as pa
    from pyarrow import types

    if types.is_struct(kind):
        kind = pa.struct([field.with_type(_converted(field.type, convert)) for field in kind])
    elif types.is_large_list(kind):
        kind = pa.large_list(_converted(kind.value_type, convert))
    elif types.is_fixed_size_list(kind):
        kind = pa.list_(_converted(kind.value_type, convert), kind.list_size)
    return convert(kind)


def _filled_type(kind: pa.DataType) -> pa.DataType:
    """Return a struct that has fields."""
    import pyarrow as pa

    empty = pa.types.is_struct(kind) and not kind.num_fields
    return pa.struct([pa.field(DUMMY_FIELD, pa.uint8())]) if empty else kind


def _filled(column: pa.Array, kind: pa.DataType) -> pa.Array:
    """Return a column, of which nothing is null, with the zeros that its new fields hold."""
    import pyarrow as pa
    from pyarrow import types

    if column.type == kind:
        return column
    if types.is_struct(kind):
        pairs = zip(column.flatten(), kind, strict=False)
        columns = [_filled(child, field.type) for child, field in pairs]
        zeros = pa.array(bytes(len(column)), pa.uint8())
        return pa.StructArray.from_arrays(columns or [zeros], fields=list(kind))
    if types.is_fixed_size_list(kind):
        return pa.FixedSizeListArray.from_arrays(
            _filled(column.flatten(), kind.value_type), kind.list_size
        )
    return pa.LargeListArray.from_arrays(column.offsets, _filled(column.values, kind.value_type))


def textual(schema: pa.Schema) -> pa.Schema:
    """Return a schema of numbers, times and texts: lists are JSON, bytes are in base64."""
    return _with_types(schema, _text_type)


def as_text(batch: pa.RecordBatch, schema: pa.Schema) -> pa.RecordBatch:
    """Return a batch with the schema that is textual."""
    import pyarrow as pa

    pairs = zip(batch.columns, schema, strict=True)
    columns = [_as_text(column, field.type) for column, field in pairs]
    return pa.RecordBatch.from_arrays(columns, schema=schema)


def _text_type(kind: pa.DataType) -> pa.DataType:
    """Return the type of a column in a file format without lists."""
    import pyarrow as pa
    from pyarrow import types

    if types.is_duration(kind):
        return pa.int64()
    if types.is_nested(kind) or _is_bytes(kind):
        return pa.string()
    return _text_type(kind.value_type) if types.is_dictionary(kind) else kind


def _is_bytes(kind: pa.DataType) -> bool:
    from pyarrow import types

    return bool(types.is_large_binary(kind) or types.is_fixed_size_binary(kind))


def _as_text(column: pa.Array, kind: pa.DataType) -> pa.Array:
    import pyarrow as pa
    from pyarrow import types

    if column.type == kind:
        return column
    if _is_bytes(column.type):
        return pa.array([_base64(value) for value in column.to_pylist()], kind)
    if types.is_nested(column.type):
        values = _timeless(column).to_pylist()
        return pa.array(
            [json.dumps(value, default=_base64, ensure_ascii=False) for value in values], kind
        )
    return column.cast(kind)


def _timeless(column: pa.Array) -> pa.Array:
    """Return a column with times as texts: those of Python have no nanoseconds."""
    return column.cast(_converted(column.type, _timeless_type))


def _timeless_type(kind: pa.DataType) -> pa.DataType:
    import pyarrow as pa
    from pyarrow import types

    if types.is_timestamp(kind):
        return pa.string()
    if types.is_duration(kind):
        return pa.int64()
    return kind


def _base64(data: bytes) -> str:
    return b64encode(data).decode()


#: Formats by the suffix of a file name.
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

    kept = storable(schema)
    with parquet.ParquetWriter(file, kept) as writer:
        for group in _groups(batches):
            table = pa.Table.from_batches([stored(batch, kept) for batch in group], kept)
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

    # the index of a file is at its end, where a reader of a pipe cannot seek
    with (pa.ipc.new_stream if stream else pa.ipc.new_file)(file, schema) as writer:
        for batch in batches:
            writer.write_batch(batch)


def _csv(batches: Iterator[pa.RecordBatch], schema: pa.Schema, file: Any) -> None:
    from pyarrow import csv

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
    """Return whether a path exists, also as a broken link."""
    return os.path.lexists(path)


#: The placeholder in OUT for the name of a topic.
MARK = "{topic}"
STDOUT = "-"


class UnknownFieldError(Exception):
    """The type of a topic has no such field."""

    def __init__(self, message: str, topic: str) -> None:
        super().__init__(message)
        self.topic = topic


#: Called with a topic, the number of messages done, and of all.
Progress = Callable[[str, int, int], None]


class ColumnsOptions(msgspec.Struct, frozen=True):
    """The arguments of `idlc columns`; several recordings are read as one."""

    recordings: tuple[str, ...]
    topics: tuple[str, ...] = ()
    out: str = STDOUT
    style: str | None = None
    fields: tuple[str, ...] | None = None
    start: str | None = None
    end: str | None = None
    nested: bool = False
    datetimes: bool = True
    check: bool = False
    use_index: bool = True
    force: bool = False
    include: tuple[str, ...] = ()


class WrittenFile(NamedTuple):
    """A file that was written, with the messages of a topic."""

    topic: str
    path: str
    rows: int


class Job(NamedTuple):
    """A topic, and where its columns go in which format."""

    topic: RecordedTopic
    path: str
    style: str


def columns(options: ColumnsOptions, report: Report, progress: Progress) -> list[WrittenFile]:
    """Write the columns of topics, each file whole or not at all; return what was written.

    A topic that cannot be read does not keep others from being written.
    """
    done: list[WrittenFile] = []
    paths, check, include = options.recordings, options.check, options.include
    with (
        _problems(options, report),
        Recording(
            paths[0] if len(paths) == 1 else paths,
            index=options.use_index,
            check=check,
            include=include,
        ) as recording,
    ):
        report.notes += recording.notes
        with _warnings(report):
            for job in _jobs(recording, options, report):
                with _problems(options, report):
                    done.append(_written(job, options, progress))
    return done


@contextmanager
def _problems(options: ColumnsOptions, report: Report) -> Iterator[None]:
    """Report problems of a recording, or of the topics and fields that were selected."""
    try:
        yield
    except UnknownTopicError as error:
        report.add(codes.NO_SUCH_TOPIC.of("", error.message, hint=error.hint))
    except UnknownFieldError as error:
        hint = f"`idlc show {options.recordings[0]} {error.topic}` lists the fields"
        report.add(codes.NO_SUCH_TYPE.of("", str(error), hint=hint))
    except RecordingError as error:
        where = ", ".join(options.recordings)
        report.add(codes.UNREADABLE_RECORDING.of(where, error.message, hint=error.hint))


@contextmanager
def _warnings(report: Report) -> Iterator[None]:
    """Report IDL652 and IDL654 for definitions that are missing, or have another hash."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    missing: dict[str, list[str]] = {}
    for message in (warning.message for warning in caught):
        if isinstance(message, OtherDefinitionWarning):
            report.add(codes.RECORDED_HASH_DIFFERS.of("", str(message)))
        if isinstance(message, MissingDefinitionWarning):
            missing.setdefault(message.message, []).append(f"`{message.topic}`")
    for problem, topics in missing.items():
        text = f"{first_few(topics, NAMED)}: {problem}"
        report.add(codes.MISSING_DEFINITION.of("", text, hint=BORROWED))


def _jobs(recording: Recording, options: ColumnsOptions, report: Report) -> Sequence[Job]:
    """Return a job for each topic; empty if one of them cannot be done."""
    names = tuple(dict.fromkeys(options.topics or recording))
    topics = []
    for name in names:
        # a topic that was not selected by name does not keep others from being written
        with nullcontext() if options.topics else _problems(options, report):
            topics.append(recording[name].between(options.start, options.end))
    jobs = [_job(topic, options, len(names) > 1) for topic in topics]
    problem = _problem(jobs, options)
    if problem:
        message, hint = problem
        report.add(codes.CANNOT_WRITE.of("", message, hint=hint))
        return ()
    paths = [] if options.force else [job.path for job in jobs if job.path != STDOUT]
    taken = [path for path in paths if exists(path)]
    for path in taken:
        report.add(codes.EXISTING_FILE.of(path, f"`{path}` exists", hint="--force replaces it"))
    return () if taken else jobs


def _job(topic: RecordedTopic, options: ColumnsOptions, many: bool) -> Job:
    """Return where a topic goes: to a file in a folder if there are several, or OUT is one."""
    out, name = options.out, _file_name(topic.topic.name)
    suffix = style_of(out)
    if out == STDOUT:
        return Job(topic, out, options.style or "arrow")
    if MARK in out:
        return Job(topic, out.replace(MARK, name), options.style or suffix or "")
    if is_folder(out) or (many and not suffix):
        style = options.style or "parquet"
        return Job(topic, f"{out.rstrip('/')}/{name}.{style}", style)
    return Job(topic, out, options.style or suffix or "")


def _file_name(topic: str) -> str:
    """Return a topic's name as that of a file: `camera.image` of /camera/image."""
    return re.sub(r"[^\w.-]", "_", topic.replace("/", ".").lstrip("."), flags=re.ASCII) or "_"


def _problem(jobs: Sequence[Job], options: ColumnsOptions) -> tuple[str, str] | None:
    """Return why columns cannot be written, and a hint."""
    if any(not job.style for job in jobs):
        suffixes = ", ".join(STYLES)
        return (
            f"`{options.out}` does not say which format is meant",
            f"--format, or one of {suffixes}",
        )
    paths = [job.path for job in jobs]
    twice = next((path for path, count in Counter(paths).items() if count > 1), None)
    if twice is not None:
        what = "standard output" if twice == STDOUT else f"`{twice}`"
        several = [job.topic.topic.name for job in jobs if job.path == twice]
        hint = f"name a folder, or a file for each, such as `-o 'out/{MARK}.parquet'`"
        return f"{', '.join(several)} cannot all go to {what}", hint
    if STDOUT in paths and sys.stdout.isatty():
        return "what a terminal shows is text", "name a file with -o, or use a pipe"
    return None


def _written(job: Job, options: ColumnsOptions, progress: Progress) -> WrittenFile:
    """Write the columns of one topic."""
    name = job.topic.topic.name
    flat = job.style == "csv" or not options.nested
    reading = {"fields": options.fields, "flat": flat, "datetimes": options.datetimes}
    try:
        reader = job.topic.to_reader(**reading)
    except ValueError as error:
        raise UnknownFieldError(str(error), name) from None
    counted = _RowCounter(reader, name, job.topic.topic.count, progress)
    if job.path == STDOUT:
        write(counted.batches(), reader.schema, sys.stdout.buffer, job.style)
    else:
        with whole_file(job.path) as file:
            write(counted.batches(), reader.schema, file, job.style)
    return WrittenFile(name, job.path, counted.rows)


class _RowCounter:
    """Counts rows while they pass, and reports progress."""

    def __init__(self, reader: Any, topic: str, total: int, progress: Progress) -> None:
        self._reader = reader
        self._topic = topic
        self._total = total
        self._progress = progress
        self.rows = 0

    def batches(self) -> Iterator[pa.RecordBatch]:
        """Yield the batches of a reader."""
        for batch in self._reader:
            self.rows += batch.num_rows
            self._progress(self._topic, self.rows, self._total)
            yield batch
