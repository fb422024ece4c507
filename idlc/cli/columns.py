"""`idlc columns`."""

from __future__ import annotations

import sys
from typing import Any

import click

from idlc.cli import completion, options


@click.command(
    "columns",
    epilog=options.example(
        "idlc columns rec.mcap /imu -o imu.parquet",
        "idlc columns rec.mcap /imu --fields linear_acceleration --to 1m30s --format csv",
        "idlc columns rec.mcap -o columns/",
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
    help="The file to write, .parquet, .arrow or .csv; for several topics a folder, or a name with "
    "`{topic}` in it. Otherwise, Arrow's stream format goes to standard output.",
)
@click.option(
    "--format",
    "style",
    type=click.Choice(("parquet", "arrow", "csv")),
    help="Otherwise what OUT ends with, or parquet in a folder.",
)
@click.option(
    "--fields", metavar="FIELD,...", help="Only these, such as `header.stamp,linear_acceleration`."
)
@click.option(
    "--from",
    "start",
    metavar="TIME",
    help="From this time on: `10` or `1m30s` after the start, a time of ROS, or a date in UTC.",
)
@click.option("--to", "end", metavar="TIME", help="Until before this time.")
@click.option("--nested", is_flag=True, help="Keep messages in messages as structs.")
@click.option(
    "--datetimes/--no-datetimes",
    default=True,
    show_default=True,
    help="Make Time and Duration one column each.",
)
@click.option("--check", is_flag=True, help="Compare the checksums of the recording.")
@click.option(
    "--index/--no-index",
    "use_index",
    default=True,
    show_default=True,
    help="Use the indexes of MCAP files.",
)
@options.include
@click.option("--force", is_flag=True, help="Replace files that exist.")
def command(subject: str, fields: str | None, **arguments: Any) -> int:
    """Write topics of a recording as columns, for pandas, DuckDB and others.

    REC is an .mcap or .db3 file, or the folder of a bag; several, or a pattern such as
    'drive_*.mcap', are read as one. Without TOPIC, all topics are written.
    Each row has the time when a message was recorded, and a column for each of its fields.
    """
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
    from idlc.recordings.export import ColumnsOptions, columns
    from idlc.recordings.find import expand, split_recordings

    report = Report()
    names = None if fields is None else tuple(name.strip() for name in fields.split(","))
    recordings, topics = split_recordings(arguments.pop("topics"), Root.here())
    paths = (*expand(subject), *recordings)
    request = ColumnsOptions(paths or (subject,), tuple(topics), fields=names, **arguments)
    with output.progress_bar(sys.stderr) as update:
        written = columns(request, report, update)
    for file in written:
        sys.stderr.write(f"{file.topic}: {file.rows:,} messages → {file.path}\n")
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)
