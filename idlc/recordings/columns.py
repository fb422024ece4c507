"""The pipeline of `idlc columns`: the topics of a recording → files of tables."""

from __future__ import annotations

import re
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.recordings import export
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.load import MissingDefinitionWarning, OtherDefinitionWarning
from idlc.recordings.recording import RecordedTopic, Recording, UnknownTopicError
from idlc.recordings.types import BORROWED, NAMED

if TYPE_CHECKING:
    import pyarrow as pa

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


class ColumnsOptions(NamedTuple):
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


class Written(NamedTuple):
    """A file that was written, with the messages of a topic."""

    topic: str
    path: str
    rows: int


class Job(NamedTuple):
    """A topic, and where its columns go in which format."""

    topic: RecordedTopic
    path: str
    style: str


def columns(options: ColumnsOptions, report: Report, progress: Progress) -> list[Written]:
    """Write the columns of topics, each file whole or not at all; return what was written.

    A topic that cannot be read does not keep others from being written.
    """
    done: list[Written] = []
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
    taken = [path for path in paths if export.exists(path)]
    for path in taken:
        report.add(codes.EXISTING_FILE.of(path, f"`{path}` exists", hint="--force replaces it"))
    return () if taken else jobs


def _job(topic: RecordedTopic, options: ColumnsOptions, many: bool) -> Job:
    """Return where a topic goes: to a file in a folder if there are several, or OUT is one."""
    out, name = options.out, _file_name(topic.topic.name)
    suffix = export.style_of(out)
    if out == STDOUT:
        return Job(topic, out, options.style or "arrow")
    if MARK in out:
        return Job(topic, out.replace(MARK, name), options.style or suffix or "")
    if export.is_folder(out) or (many and not suffix):
        style = options.style or "parquet"
        return Job(topic, f"{out.rstrip('/')}/{name}.{style}", style)
    return Job(topic, out, options.style or suffix or "")


def _file_name(topic: str) -> str:
    """Return a topic's name as that of a file: `camera.image` of /camera/image."""
    return re.sub(r"[^\w.-]", "_", topic.replace("/", ".").lstrip("."), flags=re.ASCII) or "_"


def _problem(jobs: Sequence[Job], options: ColumnsOptions) -> tuple[str, str] | None:
    """Return why columns cannot be written, and a hint."""
    if any(not job.style for job in jobs):
        suffixes = ", ".join(export.STYLES)
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


def _written(job: Job, options: ColumnsOptions, progress: Progress) -> Written:
    """Write the columns of one topic."""
    name = job.topic.topic.name
    flat = job.style == "csv" or not options.nested
    reading = {"fields": options.fields, "flat": flat, "datetimes": options.datetimes}
    try:
        reader = job.topic.to_reader(**reading)
    except ValueError as error:
        raise UnknownFieldError(str(error), name) from None
    counted = _Counted(reader, name, job.topic.topic.count, progress)
    if job.path == STDOUT:
        export.write(counted.batches(), reader.schema, sys.stdout.buffer, job.style)
    else:
        with export.whole_file(job.path) as file:
            export.write(counted.batches(), reader.schema, file, job.style)
    return Written(name, job.path, counted.rows)


class _Counted:
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
