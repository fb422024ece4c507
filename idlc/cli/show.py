"""`idlc show`."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.project.settings import Scope
    from idlc.robot.live.overview import Connection
    from idlc.robot.qos import QoSProfile
    from idlc.tasks.show import RecordingFacts, TopicFacts

#: Characters of a hash that people compare.
SHORT = len("RIHS01_") + 8
HEAD = ("topic", "type", "messages", "rate", "size", "QoS", "hash", "installed")
#: Columns of numbers.
NUMBERS = {"messages", "rate", "size"}
ROBOT_HEAD = ("", "name", "type", "hash", "installed", "from", "to", "QoS")
#: How text says whether the type of this machine is that of the recording or robot.
INSTALLED = {"same": "same", "differs": "different", "unknown": "-"}
#: Nodes, profiles and mismatches that text lists.
LISTED = 3
MISMATCHES = 20
#: Pairs of endpoints that JSON lists.
MOST_MISMATCHES = 1000


def _table(topic_facts: Sequence[TopicFacts]) -> Iterator[str]:
    from idlc.diagnostics.text import one_line

    rows: list[tuple[str, ...]] = [HEAD] if topic_facts else []
    for facts in topic_facts:
        count = "?" if facts.messages is None else str(facts.messages)
        hash_ = one_line(facts.hash or "-")
        no_definition = "" if facts.definition else "; no definition in the recording"
        name = one_line(facts.name)
        # lines that begin with other characters may be commands to a CI system
        name = name if name[:1].isalnum() or name[:1] in ("/", "_") else f"`{name}`"
        type_ = one_line(facts.type_name)
        rate = "-" if facts.rate is None else f"{facts.rate:.4g} Hz"
        size = "-" if facts.size is None else size_text(facts.size)
        qos, here = one_line(facts.qos or "-"), INSTALLED[facts.here] + no_definition
        rows.append((name, type_, count, rate, size, qos, hash_[:SHORT], here))
    yield from _aligned(HEAD, rows)


def _aligned(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    from idlc.diagnostics.text import display_width

    widths = [max(map(display_width, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = []
        for title, text, width in zip(head, row, widths, strict=True):
            space = " " * (width - display_width(text))
            cells.append(space + text if title in NUMBERS else text + space)
        yield "  ".join(cells).rstrip() + "\n"


def size_text(size: int) -> str:
    """Return a number of bytes with a unit."""
    value, units = float(size), iter(("B", "kB", "MB", "GB"))
    unit = next(units)
    while value >= 1000 and unit != "GB":
        value, unit = value / 1000, next(units)
    return f"{value:.4g} {unit}"


def _summary(subject: str, facts: RecordingFacts) -> str:
    """Return the line about a whole recording."""
    from idlc.diagnostics.terminal import counted
    from idlc.diagnostics.text import one_line
    from idlc.recordings.times import date_text

    parts = [counted(facts.messages, "message"), size_text(facts.size)]
    if facts.start is not None and facts.end is not None:
        parts.append(f"{(facts.end - facts.start) / 1e9:.9g} s")
        parts.append(f"{date_text(facts.start)} to {date_text(facts.end)}")
    return f"{one_line(subject)}: {', '.join(parts)}\n"


def _recording(subject: str, style: str, scope: Scope, report: Report) -> None:
    """Write the summary of a recording, and its topics."""
    from idlc.cli import output
    from idlc.tasks import show

    whole, topics = show.recording(subject, scope, report)
    if style == "json":
        if whole:
            output.fact(sys.stdout, "recording", **whole._asdict())
        for facts in topics:
            output.fact(sys.stdout, "topic", **facts._asdict())
        return
    if whole:
        sys.stdout.write(_summary(subject, whole))
    sys.stdout.writelines(_table(topics))


def _robot_table(found: Sequence[Connection]) -> Iterator[str]:
    from idlc.diagnostics.report import first_few

    rows: list[tuple[str, ...]] = [ROBOT_HEAD] if found else []
    for each in found:
        senders, receivers = (
            first_few(nodes, LISTED) if nodes else "-" for nodes in (each.senders, each.receivers)
        )
        profiles = dict.fromkeys(map(_qos, each.qos or each.requested))
        qos = first_few(profiles, LISTED) if each.noun == "topic" else ""
        hash_, installed = (each.hash or "-")[:SHORT], INSTALLED[each.here]
        rows.append(
            (each.noun, each.name, each.type_name, hash_, installed, senders, receivers, qos)
        )
    yield from _aligned(ROBOT_HEAD, rows)


def _qos(qos: QoSProfile) -> str:
    """Return a profile in few words, without what is the default."""
    durability = [qos.durability.name.lower()] if qos.is_latched else []
    history = {"KEEP_LAST": [f"depth {qos.depth}"], "KEEP_ALL": ["keep_all"]}
    kept = history.get(qos.history.name, [])
    return " ".join((qos.reliability.name.lower(), *durability, *kept))


def _qos_facts(qos: QoSProfile) -> dict[str, Any]:
    """Return a profile for JSON; durations are nanoseconds, 2**63 - 1 if they never end."""
    from msgspec.structs import asdict

    facts = asdict(qos).items()
    return {key: value.name.lower() if hasattr(value, "name") else value for key, value in facts}


def _robot(address: str, style: str, scope: Scope, report: Report) -> None:
    """Write the graph of a robot."""
    from idlc.cli import output
    from idlc.diagnostics.report import first_few
    from idlc.diagnostics.terminal import counted
    from idlc.recordings.types import LocalTypes
    from idlc.robot.keys import Kind
    from idlc.robot.live import overview
    from idlc.robot.live.connect import connected, robot_entities

    with connected(address, report) as session:
        if session is None:
            return
        entities = robot_entities(session)
    found = overview.connections(entities, LocalTypes(scope, report))
    nodes = sorted({end.node_name for end in entities if end.kind is Kind.NODE})
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


@click.command(
    "show",
    epilog=options.example(
        "idlc show geometry_msgs/msg/PoseStamped", "idlc show std_msgs/msg/Header --format hash"
    ),
)
@click.argument(
    "subject", metavar="TYPE|PATH|REC", type=click.Path(), shell_complete=completion.types_and_paths
)
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=completion.topics)
@options.output_style(
    ("text", "json", "hash", "type-description", "ros2idl", "jsonschema", "mcap", "msg"),
    "Output format: text, JSON facts, type hashes (RIHS01), the type description that ROS 2 "
    "installs as JSON, IDL, JSON Schema, an MCAP schema, or the files of the recorded definitions "
    "(see --out).",
)
@click.option(
    "-o",
    "--out",
    metavar="DIR",
    type=click.Path(file_okay=False),
    help="With --format msg, the folder to write a recording's .msg, .srv, .action and .idl files "
    "to: a package in each folder.",
)
@options.scoped(options.package, options.include, options.exclude, options.distro)
def command(
    subject: str,
    topics: tuple[str, ...],
    style: str,
    out: str | None,
    scope: Scope,
    report: Report,
) -> None:
    """Show an interface with its nested messages and all comments.

    For a recording, idlc lists each topic with its type, message count and type hash, and shows
    whether your local type matches. With TOPIC, it shows the recorded definitions of these topics.

    REC can also be the address of a robot, such as `dds` or tcp/robot:7447. idlc lists the robot's
    topics, services and actions, and the nodes that use them. It also reports incompatible
    endpoints.

    With --format hash, idlc prints the hashes of all TYPE, PATH and REC arguments, and for a
    service or action those of the messages that ROS 2 derives from it.
    """
    from idlc.cli import output
    from idlc.project.find import is_address
    from idlc.recordings.find import is_recording
    from idlc.tasks import show

    is_of_recording = is_recording(subject, scope.root)
    if (style == "msg") != (out is not None) or (style == "msg" and not is_of_recording):
        raise click.UsageError("`--format msg` and `-o DIR` belong together, and need a recording")
    if out is not None:
        from idlc.api.sources import read_source
        from idlc.recordings.packages import write_definitions

        for path in write_definitions(read_source, subject, topics, out, scope, report):
            sys.stdout.write(f"{path}\n")
        return
    if style == "hash" and not (topics and is_of_recording):
        paint = output.painter(sys.stdout)
        for value, name in show.hashes((subject, *topics), scope, report):
            sys.stdout.write(f"{paint('value', value)}  {name}\n")
    elif not is_of_recording:
        if topics:
            raise click.UsageError(
                f"`{subject}` is not a recording; TOPIC selects from an .mcap or .db3 file or a bag"
            )
        texts = show.show(subject, style, scope, report)
        output.texts(texts, style, sys.stdout, interfaces=True)
    elif topics:
        definitions = show.definitions(subject, topics, style, scope, report)
        output.texts(definitions, style, sys.stdout, interfaces=True)
    elif is_address(subject) and style in options.FORMATS:
        _robot(subject, style, scope, report)
    elif style in ("json", "text"):
        _recording(subject, style, scope, report)
    else:
        raise click.UsageError(f"--format {style} needs a topic; `idlc show {subject}` lists them")
