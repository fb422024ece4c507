"""The interfaces of one run: each is read and lowered once, whichever packages refer to it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, Severity
from idlc.model import derive, ir
from idlc.model.circles import circles
from idlc.model.lowering.file import lower
from idlc.syntax.parse import parse_any

if TYPE_CHECKING:
    from collections.abc import Iterable

    from idlc.diagnostics.source import Source, Span
    from idlc.model.describe import Describer
    from idlc.model.link import Library


class Entry(msgspec.Struct):
    """An interface, the fields of it that hold messages of other files, and its errors.

    `linked` is whether its references were looked up.
    """

    interface: ir.Interface
    references: tuple[tuple[ir.Field, ir.TypeName], ...]
    errors: list[Diagnostic]
    linked: bool = False


class Lowered(msgspec.Struct, frozen=True):
    """What a text means, what is wrong in it, and the fields that hold messages of other files."""

    interface: ir.Interface
    problems: Report
    references: tuple[tuple[ir.Field, ir.TypeName], ...]


#: Interfaces with what they refer to; `None` for what there is not.
Graph: TypeAlias = dict[ir.TypeName, tuple[ir.Interface | None, tuple[ir.TypeName, ...]]]
#: What was lowered before, by name; it holds for the same `Source` and distribution.
Memory: TypeAlias = dict[ir.TypeName, Lowered]


class Pool:
    """Interfaces by name: those that were added, and those that a library has.

    Pools of one library may share a `memory`, so that only texts that changed are lowered again.
    """

    def __init__(self, library: Library, memory: Memory | None = None) -> None:
        self.library = library
        self._memory = {} if memory is None else memory
        self._entries: dict[ir.TypeName, Entry | None] = {}
        #: The interfaces that were searched for circles.
        self.searched: set[ir.TypeName] = set()

    def add(self, interface: ir.Interface, problems: Iterable[Diagnostic] = ()) -> Entry:
        """Add an interface with what is wrong in its file, unless it is there already."""
        known = self._entries.get(interface.name)
        if known is None or known.interface is not interface:
            errors = [one for one in problems if one.severity is Severity.ERROR]
            known = Entry(interface, tuple(_references(interface)), errors)
            self._entries[interface.name] = known
        return known

    def remembered(self, name: ir.TypeName, source: Source) -> Lowered | None:
        """Return what a text was lowered to before, after adding it; `None` if it is new."""
        known = self._memory.get(name)
        if known is None or known.interface.source is not source:
            return None
        self._add(known)
        return known

    def learn(self, interface: ir.Interface, problems: Report) -> Lowered:
        """Add and remember what a text was lowered to."""
        known = Lowered(interface, problems, tuple(_references(interface)))
        self._memory[interface.name] = known
        self._add(known)
        return known

    def _add(self, one: Lowered) -> None:
        errors = [found for found in one.problems if found.severity is Severity.ERROR]
        self._entries[one.interface.name] = Entry(one.interface, one.references, errors)

    def get(self, name: ir.TypeName) -> Entry | None:
        """Return an interface by name; `None` if there is none."""
        if name not in self._entries:
            source = self.library.source(name)
            self._entries[name] = None
            if source is not None and not self.remembered(name, source):
                found = Report()
                self.learn(lower(parse_any(source), name, found, self.library.distro), found)
        return self._entries[name]

    def __getitem__(self, name: ir.TypeName) -> Entry:
        """Return an interface that was found before."""
        entry = self._entries[name]
        if entry is None:
            raise KeyError(name)
        return entry

    def references(self, name: ir.TypeName) -> Iterator[tuple[ir.Field, ir.TypeName]]:
        """Yield the references of an interface to others that were found."""
        entry = self._entries.get(name)
        for field, target in entry.references if entry else ():
            if self._entries.get(target):
                yield field, target

    def reach(self, name: ir.TypeName) -> tuple[ir.Interface | None, ...]:
        """Return an interface with all that it refers to, `None` for what there is not."""
        return tuple(one for one, _ in self.graph((name,)).values())

    def graph(self, names: Iterable[ir.TypeName]) -> Graph:
        """Return interfaces and all that they refer to, `None` for what there is not."""
        found: Graph = {}
        waiting = list(names)
        while waiting:
            name = waiting.pop()
            if name in found:
                continue
            entry = self._entries.get(name)
            targets = tuple(target for _, target in entry.references) if entry else ()
            found[name] = (entry.interface if entry else None, targets)
            waiting += targets
        return found

    def is_sound(self, name: ir.TypeName) -> bool:
        """Return whether an interface and all that it refers to exist and have no errors."""
        entries = [self._entries.get(one.name) if one else None for one in self.reach(name)]
        return all(entry is not None and not entry.errors for entry in entries)

    def crossings(self) -> Iterator[tuple[str, str, Span]]:
        """Yield which package refers to which other, and where; not what ROS 2 adds by itself."""
        for entry in filter(None, self._entries.values()):
            own = entry.interface.name.package
            for field, target in entry.references:
                if target.package != own and field.type_span is not None:
                    yield own, target.package, field.type_span

    @cached_property
    def describer(self) -> Describer:
        """Type descriptions and hashes, each made once."""
        from idlc.model.describe import Describer

        return Describer({})


def _references(interface: ir.Interface) -> Iterator[tuple[ir.Field, ir.TypeName]]:
    """Yield the fields that hold messages of other files, derived structures' included."""
    for message in derive.messages(interface):
        yield from (one for one in message.holders if one[1].kind == "msg")


def check_packages(pool: Pool, report: Report) -> None:
    """Report each circle of packages, which no build tool could put into an order."""
    edges: dict[str, dict[str, Span]] = {}
    for package, target, span in pool.crossings():
        edges.setdefault(package, {}).setdefault(target, span)
    found = circles(
        sorted(edges), lambda one: ((at, to) for to, at in edges.get(one, {}).items()), set()
    )
    for packages, span in found:
        names = " → ".join((*packages, packages[0]))
        report.add(
            codes.PACKAGE_CIRCLE.at(
                span,
                f"packages that need each other cannot be built: {names}",
                hint="move the messages that both use to a package of their own",
            )
        )
