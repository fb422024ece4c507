"""`idlc record`."""

from __future__ import annotations

import sys

import click

from idlc.cli import completion, options


@click.command(
    "record",
    epilog=options.example(
        "idlc record tcp/robot:7447 -o drive.mcap /odom /scan --duration 60",
        "idlc columns drive.mcap /odom",
    ),
)
@click.argument("address", metavar="ADDRESS")
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=completion.robot_topics)
@click.option(
    "-o", "--out", metavar="FILE", required=True, type=click.Path(), help="Output file (.mcap)."
)
@click.option(
    "--duration",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="Stop after this time.  [default: Ctrl-C stops]",
)
def command(address: str, topics: tuple[str, ...], out: str, duration: float | None) -> int:
    """Record topics of a robot into an MCAP file.

    ADDRESS is the endpoint of the robot's Zenoh router, such as tcp/robot:7447. Without TOPIC, idlc
    records all topics except the topics of actions, and adds topics that appear later. The file
    contains the definitions of all types. `idlc columns`, rosbag2 and Foxglove can read it.
    """
    import signal
    import time
    from threading import Event

    from idlc.cli import output
    from idlc.diagnostics import codes
    from idlc.diagnostics.report import Report
    from idlc.diagnostics.text import one_line
    from idlc.robot.live.connect import connected

    if not out.endswith(".mcap"):
        raise click.UsageError(f"'{out}' is not an MCAP file; write `-o {out}.mcap`")
    try:
        from idlc.robot.live.recorder import Recorder, check_topics
    except ImportError as error:
        raise click.UsageError(f"{error}; run `pip install 'idlc[zenoh,recordings]'`") from None
    report = Report()
    names = [topic if topic.startswith("/") else f"/{topic}" for topic in topics]
    recorded = None
    with connected(address, report) as session:
        if session and (not names or check_topics(session, names, report)):
            stopped = Event()
            handlers = {
                number: signal.signal(number, lambda *_: stopped.set())
                for number in (signal.SIGINT, signal.SIGTERM)
            }
            end = None if duration is None else time.monotonic() + duration
            try:
                with open(out, "xb") as file:  # noqa: PTH123 - never follows a link
                    recorder = Recorder(session, address, file, names, report)
                    sys.stderr.write(f"recording to {one_line(out)}; press Ctrl-C to stop\n")
                    sys.stderr.flush()
                    try:
                        recorder.run(
                            lambda: stopped.is_set() or (end is not None and time.monotonic() > end)
                        )
                    finally:
                        recorded = recorder.close()
            except FileExistsError:
                hint = "remove it, or choose another name"
                report.add(codes.EXISTING_FILE.of(out, f"`{out}` exists", hint=hint))
            except OSError as error:
                message = f"cannot write `{out}`: {error.strerror or error}"
                report.add(codes.CANNOT_WRITE.of(out, message))
            finally:
                for number, handler in handlers.items():
                    signal.signal(number, handler or signal.SIG_DFL)
    if recorded:
        for name, count in sorted(recorded.counts.items()):
            sys.stderr.write(f"{name}: {count:,} messages → {one_line(out)}\n")
        if recorded.lost:
            report.notes.append(f"the disk was too slow: {recorded.lost:,} messages were lost")
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)
