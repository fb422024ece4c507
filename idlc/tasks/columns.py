"""Tables of Arrow → files, batch by batch, whole or not at all."""

from __future__ import annotations

import json
import os
import re
import secrets
import shlex
import sys
import warnings
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import msgspec
import numpy as np

from idlc.api.conditions import Condition
from idlc.api.recording import RecordedTopic, Recording, UnknownTopicError
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.terminal import Progress
from idlc.model.ir import DUMMY_FIELD
from idlc.project.files import missing
from idlc.project.words import is_address
from idlc.recordings.columns.elements import MissingElementWarning
from idlc.recordings.containers.source import RecordingError, is_local
from idlc.recordings.load import MissingDefinitionWarning, OtherDefinitionWarning
from idlc.recordings.types import NAMED, borrowed, damage_problems
from idlc.tasks.preview import Preview

if TYPE_CHECKING:
    import pyarrow as pa


def converted(batch: pa.RecordBatch, convert: Callable[[pa.Array], pa.Array]) -> pa.RecordBatch:
    """Return a batch with each column converted; what is null stays null."""
    import pyarrow as pa

    columns = [_apart_from_nulls(column, convert) for column in batch.columns]
    pairs = zip(batch.schema, columns, strict=True)
    schema = pa.schema([field.with_type(column.type) for field, column in pairs])
    return pa.RecordBatch.from_arrays(columns, schema=schema.with_metadata(batch.schema.metadata))


def _apart_from_nulls(column: pa.Array, convert: Callable[[pa.Array], pa.Array]) -> pa.Array:
    import pyarrow as pa

    if not column.null_count:
        return convert(column)
    mask = column.is_null().to_numpy(zero_copy_only=False)
    places = np.maximum(np.cumsum(~mask) - 1, 0)
    return convert(column.drop_null()).take(pa.array(places, mask=mask))


def filled(column: pa.Array) -> pa.Array:
    """Return a column, of which nothing is null, as Parquet can hold it: no struct without fields.

    They get the field that ROS 2 adds for C++, for the same reason.
    """
    import pyarrow as pa

    kind = column.type
    if pa.types.is_struct(kind):
        names = [field.name for field in kind] or [DUMMY_FIELD]
        zeros = pa.array(bytes(len(column)), pa.uint8())
        return pa.StructArray.from_arrays(list(map(filled, column.flatten())) or [zeros], names)
    if pa.types.is_fixed_size_list(kind):
        return pa.FixedSizeListArray.from_arrays(filled(column.flatten()), kind.list_size)
    if pa.types.is_large_list(kind):
        return pa.LargeListArray.from_arrays(column.offsets, filled(column.values))
    return column


def plain(column: pa.Array) -> pa.Array:
    """Return a column of numbers, times or texts: lists are JSON, bytes are in base64."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_duration(kind):
        return column.cast(pa.int64())
    if pa.types.is_large_binary(kind) or pa.types.is_fixed_size_binary(kind):
        return pa.array(map(_base64, column.to_pylist()), pa.string())
    if pa.types.is_nested(kind):
        values = column.cast(_timeless(kind)).to_pylist()
        return pa.array(map(_json, values), pa.string())
    return column


def _json(value: Any) -> str:
    """Return a value as JSON, which has no numbers beyond the finite ones: they are null."""
    dumps = partial(json.dumps, default=_base64, ensure_ascii=False, allow_nan=False)
    try:
        return dumps(value)
    except ValueError:
        return dumps(_finite(value))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(own) for name, own in value.items()}
    if isinstance(value, list):
        return list(map(_finite, value))
    return None if isinstance(value, float) and not isfinite(value) else value


def _timeless(kind: pa.DataType) -> pa.DataType:
    """Return a type with times as texts: those of Python have no nanoseconds."""
    import pyarrow as pa

    if pa.types.is_struct(kind):
        return pa.struct([field.with_type(_timeless(field.type)) for field in kind])
    if pa.types.is_large_list(kind):
        return pa.large_list(_timeless(kind.value_type))
    if pa.types.is_fixed_size_list(kind):
        return pa.list_(_timeless(kind.value_type), kind.list_size)
    if pa.types.is_timestamp(kind):
        return pa.string()
    return pa.int64() if pa.types.is_duration(kind) else kind


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
    import pyarrow as pa

    # its conversion has the schema of all that is converted
    nulls = [pa.nulls(0, type_) for type_ in schema.types]
    nothing = pa.RecordBatch.from_arrays(nulls, schema=schema)
    if style == "parquet":
        from pyarrow import parquet

        kept = converted(nothing, filled).schema
        if kept != schema:
            batches = (converted(batch, filled) for batch in batches)
        with parquet.ParquetWriter(file, kept) as writer:
            for group in _groups(batches):
                writer.write_table(pa.Table.from_batches(group, kept), row_group_size=ROWS * 2)
                group.clear()  # it would stay in memory beside the next one
        return
    if style == "csv":
        from pyarrow import csv

        batches = (converted(batch, plain) for batch in batches)
        opened = csv.CSVWriter(file, converted(nothing, plain).schema)
    elif file is sys.stdout.buffer:
        # the index of a file is at its end, where a reader of a pipe cannot seek
        opened = pa.ipc.new_stream(file, schema)
    else:
        opened = pa.ipc.new_file(file, schema)
    with opened as writer:
        for batch in batches:
            writer.write_batch(batch)


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


#: The placeholder in OUT for the name of a topic.
MARK = "{topic}"
STDOUT = "-"
#: The style of a preview, which no file has.
TEXT = "text"


#: Writes files from an open recording.
Work = Callable[["Recording", "ColumnsOptions", Report, Progress], Iterable["WrittenFile"]]


class ColumnsOptions(msgspec.Struct, frozen=True):
    """The arguments of `idlc columns`; several recordings are read as one."""

    recordings: tuple[str, ...]
    topics: tuple[str, ...] = ()
    out: str = STDOUT
    style: str | None = None
    fields: tuple[str, ...] | None = None
    start: str | None = None
    end: str | None = None
    conditions: tuple[Condition, ...] = ()
    each: str | None = None
    nested: bool = False
    datetimes: bool = True
    check: bool | None = None
    strict: bool = False
    force: bool = False
    include: tuple[str, ...] = ()
    distro: str | None = None
    type_name: str | None = None


class WrittenFile(NamedTuple):
    """A file that was written, with the messages of a topic, or a preview in its place."""

    topic: str
    path: str
    rows: int
    preview: Preview | None = None


class Job(NamedTuple):
    """A topic, and where its columns go in which format."""

    topic: RecordedTopic
    path: str
    style: str


def columns(
    options: ColumnsOptions, report: Report, progress: Progress, work: Work | None = None
) -> list[WrittenFile]:
    """Write the columns of topics, each file whole or not at all; return what was written.

    By default, the work is a file for each topic.
    """
    done: list[WrittenFile] = []
    undefined: dict[str, list[str]] = {}
    paths = options.recordings
    for path in paths:
        if is_local(path) and not os.path.lexists(path) and not is_address(path):
            report.add(missing(path, Path(path)))
    if report.errors:
        return done
    with (
        problems(options, report),
        # also for damage that opening it warns of
        warnings.catch_warnings(record=True) as caught,
        Recording(
            paths[0] if len(paths) == 1 else paths,
            index=options.check is not False,
            check=options.check,
            strict=options.strict,
            include=options.include,
            distro=options.distro,
        ) as recording,
    ):
        warnings.simplefilter("always")
        done += (work or _each_topic)(recording, options, report, progress)
        for message in (warning.message for warning in caught):
            if isinstance(message, OtherDefinitionWarning):
                report.add(codes.RECORDED_HASH_DIFFERS.of("", str(message)))
            if isinstance(message, MissingElementWarning):
                report.notes += (str(message),)
            if isinstance(message, MissingDefinitionWarning):
                undefined.setdefault(message.message, []).append(f"`{message.topic}`")
        for problem, topics in undefined.items():
            text = f"{first_few(topics, NAMED)}: {problem}"
            report.add(codes.MISSING_DEFINITION.of("", text, hint=borrowed()))
        report.notes += recording.notes
        report.extend(damage_problems(", ".join(paths), recording.damage))
    return done


def _each_topic(
    recording: Recording, options: ColumnsOptions, report: Report, progress: Progress
) -> Iterator[WrittenFile]:
    """Write each topic; one that cannot be read does not keep others from being written."""
    for job in _jobs(recording, options, report):
        with problems(options, report):
            yield from _written(job, options, report, progress)


@contextmanager
def problems(options: ColumnsOptions, report: Report) -> Iterator[None]:
    """Report problems of a recording, or of the topics that were selected."""
    try:
        yield
    except UnknownTopicError as error:
        report.add(codes.NO_SUCH_TOPIC.of("", error.message, hint=error.hint))
    except RecordingError as error:
        where = ", ".join(options.recordings)
        report.add(codes.UNREADABLE_RECORDING.of(where, error.message, hint=error.hint))


def _jobs(recording: Recording, options: ColumnsOptions, report: Report) -> Sequence[Job]:
    """Return a job for each topic; empty if one of them cannot be done."""
    names = tuple(dict.fromkeys(options.topics or recording))
    topics = []
    for name in names:
        # a topic that was not selected by name does not keep others from being written
        with nullcontext() if options.topics else problems(options, report):
            topic = recording.topic(name, options.type_name)
            topics.append(topic.between(options.start, options.end))
    files = _file_names([topic.topic.name for topic in topics])
    jobs = [
        _job(topic, file, options, len(names) > 1)
        for topic, file in zip(topics, files, strict=True)
    ]
    return checked(jobs, options, report)


def _file_names(topics: Iterable[str]) -> list[str]:
    """Return a name for the file of each topic: `camera.image` for /camera/image.

    Names of which a file system may make one end with a number.
    """
    names: dict[str, str] = {}
    for topic in topics:
        base = re.sub(r"[^\w.-]", "_", topic.replace("/", ".").lstrip("."), flags=re.ASCII)
        name, number = base or "_", 1
        while name.casefold() in names:
            number += 1
            name = f"{base}-{number}"
        names[name.casefold()] = name
    return list(names.values())


def checked(jobs: Sequence[Job], options: ColumnsOptions, report: Report) -> Sequence[Job]:
    """Return jobs that can be done together, or report why they cannot, and return none."""
    if problem := _problem(jobs, options):
        message, hint = problem
        report.add(codes.CANNOT_WRITE.of("", message, hint=hint))
        return ()
    paths = [] if options.force else [job.path for job in jobs if job.path != STDOUT]
    taken = [path for path in paths if os.path.lexists(path)]
    for path in taken:
        report.add(
            codes.EXISTING_FILE.of(path, f"`{path}` exists", hint="add --force to replace it")
        )
    return () if taken else jobs


def stdout_style(options: ColumnsOptions) -> str:
    """Return the format of what goes to standard output."""
    return options.style or (TEXT if sys.stdout.isatty() else "arrow")


def opened(path: str) -> AbstractContextManager[BinaryIO]:
    """Give the file of a path, or standard output."""
    return nullcontext(sys.stdout.buffer) if path == STDOUT else whole_file(path)


def _job(topic: RecordedTopic, name: str, options: ColumnsOptions, many: bool) -> Job:
    """Return where a topic goes; in a folder, to the file of that name."""
    out = options.out
    suffix = STYLES.get(Path(out).suffix.lower())
    if out == STDOUT:
        return Job(topic, out, stdout_style(options))
    if MARK in out:
        return Job(topic, out.replace(MARK, name), options.style or suffix or "")
    if out.endswith("/") or Path(out).is_dir() or (many and not suffix):
        style = options.style or "parquet"
        return Job(topic, f"{out.rstrip('/')}/{name}.{style}", style)
    return Job(topic, out, options.style or suffix or "")


def _problem(jobs: Sequence[Job], options: ColumnsOptions) -> tuple[str, str] | None:
    """Return why columns cannot be written, and a hint."""
    if not all(job.style for job in jobs):
        hint = f"add --format, or one of the extensions {', '.join(STYLES)}"
        return f"`{options.out}` has no extension of a known format", hint
    if any(job.style == TEXT and job.path != STDOUT for job in jobs):
        return "`--format text` writes no file", "omit `-o`, or choose another format"
    paths = [job.path for job in jobs if job.style != TEXT]
    twice = next((path for path, count in Counter(paths).items() if count > 1), None)
    if twice is not None:
        what = "standard output" if twice == STDOUT else f"`{twice}`"
        several = [job.topic.topic.name for job in jobs if job.path == twice]
        hint = f"give a folder, or a pattern such as `-o 'out/{MARK}.parquet'`"
        return f"{', '.join(several)} cannot all go to {what}", hint
    if STDOUT in paths and sys.stdout.isatty():
        return (
            "a terminal shows only text",
            "omit --format, give a file with -o, or use a pipe",
        )
    return None


def _written(
    job: Job, options: ColumnsOptions, report: Report, progress: Progress
) -> Iterator[WrittenFile]:
    """Write the columns of one topic, unless it has no such fields."""
    name, rows = job.topic.topic.name, 0
    flat = job.style in ("csv", TEXT) or not options.nested
    topic = job.topic
    try:
        for condition in options.conditions:
            topic = topic.where(*condition)
        reader = topic.to_reader(
            fields=options.fields, flat=flat, datetimes=options.datetimes, each=options.each
        )
    except ValueError as error:
        words = shlex.join(("idlc", "show", options.recordings[0], name))
        hint = f"`{words}` lists the fields"
        report.add(codes.NO_SUCH_TYPE.of("", str(error), hint=hint))
        return

    def counted() -> Iterator[pa.RecordBatch]:
        nonlocal rows
        for batch in reader:
            rows += batch.num_rows
            progress(name, rows, job.topic.topic.count)
            yield batch
        if topic.absent:
            report.notes += (f"{name}: {topic.absent:,} messages do not have a field of --where",)

    if job.style == TEXT:
        title = f"{name}  {job.topic.topic.type}"
        preview = Preview(title, reader.schema.names, "row" if options.each else "message")
        for batch in counted():
            preview.add(batch, plain)
        yield WrittenFile(name, job.path, rows, preview)
        return
    with opened(job.path) as file:
        write(counted(), reader.schema, file, job.style)
    yield WrittenFile(name, job.path, rows)
