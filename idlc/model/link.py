"""Linking: interfaces of several packages become one immutable index by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

from idlc.model import derive, ir
from idlc.model.lower import lower
from idlc.model.types import STRINGS
from idlc.syntax.parse import parse
from idlc.text import codes
from idlc.text.diagnostics import Diagnostic, Report, Severity
from idlc.text.source import Source, Span
from idlc.text.suggest import did_you_mean

if TYPE_CHECKING:
    from idlc.model.describe import Describer

#: Problems after which nearest names are no longer looked for; people see fewer than these.
SUGGESTIONS = 200
#: Messages of a circle that are named.
NAMED = 10
_PRIMITIVES = (*ir.PRIMITIVES, *STRINGS)


class Library(Protocol):
    """Where other packages' interfaces come from, in order of precedence."""

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface, or `None` if there is none of that name."""

    def names(self, package: str) -> Iterable[str]:
        """Return the names of a package's messages; empty for an unknown package."""

    def packages(self) -> Iterable[str]:
        """Return the names of all packages, for suggestions."""


class Model:
    """A package's interfaces and everything that they refer to.

    `own` is sorted by name; `interfaces` also holds each interface that is reached from them,
    the implicit ones of services and actions included.
    """

    def __init__(
        self,
        package: str,
        own: tuple[ir.Interface, ...],
        interfaces: Mapping[ir.TypeName, ir.Interface],
    ) -> None:
        self.package = package
        self.own = own
        self.interfaces = interfaces

    @cached_property
    def messages(self) -> Mapping[ir.TypeName, ir.Message]:
        """Every structure by name, sections and derived ones included."""
        return {
            message.name: message
            for interface in self.interfaces.values()
            for message in derive.messages(interface)
        }

    @cached_property
    def describer(self) -> Describer:
        """Type descriptions and hashes of everything in the model."""
        from idlc.model.describe import Describer

        return Describer(self.interfaces)


def link(package: str, own: Iterable[ir.Interface], library: Library, report: Report) -> Model:
    """Return the model of a package's interfaces and of all that they refer to.

    Reports unknown and recursive types. Messages of the package itself that are referred to but
    not among `own` are taken from the library and become part of `own`. A model with errors
    has gaps: only after a report without errors is it safe to describe or emit.
    """
    interfaces = {interface.name: interface for interface in own}
    _load_references(interfaces, library, report)
    _check_recursion(interfaces, report)
    mine = sorted(name for name in interfaces if name.package == package)
    return Model(package, tuple(interfaces[name] for name in mine), interfaces)


def _references(interface: ir.Interface) -> Iterator[tuple[ir.Field, ir.TypeName]]:
    """Yield the fields that hold messages of other files, derived structures' included."""
    for message in derive.messages(interface):
        for field in message.fields:
            element = ir.element_of(field.type)
            if isinstance(element, ir.Ref) and element.target.kind == "msg":
                yield field, element.target


def _load_references(
    interfaces: MutableMapping[ir.TypeName, ir.Interface], library: Library, report: Report
) -> None:
    """Add every interface that is reached and not there yet; report those that do not exist."""
    unknown = _Unknown(interfaces, library)
    queue = list(interfaces.values())
    while queue:
        for field, target in _references(queue.pop()):
            if target in interfaces:
                continue
            source = library.source(target)
            if source is None:
                if field.type_span is not None:
                    report.add(unknown.problem(target, field.type_span))
                continue
            found = Report()
            interface = lower(parse(source), target, found)
            report.extend(d for d in found if d.severity is Severity.ERROR)
            interfaces[target] = interface
            queue.append(interface)


class _Unknown:
    """Says what is wrong with references to what does not exist.

    The nearest name is looked for among all that there are, so only for the first problems.
    """

    def __init__(self, interfaces: Mapping[ir.TypeName, ir.Interface], library: Library) -> None:
        self._interfaces = interfaces
        self._library = library
        self._hints = SUGGESTIONS
        self._messages: dict[str, set[str]] = {}
        for name in interfaces:
            mine = self._messages.setdefault(name.package, set())
            mine |= {name.name} if name.kind == "msg" else set()

    def problem(self, target: ir.TypeName, span: Span) -> Diagnostic:
        """Return the problem with a reference to `target`."""
        self._hints -= 1
        written = span.text
        known = self._messages.get(target.package)
        if known is None and "/" in written and not self._library.names(target.package):
            hint = self._near(target.package, self._library.packages)
            return codes.UNKNOWN_PACKAGE.at(
                span.at(0, len(target.package)),
                f"unknown package `{target.package}`",
                hint=hint or f"add `-I DIR` for the folder that holds `{target.package}`",
            )
        others: dict[ir.Kind, str] = {"srv": "a service", "action": "an action"}
        what = next((others[kind] for kind in others if self._is(target, kind)), None)
        if what:
            hint = f"`{target.name}` is {what}; only messages can be the type of a field"
        else:
            hint = None if "/" in written else self._elsewhere(target.name)
            hint = hint or self._near(target.name, lambda: self._known(target.package))
            hint = hint or f"there is no `{target.name}.msg` in package `{target.package}`"
        at = span.at(written.rfind("/") + 1, len(written))
        return codes.UNKNOWN_TYPE.at(at, f"unknown type `{written}`", hint=hint)

    def _is(self, target: ir.TypeName, kind: ir.Kind) -> bool:
        return target._replace(kind=kind) in self._interfaces

    def _known(self, package: str) -> Iterable[str]:
        names = self._library.names(package)
        return {*self._messages.get(package, ()), *names, *_PRIMITIVES}

    def _near(self, name: str, known: Callable[[], Iterable[str]]) -> str | None:
        return did_you_mean(name, known()) if self._hints >= 0 else None

    def _elsewhere(self, name: str) -> str | None:
        """Return a hint at another package that has a message of exactly this name."""
        if self._hints < 0:
            return None
        library = self._library
        for package in sorted(library.packages(), key=lambda one: (one != "std_msgs", one)):
            if name in library.names(package):
                return f"did you mean `{package}/{name}`?"
        return None


def _check_recursion(interfaces: Mapping[ir.TypeName, ir.Interface], report: Report) -> None:
    """Report each field that closes a circle; walks with its own stack, so depth is no limit."""
    edges = {name: tuple(_references(interface)) for name, interface in interfaces.items()}
    done: set[ir.TypeName] = set()
    for root in interfaces:
        path: list[ir.TypeName] = []
        rest: list[Iterator[tuple[ir.Field, ir.TypeName]]] = []
        places: dict[ir.TypeName, int] = {}
        enter: ir.TypeName | None = None if root in done else root
        while enter or path:
            if enter:
                places[enter] = len(path)
                path.append(enter)
                rest.append(iter(edges[enter]))
            step = next(rest[-1], None)
            enter = None
            if step is None:
                done.add(path[-1])
                del rest[-1], places[path.pop()]
            elif step[1] in places:
                _report_circle(path, places[step[1]], *step, report)
            elif step[1] in edges and step[1] not in done:
                enter = step[1]


def _report_circle(
    path: list[ir.TypeName], start: int, field: ir.Field, target: ir.TypeName, report: Report
) -> None:
    """Report a circle of the messages on `path` from `start` on, and `target` again."""
    if field.type_span is None:
        return
    left_out = len(path) - start - NAMED
    shown = [name.name for name in path[start : start + NAMED]]
    shown += [f"{left_out} more"] if left_out > 0 else []
    names = " → ".join((*shown, target.name))
    report.add(
        codes.RECURSIVE_TYPE.at(
            field.type_span,
            f"`{target.name}` contains itself: {names}",
            hint="ROS 2 has no recursive types; refer to the other message by an id",
        )
    )
