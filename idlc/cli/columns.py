"""`idlc columns`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options


@click.command(
    "columns",
    epilog=options.example(
        "idlc columns rec.mcap /imu",
        "idlc columns rec.mcap /imu -o imu.parquet",
        "idlc columns rec.mcap /imu --fields linear_acceleration --to 1m30s --format csv",
        "idlc columns rec.mcap /imu --where 'linear_acceleration.z > 12'",
        "idlc columns rec.mcap -o columns/",
        "idlc columns rec.mcap /imu /joints:position --grid /imu -o train.parquet",
        "idlc columns 'ep_*.mcap' /camera /joints:position --grid 30Hz --format lerobot -o train/",
    ),
)
@click.argument("subject", metavar="REC", type=click.Path())
@click.argument(
    "topics", metavar="[TOPIC]...", nargs=-1, shell_complete=options.completed("topics")
)
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
    type=click.Choice(("text", "parquet", "arrow", "csv", "lerobot")),
    help="Output format. By default, idlc uses the format of OUT's extension. If OUT is a folder, "
    "it writes Parquet files. `lerobot` needs --grid PERIOD and a new folder OUT: idlc writes a "
    "data set for LeRobot, in version 3.0 of its format, with an episode for each REC. Images "
    "become videos.",
)
@click.option(
    "--fields",
    metavar="FIELD,...",
    help="Select fields, such as `header.stamp,position.elbow`.",
)
@click.option(
    "--from",
    "start",
    metavar="TIME",
    help="Start time: an offset from the start (`10` or `1m30s`), a ROS time such as "
    "`1700000000.5`, or a UTC date.",
)
@click.option("--to", "end", metavar="TIME", help="End time (exclusive).")
@click.option(
    "--where",
    "conditions",
    metavar="CONDITION",
    multiple=True,
    help="Select messages by a field, such as `width > 640` or `position.elbow < 1`. Repeat the "
    "option to combine conditions.",
)
@click.option(
    "--grid",
    metavar="GRID",
    help="Write one table with all topics. If GRID is a topic, each of its messages becomes a row. "
    "If GRID is a period, such as `100ms` or `30Hz`, there is a row for each period. Before it "
    "writes, idlc shows for each topic how many rows have a value, and how old these values are.",
)
@click.option(
    "--how",
    metavar="WAY",
    multiple=True,
    help="With --grid: which value a row has. WAY is `last` (of the last message before the row), "
    "`nearest`, or `linear` (interpolated). `/imu=linear` is for the topic /imu alone. "
    "--tolerance and --clock take the same form, such as `/imu=50ms`.",
)
@click.option(
    "--tolerance",
    metavar="LENGTH",
    multiple=True,
    help="With --grid: the longest time between a row and a message, such as `50ms`. If a topic "
    "has no message within this time, its columns are empty in that row.",
)
@click.option(
    "--clock",
    metavar="CLOCK",
    multiple=True,
    help="With --grid: which time a message has. CLOCK is `log` (the time of recording) or "
    "`header` (the field `header.stamp`).",
)
@click.option(
    "--feature",
    "features",
    metavar="NAME=COLUMN,...",
    multiple=True,
    help="With --format lerobot: combine these columns of the table into NAME, a feature of the "
    "data set, as in `action=/cmd_vel.linear`. A topic that no --feature names becomes a feature "
    "of its own: /imu becomes `observation.imu`.",
)
@click.option(
    "--episodes",
    metavar="TOPIC",
    help="With --format lerobot: each message of TOPIC ends the current episode. It also begins "
    "the next one, unless its field `data` is false or an empty text. Another text in `data` is "
    "the task of the next episode.",
)
@click.option(
    "--task",
    metavar="TEXT",
    help="With --format lerobot: the robot's task, in words, if --episodes does not give it.",
)
@click.option(
    "--each",
    metavar="FIELD",
    help="Write one row for each element of the list FIELD, such as `transforms`, instead of one "
    "row for each recorded message. --fields then selects fields of the element.",
)
@click.option("--nested", is_flag=True, help="Write each nested message as one column of structs.")
@click.option(
    "--no-datetimes",
    is_flag=True,
    help="Write each Time and Duration as two columns, `sec` and `nanosec`.",
)
@click.option(
    "--check/--no-check",
    default=None,
    help="Verify all checksums of the recording. By default, idlc verifies them only if it finds "
    "other damage, such as a missing end. --no-check is for recordings with wrong checksums or "
    "indexes: idlc uses neither.",
)
@click.option("--strict", is_flag=True, help="Refuse a damaged recording.")
@click.option(
    "--type",
    "type_name",
    metavar="NAME",
    help="Select the messages of this type, if a topic has messages of several types.",
)
@options.include
@options.distro
@click.option("--force", is_flag=True, help="Replace existing files.")
def command(**arguments: Any) -> int:
    """Show recorded topics, or convert them to columns for pandas, DuckDB and other tools.

    REC is an .mcap or .db3 file, a bag folder, or a pattern such as 'drive_*.mcap'. idlc reads
    several recordings as one recording. TOPIC is the name of a topic. With --grid,
    `/imu:orientation` selects a field of a topic. Without TOPIC, idlc reads all topics. In the
    table of a topic, each row is a message. The columns are the recording time and the fields.
    """
    from idlc.cli.run.columns import run

    return run(**arguments)
