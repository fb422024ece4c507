"""Versions of one type that are in use at once: what differs, and for whom it breaks something."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeAlias

from idlc.breaking.change import Change, Level
from idlc.breaking.constants import constant_changes
from idlc.breaking.fields import Sides, field_changes
from idlc.breaking.graph import Version, deeds
from idlc.breaking.wire import reads_alike
from idlc.diagnostics import codes
from idlc.model import ir
from idlc.model.link import Model

#: Models by a structure's full name and type hash.
Known: TypeAlias = Mapping[tuple[str, str], Model]
#: Structures of two versions, by name and both hashes.
Seen: TypeAlias = set[tuple[str, str, str]]


def changes(
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
