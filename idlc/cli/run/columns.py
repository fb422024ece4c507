"""`idlc columns`: the requested table, and what is said about it."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from idlc.api.conditions import Condition
from idlc.cli import output
from idlc.cli.streams import written_as
from idlc.diagnostics.ci import Form
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import one_line
from idlc.project.root import Root
from idlc.project.words import expand, in_order, split_recordings
from idlc.tasks.columns import STDOUT, ColumnsOptions, WrittenFile, columns

if TYPE_CHECKING:
    from idlc.diagnostics.terminal import Progress
    from idlc.recordings.aligned.table import ClockFit

    Write = Callable[[ColumnsOptions, Report, Progress], list[WrittenFile]]


def run(
    subject: str,
    fields: str | None,
    conditions: tuple[str, ...],
    grid: str | None,
    how: tuple[str, ...],
    tolerance: tuple[str, ...],
    clock: tuple[str, ...],
    no_datetimes: bool,
    features: tuple[str, ...],
    episodes: str | None,
    task: str | None,
    **arguments: Any,
) -> int:
    """Run the command and return the exit status."""
    arguments["datetimes"] = not no_datetimes
    others = [fields is not None, conditions, arguments["nested"], arguments["each"], no_datetimes]
    data_set = (features, episodes, task)
    write = _write_of(grid, (how, tolerance, clock), data_set, any(others), arguments)
    report = Report()
    names = None if fields is None else tuple(name.strip() for name in fields.split(","))
    try:
        arguments["conditions"] = tuple(map(Condition.parse, conditions))
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    recordings, topics = split_recordings(arguments.pop("topics"), Root.here())
    paths = tuple(in_order([*expand(subject), *recordings]))
    request = ColumnsOptions(paths or (subject,), tuple(topics), fields=names, **arguments)
    form = Form.EXACT if request.style == "csv" else Form.TEXT
    with output.progress_bar(sys.stderr) as update, written_as(form, sys.stdout):
        written = write(request, report, update)
    width = shutil.get_terminal_size((100, 24)).columns
    previews = [file.preview.text(width) for file in written if file.preview]
    output.texts(("".join(f"{line}\n" for line in lines) for lines in previews), "text", sys.stdout)
    rows = "rows" if any([grid, request.each]) else "messages"
    for file in written:
        if not file.preview:
            sys.stderr.write(f"{file.topic}: {file.rows:,} {rows} → {file.path}\n")
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)


def _write_of(
    grid: str | None,
    ways: tuple[tuple[str, ...], ...],
    data_set: tuple[Any, ...],
    has_others: bool,
    arguments: dict[str, Any],
) -> Write:
    """Return what writes the files, or report options that do not belong together."""
    is_data_set = arguments["style"] == "lerobot"
    if any(data_set) and not is_data_set:
        raise click.UsageError("--feature, --episodes and --task need --format lerobot")
    if is_data_set and (grid is None or grid.startswith("/")):
        raise click.UsageError("--format lerobot needs a period, such as `--grid 30Hz`")
    if is_data_set and (arguments["out"] == STDOUT or arguments["force"]):
        raise click.UsageError("--format lerobot needs a new folder: add -o DIR; omit --force")
    if grid is None:
        if any(ways):
            raise click.UsageError("--how, --tolerance and --clock need --grid")
        return columns
    if has_others:
        hint = "select fields after a colon: `/imu:orientation`"
        raise click.UsageError(
            f"--grid has no --fields, --where, --each, --nested, --no-datetimes; {hint}"
        )
    from idlc.tasks.aligned import Grid, write_aligned  # other tables do not need it

    clock = Grid(grid, *ways)
    if is_data_set:
        from idlc.tasks.lerobot import LeRobot, write_data_set

        return partial(write_data_set, LeRobot(*data_set), clock, partial(_show_fit, False))
    to_stdout = arguments["style"] == "text" or (arguments["out"] == STDOUT and sys.stdout.isatty())
    return partial(columns, work=partial(write_aligned, clock, partial(_show_fit, to_stdout)))


def _show_fit(is_output: bool, summaries: list[ClockFit]) -> None:
    """Show how well topics fit the clock of a table."""
    head = ("rate", "longest gap", "mean age", "max age", "no value", "unordered")
    width = max([5, *(len(one_line(fit.topic)) for fit in summaries)])
    lines = [f"{'topic':{width}}  messages  {'  '.join(title.rjust(11) for title in head)}\n"]
    for fit in summaries:
        numbers = (
            f"{fit.rate:.4g} Hz",
            *(f"{seconds * 1000:.4g} ms" for seconds in fit[3:6]),
            f"{fit.missing:,} rows",
            f"{fit.unordered:,}",
        )
        cells = "  ".join(number.rjust(11) for number in numbers)
        lines.append(f"{one_line(fit.topic):{width}}  {fit.messages:8,}  {cells}\n")
    (sys.stdout if is_output else sys.stderr).write("".join(lines))
