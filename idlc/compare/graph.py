"""Who sends and reads what in a running graph, and which versions of types that makes.

Everything here is what other programs announce, as values.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Literal, NamedTuple, TypeAlias

from idlc.compare.changes import Change, Level
from idlc.compare.fields import Sides, constant_changes, field_changes
from idlc.diagnostics import codes
from idlc.diagnostics.report import first_few
from idlc.diagnostics.text import one_line
from idlc.model import ir
from idlc.model.link import Model
from idlc.wire.compatible import reads_alike

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


#: Models by a structure's full name and type hash.
Known: TypeAlias = Mapping[tuple[str, str], Model]
#: Structures of two versions, by name and both hashes.
Seen: TypeAlias = set[tuple[str, str, str]]


def version_changes(
    versions: Sequence[Version], known: Known, problems: Mapping[tuple[str, str], str], seen: Seen
) -> Iterator[Change]:
    """Yield that there are several versions of a type, and what differs between them.

    All are compared with the last one. `problems` says why a version is not among the `known`
    ones. Of what several types hold, the differences are told once: `seen` grows.
    """
    *others, last = versions
    sides = [found for one in others for found in _all_sides(one, last, known)]
    structures = sorted({str(one.new.name) for one, *_ in sides})
    pairs = [(a, b) for a in versions for b in versions if a is not b and a.sends and b.reads]
    lines = [line for version in versions for line in _version(version, known, problems)]
    lines += _effects(pairs, known)
    if structures and structures != [last.type]:
        lines.append(f"what differs is in {', '.join(f'`{one}`' for one in structures)}")
    misread = any(_misreads(a, b, known) for a, b in pairs)
    whose = [one.who for one in versions]
    levels: set[Level] = {"hash", "wire"} if misread else {"hash"}
    yield Change(
        codes.SEVERAL_VERSIONS,
        last.type,
        f"`{last.type}` has {len(versions)} versions: of {', of '.join(whose)}",
        frozenset(levels),
        path=last.type,
        hint="build everything that uses it from one version, and start it again",
        detail="\n".join(lines),
    )
    for found in sides:
        yield from _told_once(*found, known, seen)


def _version(
    version: Version, known: Known, problems: Mapping[tuple[str, str], str]
) -> Iterator[str]:
    where = f", that of {version.here.who}" if version.here else ""
    yield f"{version.hash}{where}:"
    yield from deeds(version.endpoints) if version.endpoints else ["  no node"]
    key = (version.type, version.hash)
    if key not in known:
        yield f"  only its hash is known: {problems.get(key, 'nobody was asked')}"


def _effects(pairs: Iterable[tuple[Version, Version]], known: Known) -> Iterator[str]:
    """Yield what becomes of each version that is sent, at whoever has another one."""
    for sender, reader in pairs:
        if any((one.type, one.hash) not in known for one in (sender, reader)):
            effect = "may be misread, or not delivered"
        elif _misreads(sender, reader, known):
            effect = "misread, or not delivered"
        else:
            effect = "read right, or not delivered"
        yield f"{sender.who} → {reader.who}: {effect}"


def _misreads(sender: Version, reader: Version, known: Known) -> bool:
    """Return whether bytes are known to be read wrongly."""
    keys = [(one.type, one.hash) for one in (sender, reader)]
    if any(key not in known for key in keys):
        return False
    before, after = (known[key].messages for key in keys)
    name = ir.TypeName.parse(sender.type)
    return not reads_alike(before[name], after[name], before, after)


def _all_sides(
    one: Version, other: Version, known: Known
) -> Iterator[tuple[Sides, Version, Version]]:
    """Yield what differs between two versions of a type, itself and what it holds.

    From the one to the other, unless only the other is sent.
    """
    backwards = not (one.sends and other.reads) and other.sends and one.reads
    old, new = (other, one) if backwards else (one, other)
    keys = [(old.type, old.hash), (new.type, new.hash)]
    if any(key not in known for key in keys):
        return
    before, after = (known[key] for key in keys)
    name = ir.TypeName.parse(old.type)
    for each in sorted(_held(name, before) & _held(name, after)):
        if before.describer.hash(str(each)) != after.describer.hash(str(each)):
            sides = Sides(before.messages[each], after.messages[each], before, after)
            if any(_changes(sides)):
                yield sides, old, new


def _told_once(
    sides: Sides, old: Version, new: Version, known: Known, seen: Seen
) -> Iterator[Change]:
    name = str(sides.new.name)
    key = (name, sides.before.describer.hash(name), sides.after.describer.hash(name))
    if key not in seen:
        seen.add(key)
        met = [(a, b) for a, b in ((old, new), (new, old)) if a.sends and b.reads]
        misread = any(_misreads(a, b, known) for a, b in met or [(old, new)])
        for change in _with_wire(list(_changes(sides)), misread):
            yield change._replace(message=f"{change.message} ({old.who} → {new.who})")


def _changes(sides: Sides) -> Iterator[Change]:
    """Yield what changed; not that a type changed which it holds, as that is told of that type."""
    for change in (*field_changes(sides), *constant_changes(sides)):
        if change.code is not codes.USED_TYPE_CHANGED:
            yield change


def _with_wire(found: Sequence[Change], misread: bool) -> Iterator[Change]:
    """Yield changes which say that bytes are misread if and only if somebody misreads them."""
    said = any("wire" in change.levels for change in found)
    for change in found:
        if not misread:
            yield change.without("wire")
        elif not said and "hash" in change.levels:
            yield change._replace(levels=change.levels | {"wire"})
        else:
            yield change


def _held(name: ir.TypeName, model: Model) -> set[ir.TypeName]:
    found: set[ir.TypeName] = set()
    waiting = [name]
    while waiting:
        one = waiting.pop()
        if one not in found:
            found.add(one)
            waiting += model.messages[one].references
    return found
