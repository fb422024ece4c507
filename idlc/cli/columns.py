"""`idlc columns`."""

from __future__ import annotations

import shutil
import sys
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.recordings.aligned.table import Summary
    from idlc.tasks.columns import Work


@click.command(
    "columns",
    epilog=options.example(
        "idlc columns rec.mcap /imu",
        "idlc columns rec.mcap /imu -o imu.parquet",
        "idlc columns rec.mcap /imu --fields linear_acceleration --to 1m30s --format csv",
        "idlc columns rec.mcap /imu --where 'linear_acceleration.z > 12'",
        "idlc columns rec.mcap -o columns/",
        "idlc columns rec.mcap /imu /joints:position --grid /imu -o train.parquet",
    ),
)
@click.argument("subject", metavar="REC", type=click.Path())
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=completion.topics)
@click.option(
    "-o",
    "--out",
    metavar="OUT",
    default="-",
    type=click.Path(),
    help="Output file (.parquet, .arrow or .csv). For several topics, give a folder, or a file "
    "name that contains `{topic}`. Without -o, idlc shows charts and the first rows on a terminal, "
    "and writes Arrow's stream format to a pipe.",
)
@click.option(
    "--format",
    "style",
    type=click.Choice(("text", "parquet", "arrow", "csv")),
    help="Output format. By default, idlc uses the format of OUT's extension. If OUT is a folder, "
    "it writes Parquet files.",
)
@click.option(
    "--fields",
    metavar="FIELD,...",
    help="Select fields, such as `header.stamp,linear_acceleration`.",
)
@click.option(
    "--from",
    "start",
    metavar="TIME",
    help="Start time: an offset from the start (`10` or `1m30s`), a ROS time, or a UTC date.",
)
@click.option("--to", "end", metavar="TIME", help="End time (exclusive).")
@click.option(
    "--where",
    "conditions",
    metavar="CONDITION",
    multiple=True,
    help="Select messages by a field, such as `width > 640` or `name[0] == 'left'`. Repeat the "
    "option to combine conditions.",
)
@click.option(
    "--grid",
    metavar="GRID",
    help="Write one table with all topics: a row for each message of topic GRID, or for each "
    "period, such as `100ms` or `30Hz`. Select fields after a colon: `/imu:orientation`. Before "
    "idlc writes the table, it shows how well each topic fits.",
)
@click.option(
    "--how",
    metavar="WAY",
    multiple=True,
    help="With --grid: take the `last` message before a row, the `nearest`, or a value between two "
    "(`linear`). `/imu=linear` sets it for one topic, also for the next two options.",
)
@click.option(
    "--tolerance",
    metavar="LENGTH",
    multiple=True,
    help="With --grid: leave values empty without a message within this time, such as `50ms`.",
)
@click.option(
    "--clock",
    metavar="CLOCK",
    multiple=True,
    help="With --grid: use the time of recording (`log`) or of `header.stamp` (`header`).",
)
@click.option("--nested", is_flag=True, help="Write each nested message as one column of structs.")
@click.option(
    "--datetimes/--no-datetimes",
    default=True,
    show_default=True,
    help="Convert each Time and Duration to one column.",
)
@click.option(
    "--check/--no-check",
    default=None,
    help="Verify the checksums of the recording. By default, idlc verifies those of a damaged "
    "recording.",
)
@click.option("--strict", is_flag=True, help="Refuse a damaged recording.")
@click.option(
    "--index/--no-index",
    "use_index",
    default=True,
    show_default=True,
    help="Use the indexes of MCAP files.",
)
@click.option(
    "--type",
    "type_name",
    metavar="NAME",
    help="Select the messages of this type, if a topic has messages of several types.",
)
@options.include
@options.distro
@click.option("--force", is_flag=True, help="Replace existing files.")
def command(
    subject: str,
    fields: str | None,
    conditions: tuple[str, ...],
    grid: str | None,
    how: tuple[str, ...],
    tolerance: tuple[str, ...],
    clock: tuple[str, ...],
    **arguments: Any,
) -> int:
    """Show recorded topics, or convert them to columns for pandas, DuckDB and other tools.

    REC is an .mcap or .db3 file, a bag folder, or a pattern such as 'drive_*.mcap'. idlc reads
    several recordings as one recording. Without TOPIC, it reads all topics. In the table of a
    topic, each row is a message. The columns are the recording time and the fields.
    """
    from idlc.api.conditions import Condition
    from idlc.cli import output
    from idlc.cli.streams import written_as
    from idlc.diagnostics.ci import Form
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
    from idlc.recordings.find import expand, in_order, split_recordings
    from idlc.tasks.columns import ColumnsOptions, columns

    work = None
    if grid is not None:
        has_others = fields is not None or conditions or arguments["nested"]
        work = _table_of(grid, (how, tolerance, clock), bool(has_others), arguments)
    elif how or tolerance or clock:
        raise click.UsageError("--how, --tolerance and --clock need --grid")
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
        written = columns(request, report, update, work)
    width = shutil.get_terminal_size((100, 24)).columns
    previews = [file.preview.text(width) for file in written if file.preview]
    output.texts(("".join(f"{line}\n" for line in lines) for lines in previews), "text", sys.stdout)
    for file in written:
        if not file.preview:
            rows = "messages" if grid is None else "rows"
            sys.stderr.write(f"{file.topic}: {file.rows:,} {rows} → {file.path}\n")
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)


def _table_of(
    grid: str, ways: tuple[tuple[str, ...], ...], has_others: bool, arguments: dict[str, Any]
) -> Work:
    """Return what writes the table of --grid, or report options that it does not have."""
    from idlc.tasks.aligned import Grid, write_aligned

    if has_others or not arguments["datetimes"]:
        hint = "select fields after a colon: `/imu:orientation`"
        raise click.UsageError(f"--grid has no --fields, --where, --nested, --no-datetimes; {hint}")
    to_stdout = arguments["style"] == "text" or (arguments["out"] == "-" and sys.stdout.isatty())
    return partial(write_aligned, Grid(grid, *ways), partial(_show_fit, to_stdout))


def _show_fit(is_output: bool, summaries: list[Summary]) -> None:
    """Show how well topics fit the clock of a table."""
    from idlc.diagnostics.text import one_line

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
