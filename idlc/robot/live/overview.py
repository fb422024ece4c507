"""The graph of a robot as tables: who uses which name with which type, and what does not fit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Literal, NamedTuple, TypeAlias

from idlc.model import ir
from idlc.recordings.definitions import interface_of, type_name
from idlc.recordings.types import LocalTypes
from idlc.robot.graph import mismatches
from idlc.robot.keys import Entity, Kind
from idlc.robot.names import action_part
from idlc.robot.qos import FOLLOWS, INFINITE, QoSProfile

Noun: TypeAlias = Literal["topic", "service", "action"]
_SENDS = {Kind.PUBLISHER, Kind.CLIENT}
#: What every node has; the table leaves these services out.
_OF_EVERY_NODE = ("rcl_interfaces/srv/", "type_description_interfaces/srv/")
#: Names that are compared with each other.
MOST_NAMES = 2000
#: Pairs of endpoints that are listed.
MOST_MISMATCHES = 1000


class Connection(NamedTuple):
    """A topic, service or action with one version of its type, and the nodes at both ends.

    `senders` publish or call, `receivers` subscribe or serve. `qos` has the profiles of the
    senders, `requested` those of the receivers. `here` compares the type with the local one.
    """

    noun: Noun
    name: str
    type_name: str
    hash: str
    senders: tuple[str, ...]
    receivers: tuple[str, ...]
    qos: tuple[QoSProfile, ...]
    requested: tuple[QoSProfile, ...]
    here: str

    @property
    def is_of_every_node(self) -> bool:
        """True for services for parameters and type descriptions."""
        return self.noun == "service" and self.type_name.startswith(_OF_EVERY_NODE)


def connections(entities: Iterable[Entity], local: LocalTypes) -> list[Connection]:
    """Return what endpoints have in common, sorted; actions are put together from their parts."""
    places: dict[tuple[Noun, str, str, str], list[Entity]] = {}
    for end in entities:
        noun: Noun = "topic" if end.kind in (Kind.PUBLISHER, Kind.SUBSCRIPTION) else "service"
        name, type_, hash_, part = end.name, end.type, end.hash, action_part(end.name)
        if end.kind is Kind.NODE or (part and part[1] != "feedback"):
            continue
        if part:
            noun, name = "action", part[0]
        places.setdefault((noun, name, type_, hash_), []).append(end)
    found = []
    for (noun, name, type_, hash_), ends in sorted(places.items()):
        senders = [end for end in ends if end.kind in _SENDS]
        receivers = [end for end in ends if end.kind not in _SENDS]
        if noun == "action":  # a client receives the feedback
            senders, receivers = receivers, senders
        parsed = type_name(type_)
        shown = str(interface_of(parsed)) if noun == "action" and parsed else type_
        found.append(
            Connection(
                noun,
                name,
                shown,
                hash_,
                _nodes(senders),
                _nodes(receivers),
                tuple(dict.fromkeys(end.qos for end in senders)),
                tuple(dict.fromkeys(end.qos for end in receivers)),
                _here(parsed, hash_, local),
            )
        )
    return found


def _nodes(ends: Iterable[Entity]) -> tuple[str, ...]:
    return tuple(sorted({end.node_name for end in ends}))


def _here(name: ir.TypeName | None, hash_: str, local: LocalTypes) -> str:
    mine = local.hash(name, interface_of(name)) if name else None
    return "unknown" if not (mine and hash_) else "same" if mine == hash_ else "differs"


class Misfit(NamedTuple):
    """Endpoints of one name that do not fit together; `reasons` are those of `mismatches`."""

    name: str
    sender: str
    receiver: str
    reasons: tuple[str, ...]


def misfits(entities: Iterable[Entity]) -> Iterator[Misfit]:
    """Yield each pair of nodes with endpoints that do not fit, at most so many."""
    seen: dict[Misfit, None] = {}
    for sender, receiver, reasons in mismatches(entities):
        misfit = Misfit(sender.name, sender.node_name, receiver.node_name, reasons)
        if misfit not in seen:
            seen[misfit] = None
            yield misfit
        if len(seen) == MOST_MISMATCHES:
            return


class Similar(NamedTuple):
    """A name without receivers, and one without senders, which differ in one letter."""

    sent: str
    received: str


def similar_names(found: Sequence[Connection]) -> Iterator[Similar]:
    """Yield names of one type that one end may have misspelled."""
    for noun in ("topic", "service", "action"):
        mine = [connection for connection in found if connection.noun == noun]
        sent = {(c.name, c.type_name) for c in mine if c.senders}
        received = {(c.name, c.type_name) for c in mine if c.receivers}
        variants: dict[tuple[str, str], str] = {}
        for name, type_ in sorted(received - sent)[:MOST_NAMES]:
            variants |= {(variant, type_): name for variant in _variants(name)}
        for name, type_ in sorted(sent - received)[:MOST_NAMES]:
            near = (variants.get((variant, type_)) for variant in _variants(name))
            if other := next(filter(None, near), None):
                yield Similar(name, other)


def _variants(name: str) -> Iterator[str]:
    """Yield a name, and the name without each of its letters."""
    yield name
    for at in range(1, len(name)):
        yield name[:at] + name[at + 1 :]


def qos_text(qos: QoSProfile) -> str:
    """Return a profile in few words, without what is the default."""
    words = [qos.reliability.name.lower()]
    if qos.is_latched:
        words.append(qos.durability.name.lower())
    words.append("keep_all" if qos.history.name == "KEEP_ALL" else f"depth {qos.depth}")
    return " ".join(words)


def qos_facts(qos: QoSProfile) -> dict[str, Any]:
    """Return a profile for JSON; durations are nanoseconds, and `None` if they never end."""
    durations = ("lifespan", "deadline", "liveliness_lease_duration")
    policies = ("history", "reliability", "durability", "liveliness")
    return {
        "depth": qos.depth,
        **{name: getattr(qos, name).name.lower() for name in policies},
        **{
            name: None if (value := getattr(qos, name)) in (INFINITE, FOLLOWS) else value
            for name in durations
        },
    }
