"""`idlc record`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.robot.session import Session


@click.command(
    "record",
    epilog=options.example(
        "idlc record tcp/robot:7447 -o drive.mcap /odom /scan --duration 60",
        "idlc columns drive.mcap /odom",
    ),
)
@options.on_robot
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=completion.robot_names)
@click.option(
    "-o", "--out", metavar="FILE", required=True, type=click.Path(), help="Output file (.mcap)."
)
@click.option(
    "--duration",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="Stop after this time.  [default: Ctrl-C stops]",
)
def command(
    topics: tuple[str, ...],
    out: str,
    duration: float | None,
    session: Session,
    report: Report,
    include: tuple[str, ...],
) -> bool:
    """Record topics of a robot into an MCAP file.

    ADDRESS is `dds`, or the endpoint of the robot's Zenoh router, such as tcp/robot:7447. Without
    TOPIC, idlc records all topics except the topics of actions, and adds topics that appear later.
    The file contains the definitions of all types. `idlc columns`, rosbag2 and Foxglove can read
    it.
    """
    import time

    from idlc.cli.streams import stop_signals
    from idlc.diagnostics import codes
    from idlc.diagnostics.text import one_line
    from idlc.robot.live.connect import TOPICS, find_endpoints

    if not out.endswith(".mcap"):
        raise click.UsageError(f"'{out}' is not an MCAP file; write `-o {out}.mcap`")
    try:
        from idlc.robot.live.recorder import Recorder
    except ImportError as error:
        raise click.UsageError(f"{error}; run `pip install 'idlc[zenoh,recordings]'`") from None
    names = {end.name for end in find_endpoints(session, topics, TOPICS, report)}
    if report.had_errors:
        return False
    end = float("inf") if duration is None else time.monotonic() + duration
    try:
        with stop_signals() as stopped, open(out, "xb") as file:  # noqa: PTH123 - never a link
            recorder = Recorder(session, file, names, report, include)
            sys.stderr.write(f"recording to {one_line(out)}; press Ctrl-C to stop\n")
            sys.stderr.flush()
            try:
                recorder.run(lambda: stopped.is_set() or time.monotonic() > end)
            finally:
                counts = recorder.close()
    except FileExistsError:
        hint = "remove it, or choose another name"
        report.add(codes.EXISTING_FILE.of(out, f"`{out}` exists", hint=hint))
    except OSError as error:
        message = f"cannot write `{out}`: {error.strerror or error}"
        report.add(codes.CANNOT_WRITE.of(out, message))
    else:
        for name, count in sorted(counts.items()):
            sys.stderr.write(f"{name}: {count:,} messages → {one_line(out)}\n")
        if not any(counts.values()):
            topics_there = f"of {len(counts)} topics" if counts else "because there is no topic"
            report.notes.append(f"`{out}` contains no messages {topics_there}")
            return True
    return False
