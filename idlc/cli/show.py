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
    from idlc.tasks.show import TopicFacts

#: Characters of a hash that people compare.
SHORT = len("RIHS01_") + 8
HEAD = ("topic", "type", "messages", "hash", "here")
ROBOT_HEAD = ("", "name", "type", "hash", "here", "from", "to", "QoS")
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
        rows.append((name, type_, count, hash_[:SHORT], facts.here + no_definition))
    yield from _aligned(HEAD, rows)


def _aligned(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    from idlc.diagnostics.text import display_width

    widths = [max(map(display_width, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = []
        for title, text, width in zip(head, row, widths, strict=True):
            space = " " * (width - display_width(text))
            cells.append(space + text if title == "messages" else text + space)
        yield "  ".join(cells).rstrip() + "\n"


def _robot_table(found: Sequence[Connection]) -> Iterator[str]:
    from idlc.diagnostics.report import first_few

    rows: list[tuple[str, ...]] = [ROBOT_HEAD] if found else []
    for each in found:
        senders, receivers = (
            first_few(nodes, LISTED) if nodes else "-" for nodes in (each.senders, each.receivers)
        )
        profiles = dict.fromkeys(map(_qos, each.qos or each.requested))
        qos = first_few(profiles, LISTED) if each.noun == "topic" else ""
        hash_ = (each.hash or "-")[:SHORT]
        rows.append(
            (each.noun, each.name, each.type_name, hash_, each.here, senders, receivers, qos)
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


@click.command("show", epilog=options.example("idlc show geometry_msgs/msg/PoseStamped"))
@click.argument(
    "subject", metavar="TYPE|PATH|REC", type=click.Path(), shell_complete=completion.types_and_paths
)
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=completion.topics)
@options.output_style(
    ("text", "json", "ros2idl", "jsonschema", "mcap"),
    "Output format: text, JSON facts, IDL, JSON Schema or an MCAP schema.",
)
@options.scoped(options.package, options.include, options.distro)
def command(
    subject: str, topics: tuple[str, ...], style: str, scope: Scope, report: Report
) -> None:
    """Show an interface with its nested messages and all comments.

    REC is a recording: an .mcap or .db3 file, or a bag folder. For a recording, idlc lists each
    topic with its type, message count and type hash, and shows whether your local type matches.
    With TOPIC, it shows the recorded definitions of these topics.

    REC can also be the address of a robot, such as `dds` or tcp/robot:7447. idlc lists the robot's
    topics, services and actions, and the nodes that use them. It also reports incompatible
    endpoints.
    """
    from idlc.cli import output
    from idlc.project.find import is_address
    from idlc.recordings.find import is_recording
    from idlc.tasks import show

    if not is_recording(subject, scope.root):
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
    elif style == "json":
        for facts in show.topics(subject, scope, report):
            output.fact(sys.stdout, "topic", **facts._asdict())
    elif style == "text":
        sys.stdout.writelines(_table(show.topics(subject, scope, report)))
    else:
        raise click.UsageError(f"--format {style} needs a topic; `idlc show {subject}` lists them")
