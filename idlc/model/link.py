"""Linking: interfaces of several packages become one immutable index by name."""

from __future__ import annotations

from collections.abc import Callable, Container, Hashable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Protocol, TypeAlias, TypeVar

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import did_you_mean, including, package_hint
from idlc.language.parse import parse_any
from idlc.model import catalog, derive, ir, names
from idlc.model.distros import Distro, titles
from idlc.model.lowering import lower_types
from idlc.model.lowering.lower import lower
from idlc.model.lowering.lower_types import STRINGS

if TYPE_CHECKING:
    from idlc.model.describe import Describer

_Node = TypeVar("_Node", bound=Hashable)
_Edge = TypeVar("_Edge")
#: Messages of a circle that are named.
NAMED = 10


def circles(
    roots: Iterable[_Node],
    edges: Callable[[_Node], Iterable[tuple[_Edge, _Node]]],
    done: set[_Node],
) -> Iterator[tuple[list[_Node], _Edge]]:
    """Yield each circle as its nodes, with the edge from the last back to the first.

    Nodes in `done` are skipped; every node that is reached is added to them.
    """
    for root in roots:
        path: list[_Node] = []
        rest: list[Iterator[tuple[_Edge, _Node]]] = []
        places: dict[_Node, int] = {}
        entered: _Node | None = None if root in done else root
        while entered is not None or path:
            if entered is not None:
                places[entered] = len(path)
                path.append(entered)
                rest.append(iter(edges(entered)))
            edge, target = next(rest[-1], (None, None))
            entered = None
            if target is None or edge is None:
                done.add(path[-1])
                del rest[-1], places[path.pop()]
            elif target in places:
                yield path[places[target] :], edge
            elif target not in done:
                entered = target


def dependents(
    names: Iterable[ir.TypeName], references: Iterable[tuple[ir.TypeName, Iterable[ir.TypeName]]]
) -> set[ir.TypeName]:
    """Return interfaces with all that refer to one of them, in linear time, circles or not.

    `references` has the names that each interface refers to.
    """
    users: dict[ir.TypeName, list[ir.TypeName]] = {}
    for user, targets in references:
        for target in targets:
            users.setdefault(target, []).append(user)
    return derive.closure(names, lambda name: users.get(name, ()))


def _check_recursion(interfaces: Iterable[ir.TypeName], pool: Pool) -> None:
    """Add an error for each field that closes a circle."""
    hint = "ROS 2 does not support recursive types; refer to the other message by an id"
    for path, field in circles(interfaces, pool.references, pool.searched):
        if field.type_span is not None:
            more = [f"{len(path) - NAMED} more"] if len(path) > NAMED else []
            first = path[0].name
            circle = " → ".join((*(name.name for name in path[:NAMED]), *more, first))
            message = f"`{first}` contains itself: {circle}"
            error = codes.RECURSIVE_TYPE.at(field.type_span, message, hint=hint)
            pool.linked[path[-1]].append(error)


class Entry(msgspec.Struct, frozen=True):
    """The interface of a text, its problems, and its fields that hold messages of other files."""

    interface: ir.Interface
    problems: Report
    references: tuple[tuple[ir.Field, ir.TypeName], ...]


#: Interfaces with the names that they refer to; `None` for a name without an interface.
LoweredInterfaces: TypeAlias = dict[
    ir.TypeName, tuple[ir.Interface | None, tuple[ir.TypeName, ...]]
]
#: Lowered interfaces by name, valid for the same `Source` and distribution.
Memory: TypeAlias = dict[ir.TypeName, Entry]


class Pool:
    """Interfaces by name, added ones and ones from a library.

    Pools of one library may share a `memory`, so that only texts that changed are lowered again.
    """

    def __init__(self, library: InterfaceSource, memory: Memory | None = None) -> None:
        self.library = library
        self._memory = {} if memory is None else memory
        self._entries: dict[ir.TypeName, Entry | None] = {}
        #: The errors of references, of each interface whose references were looked up.
        self.linked: dict[ir.TypeName, list[Diagnostic]] = {}
        #: The interfaces that were searched for circles.
        self.searched: set[ir.TypeName] = set()

    def add(self, interface: ir.Interface) -> None:
        """Add an interface that has no problems of its own, unless it was added before."""
        entry = self._entries.get(interface.name)
        if entry is None or entry.interface is not interface:
            self._entries[interface.name] = _entry(interface, Report())

    def lower(self, name: ir.TypeName, source: Source) -> Entry:
        """Add and return the interface of a text, remembered or new."""
        entry = self._memory.get(name)
        if entry is None or entry.interface.source is not source:
            problems = Report()
            interface = lower(parse_any(source), name, problems, self.library.distro)
            entry = self._memory[name] = _entry(interface, problems)
        self._entries[name] = entry
        return entry

    def get(self, name: ir.TypeName) -> Entry | None:
        """Return an interface by name; `None` if there is none."""
        if name not in self._entries:
            source = self.library.source(name)
            self._entries[name] = None if source is None else self.lower(name, source)
        return self._entries[name]

    def references(self, name: ir.TypeName) -> Iterator[tuple[ir.Field, ir.TypeName]]:
        """Yield the references of an interface to others that exist."""
        entry = self._entries.get(name)
        for field, target in entry.references if entry else ():
            if self._entries.get(target):
                yield field, target

    def graph(self, names: Iterable[ir.TypeName]) -> LoweredInterfaces:
        """Return interfaces and all that they refer to, `None` for missing ones."""
        graph: LoweredInterfaces = {}

        def targets(name: ir.TypeName) -> Iterable[ir.TypeName]:
            entry = self.get(name)
            references = tuple(target for _, target in entry.references) if entry else ()
            graph[name] = (entry.interface if entry else None, references)
            return references

        derive.closure(names, targets)
        return graph

    def errors(self, name: ir.TypeName) -> list[Diagnostic]:
        """Return the errors of an interface's text and of its references."""
        entry = self._entries.get(name)
        return [*(entry.problems.errors if entry else ()), *self.linked.get(name, ())]

    def check_packages(self, report: Report) -> None:
        """Report each circle of packages, which no build tool could put into an order."""
        # where a package first names each other one; ROS 2 adds others by itself
        packages: dict[str, dict[str, Span]] = {}
        for entry in filter(None, self._entries.values()):
            own = entry.interface.name.package
            for field, target in entry.references:
                if target.package != own and field.type_span is not None:
                    packages.setdefault(own, {}).setdefault(target.package, field.type_span)
        edges = {own: [(at, to) for to, at in spans.items()] for own, spans in packages.items()}
        for circle, span in circles(sorted(edges), lambda own: edges.get(own, ()), set()):
            names = " → ".join((*circle, circle[0]))
            message = f"packages depend on each other in a cycle: {names}"
            hint = "move the messages that several of them use into a separate package"
            report.add(codes.PACKAGE_CIRCLE.at(span, message, hint=hint))

    @cached_property
    def describer(self) -> Describer:
        """Type descriptions and hashes, each made once."""
        from idlc.model.describe import Describer

        return Describer({})


def _entry(interface: ir.Interface, problems: Report) -> Entry:
    holders = (holder for part in derive.messages(interface) for holder in part.holders)
    references = tuple(holder for holder in holders if holder[1].kind == "msg")
    return Entry(interface, problems, references)


#: Problems after which idlc no longer looks for the nearest names; people see fewer than these.
SUGGESTIONS = 200
_PRIMITIVES = (*ir.PRIMITIVES, *STRINGS)


class InterfaceSource(Protocol):
    """The sources of other packages' interfaces, in order of precedence."""

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface, or `None` if there is none of that name."""

    def names(self, package: str) -> Iterable[str]:
        """Return the names of a package's messages; empty for an unknown package."""

    def packages(self) -> Iterable[str]:
        """Return the names of all packages, for suggestions."""

    def nearby(self, package: str) -> str | None:
        """Return the advice that makes idlc find a package, if its folder is near."""

    def idl_file(self, name: ir.TypeName) -> str | None:
        """Return the path of the .idl file that defines a message, if there is one."""

    @property
    def distro(self) -> Distro:
        """The distribution of ROS 2 that files are read for."""


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
        pool: Pool | None = None,
    ) -> None:
        self.package = package
        self.own = own
        self.interfaces = interfaces
        self._pool = pool or Pool(catalog)

    @property
    def kinds(self) -> list[ir.Kind]:
        """The kinds of its own interfaces, sorted."""
        return sorted({interface.name.kind for interface in self.own})

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
        """Type descriptions and hashes of everything in the model, shared with its pool."""
        self._pool.describer.add(self.interfaces)
        return self._pool.describer

    def hash(self, name: ir.TypeName) -> str | None:
        """Return the hash of a type; `None` if it is not in the model."""
        is_known = name in self.messages or name in self.interfaces
        return self.describer.hash(str(name)) if is_known else None

    @property
    def distro(self) -> Distro:
        """The distribution of ROS 2 that the files were read for."""
        return self._pool.library.distro

    def only(self, names: Container[ir.TypeName]) -> Model:
        """Return the model with its own interfaces limited to these names."""
        own = tuple(interface for interface in self.own if interface.name in names)
        return Model(self.package, own, self.interfaces, self._pool)

    def alone(self, interface: ir.Interface) -> Model:
        """Return the model with one of its own interfaces alone."""
        return Model(self.package, (interface,), self.interfaces, self._pool)

    def references(self) -> Iterator[tuple[ir.Field, ir.TypeName]]:
        """Yield the fields of the own interfaces that name messages, each with the message."""
        for interface in self.own:
            entry = self._pool.get(interface.name)
            yield from entry.references if entry else ()

    def graph(self) -> LoweredInterfaces:
        """Return the own interfaces and all that they refer to, `None` for missing ones."""
        return self._pool.graph(interface.name for interface in self.own)

    def restricted_to(self, interface: ir.Interface, broken: Container[str]) -> Model | None:
        """Return the model of one interface and all that it refers to.

        `None` if one of these is missing, has errors or is in a `broken` file.
        """
        needed: dict[ir.TypeName, ir.Interface] = {}
        for name, (reached, _) in self._pool.graph((interface.name,)).items():
            if reached is None or self._pool.errors(name) or _is_in(reached, broken):
                return None
            needed[name] = reached
        return Model(self.package, (interface,), needed, self._pool)

    def sound(self, broken: Container[str]) -> Model:
        """Return the model without the interfaces in `broken` files and their users."""
        wrong = [name for name, own in self.interfaces.items() if _is_in(own, broken)]
        unsound = dependents(
            wrong,
            ((name, (to for _, to in self._pool.references(name))) for name in self.interfaces),
        )
        sound = {name: self.interfaces[name] for name in self.interfaces if name not in unsound}
        return Model(self.package, self.only(sound).own, sound, self._pool)


def _is_in(interface: ir.Interface, paths: Container[str]) -> bool:
    return interface.source is not None and interface.source.path in paths


def link(
    package: str,
    own: Iterable[ir.Interface],
    library: InterfaceSource,
    report: Report,
    pool: Pool | None = None,
) -> Model:
    """Return the model of a package's interfaces and of all that they refer to.

    Reports unknown and recursive types. Messages of the package itself that are referred to but
    not among `own` are taken from the library and become part of `own`. A model with errors
    has gaps: only after a report without errors is it safe to describe or emit. Packages that are
    linked in one run share a `pool`.
    """
    pool = pool or Pool(library)
    interfaces = {interface.name: interface for interface in own}
    for interface in interfaces.values():
        pool.add(interface)
    _load_references(interfaces, pool)
    _check_recursion(interfaces, pool)
    for name in interfaces:
        report.extend(pool.errors(name))
    mine = sorted(name for name in interfaces if name.package == package)
    return Model(package, tuple(interfaces[name] for name in mine), interfaces, pool)


def _load_references(interfaces: dict[ir.TypeName, ir.Interface], pool: Pool) -> None:
    """Add every interface that is referred to; add an error for each that does not exist."""
    unknown = _UnknownTypes(interfaces, pool.library)
    queue = list(interfaces)
    while queue:
        name = queue.pop()
        is_new = name not in pool.linked
        errors = pool.linked.setdefault(name, [])
        entry = pool.get(name)
        for field, target in entry.references if entry else ():
            is_implied = field.type_span is not None and _is_implied_only(target, pool.library)
            if target in interfaces and not is_implied:
                continue
            found = None if is_implied else pool.get(target)
            if found:
                interfaces[target] = found.interface
                queue.append(target)
            elif is_new and field.type_span is not None:
                errors.append(unknown.problem(target, field.type_span))


def _is_implied_only(target: ir.TypeName, library: InterfaceSource) -> bool:
    """Return whether a message exists only for service events, which Humble does not have."""
    return target == derive.SERVICE_EVENT_INFO and target.name not in library.names(target.package)


class _UnknownTypes:
    """Makes the problems of references to types that do not exist.

    A search for the nearest name goes through all packages, so only the first problems get one.
    """

    def __init__(
        self, interfaces: Mapping[ir.TypeName, ir.Interface], library: InterfaceSource
    ) -> None:
        self._interfaces = interfaces
        self._library = library
        self._hints = SUGGESTIONS
        self._messages: dict[str, set[str]] = {}
        #: By package and name in lower case, the first file whose name is not that of a message.
        self._misnamed: dict[tuple[str, str], str] = {}
        for name in sorted(interfaces):
            mine = self._messages.setdefault(name.package, set())
            if name.kind == "msg" and names.is_message_name(name.name):
                mine.add(name.name)
            elif name.kind == "msg":
                self._misnamed.setdefault((name.package, name.name.lower()), name.name)

    def problem(self, target: ir.TypeName, span: Span) -> Diagnostic:
        """Return the problem with a reference to `target`."""
        self._hints -= 1
        written = span.text
        siblings = self._messages.get(target.package)
        packages = self._library.packages() if self._hints >= 0 else ()
        is_known = siblings is not None or target.package in packages
        if "/" in written and not is_known and not self._library.names(target.package):
            package = target.package
            nearby = self._library.nearby(package) or _of_others(target)
            hint = nearby or package_hint(package, packages)
            at, message = span.at(0, len(package)), f"unknown package `{package}`"
            return codes.UNKNOWN_PACKAGE.at(at, message, hint=hint)
        at = span.at(written.rfind("/") + 1, len(written))
        hint = self._hint(target, qualified="/" in written)
        return codes.UNKNOWN_TYPE.at(at, f"unknown type `{written}`", hint=hint)

    def _hint(self, target: ir.TypeName, *, qualified: bool) -> str:
        others: dict[ir.Kind, str] = {"srv": "a service", "action": "an action"}
        for kind, noun in others.items():
            other = target._replace(kind=kind)
            if other in self._interfaces or (self._hints >= 0 and self._library.source(other)):
                return f"`{target.name}` is {noun}; only messages can be the type of a field"
        name, package, distro = target.name, target.package, self._library.distro
        if self._hints >= 0 and (path := self._library.idl_file(target)):
            return f"`{path}` defines it, but idlc does not compile .idl files"
        if not qualified and (hint := self._in_other_package(name)):
            return hint
        if misnamed := self._misnamed.get((package, name.lower())):
            return f"rename `{misnamed}.msg` to `{name}.msg`"
        if hint := _of_others(target):
            return hint
        messages = set(self._library.names(package))
        if self._hints >= 0:
            candidates = {*self._messages.get(package, ()), *messages, *_PRIMITIVES}
            if hint := did_you_mean(name, candidates):
                return hint
        if messages and messages == set(catalog.names(package, distro)):
            return (
                f"the built-in `{package}` of ROS 2 {distro.title} has no `{name}`; if your version"
                f" does, {including('DIR')}, where DIR contains its sources, or source your ROS 2"
            )
        return f"there is no `{name}.msg` in package `{package}`"

    def _in_other_package(self, name: str) -> str | None:
        """Return a hint at a basic type, or at a package that has a message of just this name."""
        if self._hints < 0:
            return None
        library = self._library
        packages = sorted(library.packages(), key=lambda package: (package != "std_msgs", package))
        package = next(
            (candidate for candidate in packages if name in library.names(candidate)), None
        )
        if name.lower() in _PRIMITIVES and name.lower() != name:
            other = f", or the message `{package}/{name}`" if package else ""
            return f"did you mean `{name.lower()}`{other}?"
        return f"did you mean `{package}/{name}`?" if package else lower_types.type_hint(name)


def _of_others(target: ir.TypeName) -> str | None:
    """Return the hint for a message that other distributions have."""
    others = catalog.holding(target)
    if not others:
        return None
    return (
        f"it is built in for {titles(others)}; if your ROS 2 contains it, "
        f"{including('DIR')}, where DIR contains its sources, or source your ROS 2"
    )


def own_sections(model: Model) -> Iterable[ir.Message]:
    """Return every structure of the model's own files."""
    return (part for interface in model.own for part in derive.sections(interface))


def own_fields(model: Model) -> Iterable[ir.Field]:
    """Return every field of the model's own files."""
    return (field for message in own_sections(model) for field in message.fields)


def held(interface: ir.Interface, model: Model) -> list[ir.TypeName]:
    """Return the names of all messages that an interface holds, once each, in order of use."""
    queue = list(derive.sections(interface))
    used: dict[ir.TypeName, None] = {}
    for message in queue:
        for target in message.references:
            if target not in used:
                used[target] = None
                queue.append(model.messages[target])
    return list(used)
