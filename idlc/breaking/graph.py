"""Who sends and reads what in a running graph, and which versions of types that makes.

Everything here is what other programs announce, as values.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Literal, NamedTuple, TypeAlias

from idlc.breaking.change import Change
from idlc.diagnostics import codes
from idlc.diagnostics.report import first_few
from idlc.diagnostics.visible import one_line

Entity: TypeAlias = Literal["topic", "service", "action"]
Role: TypeAlias = Literal["publisher", "subscription", "server", "client"]

#: What services and actions imply, at the end of a structure's name.
_PART = re.compile(r"_((SendGoal|GetResult)_)?(Request|Response)$|_FeedbackMessage$")
#: What every action uses, whatever its type.
_SHARED = "action_msgs/"
#: More nodes than these are named by the first one in a sentence.
NAMED = 2


class Endpoint(NamedTuple):
    """One end of a topic, service or action, and the structure that it sends or reads.

    A service has two, of its request and of its response. `node` and `hash` are empty where they
    are not known.
    """

    node: str
    entity: Entity
    name: str
    role: Role
    sends: bool
    structure: str
    hash: str = ""

    @property
    def who(self) -> str:
        """The node, for a sentence."""
        return f"`{one_line(self.node)}`" if self.node else "a program without a node"

    @property
    def deed(self) -> str:
        """What it does where, in words."""
        verb = {
            "publisher": "publishes on topic",
            "subscription": "subscribes to topic",
            "server": f"serves {self.entity}",
            "client": f"is a client of {self.entity}",
        }[self.role]
        return f"{verb} `{one_line(self.name)}`"


class Here(NamedTuple):
    """A type as this machine has it: its hash, and whether it is in the files that were given."""

    hash: str
    is_given: bool

    @property
    def who(self) -> str:
        """Where it is, for a sentence."""
        return "your files" if self.is_given else "what is installed here"


class Version(NamedTuple):
    """One version of a type, who uses it, and whether it is that of this machine."""

    type: str
    hash: str
    endpoints: tuple[Endpoint, ...]
    here: Here | None = None

    @property
    def who(self) -> str:
        """Who has it, for a sentence."""
        nodes = sorted({one.who for one in self.endpoints})
        named = " and ".join(nodes) if len(nodes) <= NAMED else first_few(nodes, 1)
        return named or (self.here.who if self.here else "nobody")

    @property
    def nodes(self) -> tuple[str, ...]:
        """The nodes that have it, sorted."""
        return tuple(sorted({one.node for one in self.endpoints if one.node}))

    @property
    def sends(self) -> bool:
        """Whether somebody sends it; programs that are built here may."""
        return not self.endpoints or any(one.sends for one in self.endpoints)

    @property
    def reads(self) -> bool:
        """Whether somebody reads it; programs that are built here may."""
        return not self.endpoints or not all(one.sends for one in self.endpoints)


def several_versions(
    endpoints: Iterable[Endpoint], here: Mapping[str, Here]
) -> Iterator[tuple[Version, ...]]:
    """Yield the versions of each type that has more than one.

    That of this machine is the last one, otherwise that which most endpoints have.
    """
    types: dict[str, dict[str, list[Endpoint]]] = {}
    for one in endpoints:
        if one.hash:
            types.setdefault(one.structure, {}).setdefault(one.hash, []).append(one)
    for name, hashes in sorted(types.items()):
        mine = here.get(name)
        if mine:
            hashes.setdefault(mine.hash, [])
        versions = [
            Version(name, hash_, tuple(found), mine if mine and mine.hash == hash_ else None)
            for hash_, found in hashes.items()
        ]
        if len(versions) > 1:
            yield tuple(sorted(versions, key=_rank))


def _rank(version: Version) -> tuple[bool, int, str]:
    return version.here is not None, len(version.endpoints), version.hash


def interface_of(name: str) -> str:
    """Return the interface whose file implies a structure."""
    return _PART.sub("", name) if "/msg/" not in name else name


def event_of(name: str) -> str | None:
    """Return the event message of the service that a structure is a part of, or `None`."""
    service, _, part = name.rpartition("_")
    is_part = part in ("Request", "Response") and "/msg/" not in name
    return f"{service}_Event" if is_part else None


def several_types(endpoints: Iterable[Endpoint]) -> Iterator[Change]:
    """Yield a change for each topic, service and action whose ends differ in the type's name."""
    places: dict[tuple[Entity, str], dict[str, list[Endpoint]]] = {}
    for one in endpoints:
        if one.entity != "action" or not one.structure.startswith(_SHARED):
            types = places.setdefault((one.entity, one.name), {})
            types.setdefault(interface_of(one.structure), []).append(one)
    for (entity, name), types in sorted(places.items()):
        if len(types) > 1:
            shown = one_line(name)
            yield Change(
                codes.SEVERAL_TYPES,
                name,
                f"{entity} `{shown}` has ends of {len(types)} types",
                frozenset({"hash"}),
                path=name,
                hint="endpoints of different types never meet; rename one of them",
                detail="\n".join(_uses(types)),
            )


def _uses(types: Mapping[str, list[Endpoint]]) -> Iterator[str]:
    for name, found in sorted(types.items()):
        yield f"{one_line(name)}:"
        yield from deeds(found)


def deeds(endpoints: Iterable[Endpoint]) -> Iterator[str]:
    """Yield a line for each thing that endpoints do, with the nodes that do it."""
    nodes: dict[str, list[str]] = {}
    for one in endpoints:
        nodes.setdefault(one.deed, []).append(one.who)
    for deed, who in sorted(nodes.items()):
        yield f"  {first_few(sorted(set(who)), 5)} {deed}"
