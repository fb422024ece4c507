"""Import statements, sorted as linters want them."""

from __future__ import annotations

import builtins
import re
from collections import defaultdict
from collections.abc import Collection, Iterable
from typing import NamedTuple

import msgspec

from idlc.generate.templates import Code, EscapedText
from idlc.model import derive, enums, ir, link, python_names
from idlc.wire.layout import Messages


def natural(name: str) -> list[tuple[int, str]]:
    """Return a key that sorts numbers in names by their value."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


def statements(module: str, names: Collection[str], indent: int = 0) -> list[str]:
    """Return the lines that import names from a module; `X as Y` has a statement of its own."""

    def order(name: str) -> tuple[bool, list[tuple[int, str]]]:
        is_constant = name.isupper() and len(name) > 1  # as linters see it
        return not is_constant, natural(name)

    groups = [(name,) for name in names if " as " in name]
    plain = tuple(sorted((name for name in names if " as " not in name), key=order))
    start, lines = f"{' ' * indent}from {module} import ", list[str]()
    for group in sorted([*groups, plain] if plain else groups):
        if len(group) == 1:
            lines.append(f"{start}{group[0]}")
        else:
            items = (f"{' ' * indent}    {name}," for name in group)
            lines += [f"{start}(", *items, f"{' ' * indent})"]
    return lines


#: Classes of Python that generated modules name.
_TAKEN = {*dir(builtins), "Any"}


class Surroundings(NamedTuple):
    """The position of what a generated package imports from outside of itself, and its enums.

    `runtime` is the folder of the runtime, relative to modules of messages. `others` is the prefix
    of other packages' names; one that begins with a dot is relative to the generated package.
    """

    runtime: str = ".."
    others: str = ""
    enums: enums.Choice = "marked"

    @property
    def vendors(self) -> bool:
        """True if the types of other packages come with this one."""
        return self.others.startswith(".")

    def module(self, type_: ir.TypeName) -> str:
        """Return the module of another package's type, as modules of messages import it."""
        dot = "." if self.vendors else ""
        return f"{dot}{self.others}{type_.package}.{type_.kind}"


#: A package whose dependencies are on the path.
ALONE = Surroundings()
#: A package that comes with the types that it uses.
VENDORING = Surroundings(others=".vendor.")
#: One of those that come with another package. The installed one may have no enums.
VENDORED = Surroundings(runtime="....", others="...vendor.", enums="none")


class References:
    """The names of all classes that a module mentions, and what else its classes refer to.

    `file` defines them, within the package; with `converts` they convert values as Lyrical's do.
    `own` are the structures that it defines or writes, `direct` those that their fields name,
    of which `others` are of other packages.
    """

    def __init__(
        self,
        interface: ir.Interface,
        structures: Iterable[ir.Message],
        messages: Messages,
        modules: python_names.Modules,
        surroundings: Surroundings,
        *,
        converts: bool = False,
    ) -> None:
        self._modules = dict(modules)
        for message in derive.messages(interface):
            self._modules[message.name] = modules[interface.name]
        self.surroundings = surroundings
        self.package = interface.name.package
        self.kind = interface.name.kind
        self.file = interface.name.file
        self.converts = converts
        self.own = {message.name for message in structures}
        named = {name for message in structures for name in message.references}
        self.direct = named - self.own
        self.others = {name for name in self.direct if name.package != self.package}
        defined = {interface.name, *(service.name for service in derive.services(interface))}
        defined |= self.own
        direct = (target for name in self.own for target in messages[name].references)
        reached = derive.closure(direct, lambda name: messages[name].references)
        by_class: dict[str, list[ir.TypeName]] = defaultdict(list)
        for name in defined | reached:
            by_class[python_names.class_(name)].append(name)
        # classes that the module defines keep their plain name, others get another one if theirs
        # is taken: by an exception of Python, for example
        self._names = {
            name: python_names.class_(name)
            if name in defined or (len(same) == 1 and class_ not in _TAKEN)
            else python_names.qualified_class(name)
            for class_, same in by_class.items()
            for name in same
        }

    def name(self, type_: ir.TypeName) -> python_names.ClassName:
        """Return the class's name in this module."""
        return self._names[type_]

    def imports(self, types: Iterable[ir.TypeName], indent: int = 0) -> tuple[list[str], list[str]]:
        """Return import statements of what comes with this package, and of what may be missing.

        Both are sorted; the second are indented by four more columns.
        """
        inside: dict[str, set[str]] = defaultdict(set)
        outside: dict[str, set[str]] = defaultdict(set)
        for type_ in types:
            name: str = python_names.class_(type_)
            if self.name(type_) != name:
                name = f"{name} as {self.name(type_)}"
            if type_.package != self.package:
                group = inside if self.surroundings.vendors else outside
                group[self.surroundings.module(type_)].add(name)
            elif type_.kind == self.kind:
                inside[f".{self._modules[type_]}"].add(name)
            else:
                inside[f"..{type_.kind}.{self._modules[type_]}"].add(name)
        near = sorted(inside, key=lambda module: (len(module.lstrip(".")) - len(module), module))
        return (
            [line for module in near for line in statements(module, inside[module], indent)],
            [
                line
                for module in sorted(outside)
                for line in statements(module, outside[module], indent + 4)
            ],
        )


TITLES: dict[ir.Kind, str] = {"msg": "Messages", "srv": "Services", "action": "Actions"}


class NameView(msgspec.Struct, frozen=True):
    """A class, and the module that it is in; `value` has it where no statement defines it."""

    name: Code
    module: Code
    value: Code


class LazyPackageView(msgspec.Struct, frozen=True):
    """A package that imports its modules when a name is asked for."""

    title: EscapedText
    runtime: Code
    imports: tuple[Code, ...]
    names: tuple[NameView, ...]


def exported(interface: ir.Interface) -> dict[str, str]:
    """Return the names that the module of an interface offers.

    Those that ROS 2 adds come with the attributes that have them, others with nothing.
    """
    group = python_names.class_(interface.name)
    values: dict[ir.TypeName, str] = {}
    if isinstance(interface, ir.Service):
        values = _parts(interface, group)
    elif isinstance(interface, ir.Action):
        send, get = derive.services(interface)
        values = {
            **_parts(send, f"{group}.Impl.SendGoalService"),
            **_parts(get, f"{group}.Impl.GetResultService"),
            derive.feedback_message(interface).name: f"{group}.Impl.FeedbackMessage",
        }
    written = [interface.name, *(section.name for section in derive.sections(interface))]
    values |= dict.fromkeys(written, "")
    return {python_names.class_(name): value for name, value in values.items()}


def _parts(service: ir.Service, value: str) -> dict[ir.TypeName, str]:
    parts = zip(derive.messages(service), ("Request", "Response", "Event"), strict=True)
    return {service.name: value} | {part.name: f"{value}.{name}" for part, name in parts}


def package(
    model: link.Model, kind: ir.Kind, modules: python_names.Modules, surroundings: Surroundings
) -> LazyPackageView:
    """Return the view of one kind's package."""
    names: list[NameView] = []
    imports: list[str] = []
    for module, interface in sorted(
        ((modules[own.name], own) for own in model.own if own.name.kind == kind),
        key=lambda pair: natural(pair[0]),
    ):
        values = exported(interface)
        own = [name for name, value in values.items() if not value]
        imports += statements(f".{module}", own, 4)
        names += [NameView(Code(name), Code(module), Code(value)) for name, value in values.items()]
    return LazyPackageView(
        title=EscapedText(f"{TITLES[kind]} of {model.package}, imported on first use."),
        runtime=Code(surroundings.runtime),
        imports=tuple(map(Code, imports)),
        names=tuple(sorted(names, key=lambda view: natural(view.name))),
    )
