"""The graph of a robot as tables: who uses which name with which type, and what does not fit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice, product
from typing import NamedTuple

from idlc.diagnostics.text import near_pairs
from idlc.recordings.definitions import interface_of, type_name
from idlc.recordings.types import LocalTypes
from idlc.robot.keys import Entity, EntityKind
from idlc.robot.live.connect import place_of
from idlc.robot.live.graph import Communication as Noun
from idlc.robot.qos import QoSProfile, incompatible_policies

#: What every node has; the table leaves these services out.
_OF_EVERY_NODE = ("rcl_interfaces/srv/", "type_description_interfaces/srv/")
#: Names of one type that are compared with each other.
MOST_NAMES = 500
_PAIRS = {EntityKind.PUBLISHER: EntityKind.SUBSCRIPTION, EntityKind.CLIENT: EntityKind.SERVICE}
#: A topic with more pairs than these is compared in part.
MOST_PAIRS = 100_000


class OverviewRow(NamedTuple):
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


def connections(entities: Iterable[Entity], local: LocalTypes) -> list[OverviewRow]:
    """Return what endpoints have in common, sorted; an action is that of its feedback."""
    places: dict[tuple[Noun, str, str, str], tuple[list[Entity], list[Entity]]] = {}
    for end in entities:
        noun, name, part = place_of(end)
        if end.kind is not EntityKind.NODE and part in ("", "feedback"):
            sides = places.setdefault((noun, name, end.type, end.hash), ([], []))
            # a client of an action receives the feedback
            is_receiver = (end.kind in (EntityKind.PUBLISHER, EntityKind.CLIENT)) == (
                noun == "action"
            )
            sides[is_receiver].append(end)
    found = []
    for (noun, name, type_, hash_), sides in sorted(places.items(), key=lambda item: item[0]):
        parsed = type_name(type_)
        mine = local.hash(parsed, interface_of(parsed)) if parsed and hash_ else None
        here = "unknown"
        if mine is not None:
            here = "same" if mine == hash_ else "differs"
        shown = str(interface_of(parsed)) if parsed and noun == "action" else type_
        senders, receivers = (tuple(sorted({end.node_name for end in ends})) for ends in sides)
        qos, requested = (tuple(dict.fromkeys(end.qos for end in ends)) for ends in sides)
        found.append(
            OverviewRow(noun, name, shown, hash_, senders, receivers, qos, requested, here)
        )
    return found


def mismatches(entities: Iterable[Entity]) -> Iterator[tuple[str, str, str, tuple[str, ...]]]:
    """Yield name, sender, receiver and differences of endpoints of one name that do not fit.

    The differences are `type`, or `hash`, or names of QoS policies. Endpoints without a hash fit
    every version.
    """
    places: dict[tuple[EntityKind, str], list[Entity]] = {}
    for entity in entities:
        places.setdefault((entity.kind, entity.name), []).append(entity)
    for (kind, name), senders in sorted(places.items()):
        receivers = places.get((_PAIRS[kind], name), []) if kind in _PAIRS else []
        for sender, receiver in islice(product(senders, receivers), MOST_PAIRS):
            if differences := _differences(sender, receiver):
                yield name, sender.node_name, receiver.node_name, differences


def _differences(sender: Entity, receiver: Entity) -> tuple[str, ...]:
    if sender.type != receiver.type:
        return ("type",)
    if sender.hash and receiver.hash and sender.hash != receiver.hash:
        return ("hash",)
    return incompatible_policies(sender.qos, receiver.qos)


def similar_names(found: Iterable[OverviewRow]) -> Iterator[tuple[str, str]]:
    """Yield a name that nobody receives, and one that nobody sends, which differ in one letter."""
    kinds: dict[tuple[str, str], tuple[set[str], set[str]]] = {}
    for each in found:
        sides = kinds.setdefault((each.noun, each.type_name), (set(), set()))
        for side, nodes in zip(sides, (each.senders, each.receivers), strict=True):
            if nodes:
                side.add(each.name)
    for sent, received in kinds.values():
        pair = (sorted(names)[:MOST_NAMES] for names in (sent - received, received - sent))
        yield from near_pairs(*pair)
