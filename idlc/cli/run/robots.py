"""Commands for a running robot: `call`, `echo`, `record`, `router`, and `show ADDRESS`."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import islice
from typing import Any

import click
from msgspec.structs import asdict

from idlc.cli import messages, output
from idlc.cli.streams import stop_signals
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError, first_few
from idlc.diagnostics.terminal import counted
from idlc.diagnostics.text import one_line
from idlc.project.settings import Scope, settings_here
from idlc.recordings.types import LocalTypes
from idlc.robot.errors import RobotError
from idlc.robot.keys import EntityKind
from idlc.robot.live import overview
from idlc.robot.live.connect import TOPICS, connected, find_endpoints, robot_entities
from idlc.robot.live.connect import call as call_services
from idlc.robot.live.overview import OverviewRow
from idlc.robot.live.traffic import find_version
from idlc.robot.live.traffic import messages as arriving
from idlc.robot.qos import QoSProfile
from idlc.robot.session import Session, open_router


def with_session(
    command: Callable[..., bool | None], address: str, include: tuple[str, ...]
) -> int:
    """Call a command with the `session` with a robot and a `report`, which is shown then."""
    settings, report = settings_here()
    folders, failed = (*include, *settings.include), False
    with connected(address, report) as session, suppress(ReportedError):
        report.raise_errors()
        failed = bool(session and command(session=session, report=report, include=folders))
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report) or int(failed)


def call(
    service: str,
    values: tuple[str, ...],
    timeout: float,
    style: str,
    session: Session,
    report: Report,
    include: tuple[str, ...],
) -> None:
    """Call a service and print the response."""
    kind, ends = find_version(session, service, [EntityKind.SERVICE], report, include)
    if kind is None:
        return
    request = messages.message_of(kind.Request, values)
    replies = call_services(session, [(ends[0], request)], timeout)
    _, payload = next(replies, (0, None))
    if payload is None:
        message = f"`{ends[0].name}` of `{ends[0].node_name}` did not respond"
        hint = f"idlc waited {timeout:g} s; raise --timeout"
        report.add(codes.NO_ANSWER.of("", message, hint=hint))
        return
    try:
        text = "".join(messages.texts(style, [kind.Response.deserialize(payload).to_dict()]))
        output.lines(text.removesuffix(messages.BETWEEN), style, sys.stdout)
    except ValueError as error:
        message = f"`{ends[0].name}` sent a malformed response: {error}"
        report.add(codes.NO_ANSWER.of("", message))


def echo(
    topic: str,
    count: int | None,
    fields: str | None,
    style: str,
    session: Session,
    report: Report,
    include: tuple[str, ...],
) -> None:
    """Print messages as they arrive."""
    kind, ends = find_version(session, topic, TOPICS, report, include)
    if kind is None:
        return
    output.notes(report, sys.stderr)
    report.notes.clear()

    def complain(reason: str) -> None:
        sys.stderr.write(f"note: {one_line(reason)}\n")
        sys.stderr.flush()

    read: Callable[[bytes], dict[str, Any]] = partial(_read_all, kind)
    if fields is not None:
        try:
            read = messages.fields_of(kind, [path.strip() for path in fields.split(",")], complain)
        except ValueError as error:
            raise click.UsageError(str(error)) from None
    arrived = arriving(session, ends, read, count, report, complain, kind)
    with suppress(KeyboardInterrupt):
        for text in messages.texts(style, arrived, is_brief=sys.stdout.isatty()):
            output.lines(text, style, sys.stdout)
            sys.stdout.flush()


def _read_all(kind: Any, buffer: bytes) -> dict[str, Any]:
    values: dict[str, Any] = kind.deserialize(buffer).to_dict()
    return values


def record(
    topics: tuple[str, ...],
    out: str,
    duration: float | None,
    session: Session,
    report: Report,
    include: tuple[str, ...],
) -> bool:
    """Record topics; return True for a recording without messages."""
    if not out.endswith(".mcap"):
        raise click.UsageError(f"'{out}' is not an MCAP file; write `-o {out}.mcap`")
    try:
        from idlc.robot.live.recorder import Recorder
    except ImportError as error:
        raise click.UsageError(f"{error}; run `pip install 'idlc[zenoh,recordings]'`") from None
    names = {end.name for end in find_endpoints(session, topics, TOPICS, report)}
    report.raise_errors()
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


def router(listen: tuple[str, ...], connect: tuple[str, ...]) -> int:
    """Run a router until Ctrl-C; return the exit status."""
    try:
        with stop_signals() as stopped, open_router(listen, connect):
            sys.stdout.write(f"listening on {', '.join(listen)}; press Ctrl-C to stop\n")
            sys.stdout.flush()
            while not stopped.wait(0.5):  # on Windows, a wait without an end is not interrupted
                pass
    except RobotError as error:
        output.usage_error(error.message, error.hint or "")
        return 2
    return 0


ROBOT_HEAD = ("", "name", "type", "hash", "installed", "from", "to", "QoS")
#: Nodes and profiles that a row of the table lists, and mismatches that text lists.
LISTED = 3
MISMATCHES = 20
#: Pairs of endpoints that JSON lists.
MOST_MISMATCHES = 1000


def _robot_table(found: Sequence[OverviewRow]) -> Iterator[str]:
    """Yield the lines of a table of what is connected."""
    rows: list[tuple[str, ...]] = [ROBOT_HEAD] if found else []
    for each in found:
        senders, receivers = (
            first_few(nodes, LISTED) if nodes else "-" for nodes in (each.senders, each.receivers)
        )
        profiles = dict.fromkeys(map(_qos, each.qos or each.requested))
        qos = first_few(profiles, LISTED) if each.noun == "topic" else ""
        hash_, installed = (each.hash or "-")[: output.SHORT], output.INSTALLED[each.here]
        rows.append(
            (each.noun, each.name, each.type_name, hash_, installed, senders, receivers, qos)
        )
    yield from output.table(ROBOT_HEAD, rows)


def _qos(qos: QoSProfile) -> str:
    """Return a profile in few words, without what is the default."""
    durability = [qos.durability.name.lower()] if qos.is_latched else []
    history = {"KEEP_LAST": [f"depth {qos.depth}"], "KEEP_ALL": ["keep_all"]}
    kept = history.get(qos.history.name, [])
    return " ".join((qos.reliability.name.lower(), *durability, *kept))


def _qos_facts(qos: QoSProfile) -> dict[str, Any]:
    """Return a profile for JSON; durations are nanoseconds, 2**63 - 1 if they never end."""
    facts = asdict(qos).items()
    return {key: value.name.lower() if hasattr(value, "name") else value for key, value in facts}


def show_robot(address: str, style: str, scope: Scope, report: Report) -> None:
    """Write the graph of a robot."""
    with connected(address, report) as session:
        if session is None:
            return
        entities = robot_entities(session)
    found = overview.connections(entities, LocalTypes(scope, report))
    nodes = sorted({end.node_name for end in entities if end.kind is EntityKind.NODE})
    misfits = [*dict.fromkeys(islice(overview.mismatches(entities), MOST_MISMATCHES))]
    similar = overview.similar_names(found)
    if style == "json":
        for node in nodes:
            output.fact(sys.stdout, "node", name=node)
        for each in found:
            facts: dict[str, Any] = each._asdict()
            facts |= {key: [*map(_qos_facts, facts[key])] for key in ("qos", "requested")}
            output.fact(sys.stdout, facts.pop("noun"), **facts)
        for name, sender, receiver, reasons in misfits:
            ends = {"sender": sender, "receiver": receiver}
            output.fact(sys.stdout, "mismatch", name=name, **ends, reasons=reasons)
        for sent, received in similar:
            output.fact(sys.stdout, "similar", sent=sent, received=received)
        return
    shown = [each for each in found if not each.is_of_every_node]
    sys.stdout.writelines(_robot_table(shown))
    hidden = len(found) - len(shown)
    rest = f"; {counted(hidden, 'service')} for parameters and type descriptions" if hidden else ""
    sys.stdout.write(f"{counted(len(nodes), 'node')}: {first_few(nodes, 20) or 'none'}{rest}\n")
    for name, sender, receiver, reasons in misfits[:MISMATCHES]:
        differences = first_few(reasons, 5)
        sys.stdout.write(f"mismatch: {name}: {sender} → {receiver} differ in {differences}\n")
    if len(misfits) > MISMATCHES:
        sys.stdout.write(f"{len(misfits) - MISMATCHES} more mismatches; see --format json\n")
    for sent, received in similar:
        sys.stdout.write(f"similar names: {sent} has no receiver, and {received} no sender\n")
