"""The endpoints of a running graph, and the differing versions of their types.

All values come from the announcements of other programs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import permutations
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, TypeAlias

from idlc.diagnostics import codes
from idlc.diagnostics.report import first_few
from idlc.diagnostics.text import one_line
from idlc.model import derive, ir
from idlc.model.describe import DescriptionDict
from idlc.model.link import Model
from idlc.versions.changes import Change, Level
from idlc.versions.fields import Sides, constant_changes, field_changes, with_wire
from idlc.wire.compatible import reads_alike

Communication: TypeAlias = Literal["topic", "service", "action"]
EndpointRole: TypeAlias = Literal["publisher", "subscription", "server", "client"]

#: The suffixes of structures that services and actions imply.
_PART = re.compile(r"_((SendGoal|GetResult)_)?(Request|Response)$|_FeedbackMessage$")
#: The package whose types every action uses.
_SHARED = "action_msgs/"
#: A sentence with more nodes than these names only the first.
NAMED = 2
#: Versions of one type that are compared, those of the most endpoints.
MOST_VERSIONS = 16


class GraphEndpoint(NamedTuple):
    """One end of a topic, service or action, and the structure that it sends or reads.

    A service has two, of its request and of its response. `node` and `hash` are empty if they
    are unknown.
    """

    node: str
    entity: Communication
    name: str
    role: EndpointRole
    sends: bool
    structure: str
    hash: str = ""

    @property
    def label(self) -> str:
        """The node, for a sentence."""
        return f"`{one_line(self.node)}`" if self.node else "a program without a node"

    @property
    def activity(self) -> str:
        """Its activity in words, such as "publishes on topic `/scan`"."""
        verb = {
            "publisher": "publishes on topic",
            "subscription": "subscribes to topic",
            "server": f"serves {self.entity}",
            "client": f"is a client of {self.entity}",
        }[self.role]
        return f"{verb} `{one_line(self.name)}`"


class LocalType(NamedTuple):
    """The local version of a type: its hash; `in_files` if it is in the user's files."""

    hash: str
    in_files: bool

    @property
    def label(self) -> str:
        """Its origin, for a sentence."""
        return "your files" if self.in_files else "the installed package"


class TypeVersion(NamedTuple):
    """One version of a type with its users; `local` if this machine has the same version."""

    type: str
    hash: str
    endpoints: tuple[GraphEndpoint, ...]
    local: LocalType | None = None

    @property
    def key(self) -> tuple[str, str]:
        """The type and its hash."""
        return self.type, self.hash

    @property
    def label(self) -> str:
        """Its users, for a sentence."""
        nodes = sorted({endpoint.label for endpoint in self.endpoints})
        named = " and ".join(nodes) if len(nodes) <= NAMED else first_few(nodes, 1)
        return named or (self.local.label if self.local else "nobody")

    @property
    def nodes(self) -> tuple[str, ...]:
        """The nodes that have it, sorted."""
        return tuple(sorted({endpoint.node for endpoint in self.endpoints if endpoint.node}))

    @property
    def sends(self) -> bool:
        """True if somebody sends it; programs that are built here may."""
        return not self.endpoints or any(endpoint.sends for endpoint in self.endpoints)

    @property
    def reads(self) -> bool:
        """True if somebody reads it; programs that are built here may."""
        return not self.endpoints or not all(endpoint.sends for endpoint in self.endpoints)


class TypeQuestion(NamedTuple):
    """A request to a node to describe a type that it uses, by name and hash."""

    node: str
    type: str
    hash: str


class Answer(NamedTuple):
    """A node's description of a type, or the problem with it; `sources` are files by type."""

    description: DescriptionDict | None
    problem: str = ""
    sources: Mapping[str, str] = MappingProxyType({})


def answer_of(result: Any, is_offered: bool) -> Answer:
    """Return the answer in a reply of GetTypeDescription; `None` is a missing reply."""
    if result is None and not is_offered:
        return Answer(None, "has no ~/get_type_description")
    if result is None:
        return Answer(None, "does not reply")
    if not result.successful:
        return Answer(None, f"says: {one_line(result.failure_reason)}")
    sources = {
        source.type_name: source.raw_file_contents
        for source in result.type_sources
        if source.encoding in ir.KINDS
    }
    return Answer(_plain(result.type_description), sources=sources)


def _plain(value: Any) -> Any:
    """Return a message as dictionaries by field."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if not hasattr(value, "get_fields_and_field_types"):
        return value
    return {name: _plain(getattr(value, name)) for name in value.get_fields_and_field_types()}


def several_versions(
    endpoints: Iterable[GraphEndpoint], local: Mapping[str, LocalType]
) -> Iterator[tuple[TypeVersion, ...]]:
    """Yield the versions of each type that has more than one.

    The local version comes last, or else the version of the most endpoints.
    """
    types: dict[str, dict[str, list[GraphEndpoint]]] = {}
    for endpoint in endpoints:
        if endpoint.hash:
            types.setdefault(endpoint.structure, {}).setdefault(endpoint.hash, []).append(endpoint)
    for name, hashes in sorted(types.items()):
        mine = local.get(name)
        if mine:
            hashes.setdefault(mine.hash, [])
        versions = [
            TypeVersion(name, hash_, tuple(users), mine if mine and mine.hash == hash_ else None)
            for hash_, users in hashes.items()
        ]
        if len(versions) > 1:
            yield tuple(
                sorted(versions, key=lambda v: (v.local is not None, len(v.endpoints), v.hash))
            )


def interface_of(name: str) -> str:
    """Return the interface whose file implies a structure."""
    return _PART.sub("", name) if "/msg/" not in name else name


def service_of(name: str) -> str | None:
    """Return the service that a structure is a part of, or `None`."""
    service, _, part = name.rpartition("_")
    return service if part in ("Request", "Response") and "/msg/" not in name else None


def event_of(name: str) -> str | None:
    """Return the event message of the service that a structure is a part of, or `None`."""
    service = service_of(name)
    return f"{service}_Event" if service else None


def several_types(endpoints: Iterable[GraphEndpoint]) -> Iterator[Change]:
    """Yield a change for each topic, service and action whose ends differ in the type's name."""
    places: dict[tuple[Communication, str], dict[str, list[GraphEndpoint]]] = {}
    for endpoint in endpoints:
        if endpoint.entity != "action" or not endpoint.structure.startswith(_SHARED):
            types = places.setdefault((endpoint.entity, endpoint.name), {})
            types.setdefault(interface_of(endpoint.structure), []).append(endpoint)
    for (entity, name), types in sorted(places.items()):
        if len(types) > 1:
            yield Change(
                codes.SEVERAL_TYPES,
                name,
                f"{entity} `{one_line(name)}` has endpoints with {len(types)} types",
                frozenset({"hash"}),
                path=name,
                hint="endpoints of different types never connect; rename one of them",
                detail="\n".join(
                    line
                    for type_, users in sorted(types.items())
                    for line in (f"{one_line(type_)}:", *activities(users))
                ),
            )


def activities(endpoints: Iterable[GraphEndpoint]) -> Iterator[str]:
    """Yield a line for each activity of endpoints, with its nodes."""
    nodes: dict[str, list[str]] = {}
    for endpoint in endpoints:
        nodes.setdefault(endpoint.activity, []).append(endpoint.label)
    for activity, actors in sorted(nodes.items()):
        yield f"  {first_few(sorted(set(actors)), 5)} {activity}"


#: Models, and why there is none, by a structure's full name and type hash.
GraphModels: TypeAlias = Mapping[tuple[str, str], Model]
Problems: TypeAlias = Mapping[tuple[str, str], str]
#: Structures of two versions, by name and both hashes.
Reported: TypeAlias = set[tuple[str, str, str]]


def version_changes(
    versions: Sequence[TypeVersion], models: GraphModels, problems: Problems, seen: Reported
) -> Iterator[Change]:
    """Yield a change for a type with several versions, and the differences between them.

    All are compared with the last one. `problems` has the reason why a version has no model.
    Differences of a structure that several types hold are reported once: `seen` grows.
    """
    count, versions = len(versions), versions[-MOST_VERSIONS:]
    *others, last = versions
    sides = [difference for version in others for difference in _all_sides(version, last, models)]
    structures = sorted({str(difference.new.name) for difference, *_ in sides})
    pairs = [(a, b) for a, b in permutations(versions, 2) if a.sends and b.reads]
    lines = [line for version in versions for line in _version(version, models, problems)]
    lines += [_effect(sender, reader, models) for sender, reader in pairs]
    if structures and structures != [last.type]:
        lines.append(f"the differences are in {', '.join(f'`{name}`' for name in structures)}")
    misread = any(_misreads(a, b, models) for a, b in pairs)
    whose = [version.label for version in versions]
    levels: set[Level] = {"hash", "wire"} if misread else {"hash"}
    yield Change(
        codes.SEVERAL_VERSIONS,
        last.type,
        f"`{last.type}` has {count} versions: in {'; in '.join(whose)}",
        frozenset(levels),
        path=last.type,
        hint="build all these programs with the same version of the type, and restart them",
        detail="\n".join(lines),
    )
    for difference, changes, old, new in sides:
        key = (str(difference.new.name), *difference.hashes)
        if key not in seen:
            seen.add(key)
            for change in with_wire(changes, _is_misread(old, new, models)):
                yield change._replace(message=f"{change.message} ({old.label} → {new.label})")


def _effect(sender: TypeVersion, reader: TypeVersion, models: GraphModels) -> str:
    """Return the effect of a sent version on the readers of another one, in words."""
    effect = "misread" if _misreads(sender, reader, models) else "read right"
    if not {sender.key, reader.key} <= models.keys():
        effect = "might be misread"
    return f"{sender.label} → {reader.label}: {effect}, or not delivered"


def _is_misread(old: TypeVersion, new: TypeVersion, models: GraphModels) -> bool:
    """Return whether programs with one of two versions misread the bytes of the other."""
    met = [(a, b) for a, b in permutations((old, new)) if a.sends and b.reads]
    return any(_misreads(a, b, models) for a, b in met or [(old, new)])


def _version(version: TypeVersion, models: GraphModels, problems: Problems) -> Iterator[str]:
    where = f", as in {version.local.label}" if version.local else ""
    yield f"{version.hash}{where}:"
    yield from activities(version.endpoints) if version.endpoints else ["  no node"]
    if version.key not in models:
        yield f"  idlc has only its hash: {problems.get(version.key, 'it asked no node')}"
        return
    messages = models[version.key].messages
    names = sorted(_with_nested(ir.TypeName.parse(version.type), models[version.key]))
    sources = {str(name): messages[name].source for name in names if name in messages}
    if partial := [name for name, own in sources.items() if own and own.is_incomplete]:
        which = first_few((f"`{name}`" for name in partial), NAMED)
        yield f"  idlc compares no constants and default values of {which}: nodes sent only parts"


def _misreads(sender: TypeVersion, reader: TypeVersion, models: GraphModels) -> bool:
    """Return whether `reader` certainly misreads the bytes of `sender`."""
    if not {sender.key, reader.key} <= models.keys():
        return False
    before, after = models[sender.key].messages, models[reader.key].messages
    name = ir.TypeName.parse(sender.type)
    return not reads_alike(before[name], after[name], before, after)


def _all_sides(
    left: TypeVersion, right: TypeVersion, models: GraphModels
) -> Iterator[tuple[Sides, list[Change], TypeVersion, TypeVersion]]:
    """Yield the structures that differ between two versions of a type, nested ones included.

    Each comes with its changes, without those of nested types, which have their own. They are from
    left to right, unless only the right version is sent.
    """
    backwards = not (left.sends and right.reads) and right.sends and left.reads
    old, new = (right, left) if backwards else (left, right)
    if not {old.key, new.key} <= models.keys():
        return
    before, after = models[old.key], models[new.key]
    name = ir.TypeName.parse(old.type)
    for shared in sorted(_with_nested(name, before) & _with_nested(name, after)):
        if before.describer.hash(str(shared)) != after.describer.hash(str(shared)):
            sides = Sides(before.messages[shared], after.messages[shared], before, after)
            every = (*field_changes(sides), *constant_changes(sides))
            changes = [change for change in every if change.code is not codes.USED_TYPE_CHANGED]
            if changes:
                yield sides, changes, old, new


def _with_nested(name: ir.TypeName, model: Model) -> set[ir.TypeName]:
    return derive.closure((name,), lambda held: model.messages[held].references)
