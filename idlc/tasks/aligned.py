"""`idlc columns --grid`: several topics of a recording as one table, in one file."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from idlc.api.recording import Recording
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.terminal import Progress
from idlc.recordings.aligned.table import Aligned, ClockFit
from idlc.recordings.containers.source import RecordingError
from idlc.tasks import columns


class Grid(msgspec.Struct, frozen=True):
    """The clock of a table: a topic or a period, and how values are found.

    Options are for all topics, or for one: `/imu=linear`.
    """

    clock_of_rows: str
    how: tuple[str, ...] = ()
    tolerance: tuple[str, ...] = ()
    clock: tuple[str, ...] = ()


def write_aligned(
    grid: Grid,
    announce: Callable[[list[ClockFit]], None],
    recording: Recording,
    options: columns.ColumnsOptions,
    report: Report,
    progress: Progress,
) -> Iterator[columns.WrittenFile]:
    """Announce how well the topics fit the clock, and write their table."""
    topics = dict(topic_of(word, recording) for word in options.topics or recording)
    rows = grid.clock_of_rows
    try:
        table = table_of(grid, topics, recording, options)
    except ValueError as error:
        field_problem(error, options, report)
        return
    style = _style(options)
    job = columns.Job(recording[next(iter(topics), rows)], options.out, style)
    if style != columns.TEXT and not columns.checked([job], options, report):
        return
    announce(table.summary())
    if style == columns.TEXT:
        return
    done = 0

    def counted() -> Iterator[Any]:
        nonlocal done
        for batch in table.to_reader():
            done += batch.num_rows
            progress(rows, done, len(table))
            yield batch

    with columns.opened(job.path) as file:
        columns.write(counted(), table.schema, file, style)
    yield columns.WrittenFile(", ".join(topics), job.path, len(table))


def field_problem(error: ValueError, options: columns.ColumnsOptions, report: Report) -> None:
    """Report a field that a topic does not have; raise other errors."""
    if isinstance(error, RecordingError):
        raise error
    topics = dict.fromkeys(word.partition(":")[0] for word in options.topics)
    words = shlex.join(("idlc", "show", options.recordings[0], *topics))
    hint = f"`{words}` lists the fields"
    report.add(codes.NO_SUCH_TYPE.of("", str(error), hint=hint))


def table_of(
    grid: Grid, topics: Mapping[str, Any], recording: Recording, options: columns.ColumnsOptions
) -> Aligned:
    """Return the table of topics, each with its fields."""
    rows = grid.clock_of_rows
    is_topic = rows in recording or rows.startswith("/")
    names = [*topics, rows] if is_topic else [*topics]
    return recording.aligned(
        topics,
        on=rows if is_topic else None,
        every=None if is_topic else rows,
        how=_by_topic(grid.how, names, "last"),
        tolerance=_by_topic(grid.tolerance, names, None),
        clock=_by_topic(grid.clock, names, "log"),
        start=options.start,
        end=options.end,
    )


def _style(options: columns.ColumnsOptions) -> str:
    """Return the format of the file; a terminal sees only the summary."""
    if options.out == columns.STDOUT:
        return columns.stdout_style(options)
    return options.style or columns.STYLES.get(Path(options.out).suffix.lower(), "")


def topic_of(word: str, recording: Recording) -> tuple[str, list[str] | None]:
    """Return a topic and its fields, as `/joints:position,velocity` has them."""
    name, colon, fields = word.partition(":")
    if word in recording or not colon:
        return word, None
    return name, [field.strip() for field in fields.split(",")]


def _by_topic(values: Sequence[str], names: Sequence[str], default: Any) -> dict[str, Any]:
    """Return the value of each topic; the last one without a topic is for all others."""
    pairs = [value.rpartition("=") for value in values]
    common = [value for topic, _, value in pairs if not topic]
    result: dict[str, Any] = dict.fromkeys(names, common[-1] if common else default)
    return result | {topic: value for topic, _, value in pairs if topic}
