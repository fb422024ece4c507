"""Linking: interfaces of several packages become one immutable index by name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from functools import cached_property
from typing import Protocol

from idlc.model import derive, ir
from idlc.model.describe import Describer
from idlc.model.lower import lower
from idlc.model.types import STRINGS
from idlc.syntax.parse import parse
from idlc.text import codes
from idlc.text.diagnostics import Diagnostic, Report, Severity
from idlc.text.source import Source, Span
from idlc.text.suggest import did_you_mean

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
    queue = list(interfaces.values())
    while queue:
        for field, target in _references(queue.pop()):
            if target in interfaces:
                continue
            source = library.source(target)
            if source is None:
                if field.type_span is not None:
                    report.add(_unknown(target, field.type_span, interfaces, library))
                continue
            found = Report()
            interface = lower(parse(source), target, found)
            report.extend(d for d in found if d.severity is Severity.ERROR)
            interfaces[target] = interface
            queue.append(interface)


def _unknown(
    target: ir.TypeName,
    span: Span,
    interfaces: Mapping[ir.TypeName, ir.Interface],
    library: Library,
) -> Diagnostic:
    mine = {name for name in interfaces if name.package == target.package}
    known = {name.name for name in mine if name.kind == "msg"} | set(library.names(target.package))
    written = span.text
    if "/" in written and not known and not mine:
        hint = did_you_mean(target.package, library.packages())
        return codes.UNKNOWN_PACKAGE.at(
            span.at(0, len(target.package)),
            f"unknown package `{target.package}`",
            hint=hint or f"add `-I DIR` for the folder that holds `{target.package}`",
        )
    kinds = {name.kind for name in mine if name.name == target.name}
    if kinds:
        what = "a service" if "srv" in kinds else "an action"
        hint = f"`{target.name}` is {what}; only messages can be the type of a field"
    else:
        hint = _elsewhere(target.name, library) if "/" not in written else None
        hint = hint or did_you_mean(target.name, (*known, *_PRIMITIVES))
        hint = hint or f"there is no `{target.name}.msg` in package `{target.package}`"
    at = span.at(written.rfind("/") + 1, len(written))
    return codes.UNKNOWN_TYPE.at(at, f"unknown type `{written}`", hint=hint)


def _elsewhere(name: str, library: Library) -> str | None:
    """Return a hint at another package that has a message of exactly this name."""
    for package in sorted(library.packages(), key=lambda package: (package != "std_msgs", package)):
        if name in library.names(package):
            return f"did you mean `{package}/{name}`?"
    return None


def _check_recursion(interfaces: Mapping[ir.TypeName, ir.Interface], report: Report) -> None:
    """Report each field that closes a circle; walks with its own stack, so depth is no limit."""
    edges = {name: tuple(_references(interface)) for name, interface in interfaces.items()}
    done: set[ir.TypeName] = set()
    for root in interfaces:
        path: dict[ir.TypeName, Iterator[tuple[ir.Field, ir.TypeName]]] = {}
        if root not in done:
            path[root] = iter(edges[root])
        while path:
            name, rest = next(reversed(path.items()))
            step = next(rest, None)
            if step is None:
                done.add(name)
                del path[name]
            elif step[1] in path:
                _report_circle(list(path), *step, report)
            elif step[1] in edges and step[1] not in done:
                path[step[1]] = iter(edges[step[1]])


def _report_circle(
    path: list[ir.TypeName], field: ir.Field, target: ir.TypeName, report: Report
) -> None:
    if field.type_span is None:
        return
    circle = [*path[path.index(target) :], target]
    names = " → ".join(name.name for name in circle)
    report.add(
        codes.RECURSIVE_TYPE.at(
            field.type_span,
            f"`{target.name}` contains itself: {names}",
            hint="ROS 2 has no recursive types; refer to the other message by an id",
        )
    )
