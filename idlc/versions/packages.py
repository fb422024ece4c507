"""Two versions of a package → all changes between them."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
from msgspec import Meta

from idlc.diagnostics import codes
from idlc.diagnostics.codes import CODES
from idlc.diagnostics.report import Report
from idlc.diagnostics.text import edit_distance
from idlc.model import derive, ir
from idlc.model.ir import meaning
from idlc.model.link import Model
from idlc.project import settings
from idlc.versions.changes import LEVELS, Change, Level
from idlc.versions.fields import Sides, added, constant_changes, field_changes

#: A renamed interface is searched among this many interfaces of equal content.
CANDIDATES = 50


class Skipped(NamedTuple):
    """Interfaces, or folders of interfaces, that could not be compared, and the reason."""

    names: tuple[str, ...]
    reason: str
    hint: str | None = None


class Comparison(NamedTuple):
    """The changes that break something, and the additions, which break nothing.

    `differs`: anything at all is different, comments included. `compared` is the number of
    interfaces of the old version that were judged, `skipped` are those that could not be.
    """

    changes: tuple[Change, ...]
    additions: tuple[str, ...] = ()
    differs: bool = False
    compared: int = 0
    skipped: tuple[Skipped, ...] = ()

    def placed(self, place: Callable[[str], str]) -> Comparison:
        """Return it with removed elements in the files that `place` makes of their paths."""
        changes = (
            change if change.span else change._replace(place=place(change.path))
            for change in self.changes
        )
        return self._replace(changes=tuple(changes))


def combine(comparisons: Iterable[Comparison]) -> Comparison:
    """Return the comparisons of several packages as one."""
    parts = list(comparisons)
    return Comparison(
        tuple(change for comparison in parts for change in comparison.changes),
        tuple(name for comparison in parts for name in comparison.additions),
        any(comparison.differs for comparison in parts),
        sum(comparison.compared for comparison in parts),
    )


def compare(before: Model, after: Model) -> Comparison:
    """Return the changes of a package's own interfaces; both models must be free of errors."""
    old = {interface.name: interface for interface in before.own}
    new = {interface.name: interface for interface in after.own}
    removed = [interface for name, interface in old.items() if name not in new]
    appeared = [interface for name, interface in new.items() if name not in old]
    renamed = dict(_renamed(removed, appeared))
    changes = [_removed(interface) for interface in removed if interface.name not in renamed]
    changes += [renamed_interface(old[name], interface) for name, interface in renamed.items()]
    renamed_to = {interface.name for interface in renamed.values()}
    additions = [_added(interface) for interface in appeared if interface.name not in renamed_to]
    differs = bool(removed or appeared)
    for name in sorted(old.keys() & new.keys()):
        differs = differs or _differ(old[name], new[name])
        for section, counterpart in zip(
            derive.sections(old[name]), derive.sections(new[name]), strict=True
        ):
            sides = Sides(section, counterpart, before, after)
            changes += [*field_changes(sides), *constant_changes(sides)]
            additions += added(sides)
    return Comparison(tuple(changes), tuple(additions), differs or bool(changes), len(old))


def _differ(old: ir.Interface, new: ir.Interface) -> bool:
    """Return whether two versions of an interface differ, ignoring line ends."""
    before, after = (each.source and each.source.text.splitlines() for each in (old, new))
    return before != after or meaning(old) != meaning(new)


def compare_hashes(recorded: Mapping[str, str], after: Model) -> Comparison:
    """Return the changes since type hashes were recorded, the only facts of the old version."""
    changes = []
    compared = 0
    paths = {str(own.name): ir.path_of(own) for own in after.own}
    for name in sorted(recorded):
        kind = name.split("/")[1]
        shorter = (name[:at] for at, character in enumerate(name) if character == "_")
        if kind != "msg" and any(own in recorded for own in shorter):
            continue  # follows from the interface that it is derived from
        compared += 1
        if name not in paths:
            levels = frozenset[Level](LEVELS[:3])
            message = f"{_noun(kind)} `{name}` was removed"
            changes.append(Change(codes.INTERFACE_REMOVED, name, message, levels, path=name))
        elif recorded[name] != after.describer.hash(name):
            message = f"the type hash of `{name}` changed"
            hint = "to see the change, compare with a folder or a git revision"
            levels = frozenset(("hash",))
            change = Change(codes.HASH_CHANGED, name, message, levels, path=paths[name], hint=hint)
            changes.append(change)
    come = tuple(_added(own) for own in after.own if str(own.name) not in recorded)
    return Comparison(tuple(changes), come, bool(changes or come), compared)


def _noun(kind: str) -> str:
    return {"msg": "message", "srv": "service"}.get(kind, kind)


def _removed(interface: ir.Interface) -> Change:
    return Change(
        codes.INTERFACE_REMOVED,
        str(interface.name),
        f"{_noun(interface.name.kind)} `{interface.name}` was removed",
        frozenset(LEVELS[:3]),
        path=ir.path_of(interface),
        place=interface.source.file if interface.source else "",
    )


def _added(interface: ir.Interface) -> str:
    return f"{_noun(interface.name.kind)} `{interface.name}`"


def renamed_interface(old: ir.Interface, new: ir.Interface) -> Change:
    """Return the change of an interface's name."""
    return Change(
        codes.INTERFACE_RENAMED,
        str(old.name),
        f"{_noun(old.name.kind)} `{old.name}` was renamed to `{new.name}`",
        frozenset({"hash", "source"}),
        path=ir.path_of(new),
    )


def _renamed(
    removed: list[ir.Interface], appeared: list[ir.Interface]
) -> Iterator[tuple[ir.TypeName, ir.Interface]]:
    """Yield each removed interface with a new one of the same content."""
    left: dict[Hashable, list[ir.Interface]] = {}
    for new in appeared:
        left.setdefault(_shape(new), []).append(new)
    for old in removed:
        shape = _shape(old)
        # the first candidates are as good as any others
        alike = left.get(shape, [])[:CANDIDATES] if shape[1] else []
        if alike:
            best = min(alike, key=lambda new: edit_distance(old.name.name, new.name.name))
            left[shape].remove(best)
            yield old.name, best


def _shape(interface: ir.Interface) -> tuple[ir.Kind, tuple[tuple[str, ir.FieldType], ...]]:
    return interface.name.kind, tuple(
        (f"{number}.{field.name}", field.type)
        for number, section in enumerate(derive.sections(interface))
        for field in section.fields
    )


def part_to_raise(comparison: Comparison) -> Literal["major", "minor", "patch"] | None:
    """Return the part to raise by semantic versioning, `None` without a difference."""
    levels = {level for change in comparison.changes for level in change.levels}
    if levels & {"wire", "hash", "source"}:
        return "major"
    if levels or comparison.additions:
        return "minor"
    return "patch" if comparison.differs else None


def raised(version: str, part: Literal["major", "minor", "patch"]) -> str | None:
    """Return a version with a part raised, `None` for one that is not three numbers.

    Before 1.0.0 there is no promise to keep, so a breaking change raises the minor part.
    """
    match = re.fullmatch(r"(\d+)\.(\d+)\.(\d+)", version.strip())
    if match is None:
        return None
    major, minor, patch = map(int, match.groups())
    if part == "patch":
        return f"{major}.{minor}.{patch + 1}"
    if part == "minor" or not major:
        return f"{major}.{minor + 1}.0"
    return f"{major + 1}.0.0"


class BreakingSettings(msgspec.Struct, frozen=True):
    """`[tool.idlc.breaking]`."""

    allow: settings.TablesValue = ()
    against: settings.TextValue = ""
    levels: Annotated[tuple[Level, ...], Meta(title=f"a list of {', '.join(LEVELS)}")] = ()


def _words(description: str) -> Meta:
    return Meta(pattern=r"\S", title="a non-empty string", description=description)


class Allowance(msgspec.Struct, frozen=True):
    """An entry of `[[tool.idlc.breaking.allow]]`.

    `at` is a type or an element of one (`pkg/msg/Name.field`), `*` and `?` stand for any text;
    a type covers its elements. `until` is the last day on which it holds. Without a `code` it
    holds for all.
    """

    at: Annotated[str, _words("the type or field of the change")]
    reason: Annotated[str, _words("the reason for the change")]
    until: Annotated[
        datetime.date,
        Meta(title="a date such as 2030-12-31", description="its last day, such as 2030-12-31"),
    ]
    code: settings.TextValue = ""

    def covers(self, change: Change) -> bool:
        """Return whether the entry allows a change, or the one that it follows from."""
        if self.code not in ("", change.code.id):
            return False
        names = [change.subject, change.subject.partition(".")[0], change.cause]
        return any(fnmatchcase(name, self.at) for name in names if name)


def against(config: settings.Config, report: Report) -> str | None:
    """Return the setting `against`: the default of `idlc breaking --against`."""
    table, place = settings.command_table(config, "breaking", BreakingSettings, report)
    if place is not None:
        place.no_url("against", table.against, report)
    return table.against or None


def levels(config: settings.Config, report: Report) -> tuple[Level, ...]:
    """Return the setting `levels`: the levels of changes that `idlc breaking` reports."""
    return settings.command_table(config, "breaking", BreakingSettings, report)[0].levels


def allowances(config: settings.Config, report: Report) -> tuple[Allowance, ...]:
    """Return the entries of `[[tool.idlc.breaking.allow]]`."""
    entries = settings.command_table(config, "breaking", BreakingSettings, report)[0].allow
    parsed = [_allowance(config, at, entry, report) for at, entry in enumerate(entries)]
    return tuple(entry for entry in parsed if entry is not None)


def _allowance(
    config: settings.Config, number: int, entry: Mapping[str, Any], report: Report
) -> Allowance | None:
    assert config.source is not None
    at, until = entry.get("at"), entry.get("until")
    which = f"the entry for `{at}`" if isinstance(at, str) else "an entry"
    name = "tool.idlc.breaking.allow"
    place = settings.TableLocation(config.source, name, f"{which} in [[{name}]]", number)
    day = {"until": until.date()} if isinstance(until, datetime.datetime) else {}
    allowance = settings.read_table({**entry, **day}, Allowance, place, report)
    if allowance and allowance.code not in ("", *(code for code in CODES if code[:4] == "IDL5")):
        message = f"{place.shown} contains `{allowance.code}`, which is not a breaking change"
        place.wrong("code", message, report)
        return None
    return allowance
