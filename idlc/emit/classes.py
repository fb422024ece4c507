"""The view of message, service and action classes: what the templates lay out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import msgspec

from idlc.emit import documentation, fields, literals, pynames
from idlc.emit.equality import Equality, equality
from idlc.emit.fields import FieldView, Naming
from idlc.emit.python_lines import assign, if_one_or_all, lines, tuple_of
from idlc.emit.references import References
from idlc.model import derive, ir


class ConstantView(msgspec.Struct, frozen=True):
    """A constant, or a default that has the place of one; the file says nothing about that."""

    statement: str
    docstring: str = ""


class MessageView(msgspec.Struct, frozen=True, kw_only=True):
    """A message class.

    `receiver`, `options`, `boolean` and `not_implemented` are what its methods call `self`, further
    keywords and what Python has by these names, which names of the interface may hide. `guard` is
    the head of the `if` for a constructor that was given something unusual.
    """

    name: str
    docstring: documentation.Docstring
    match_args: str
    constants: tuple[ConstantView, ...]
    fields: tuple[FieldView, ...]
    equality: Equality
    receiver: str
    options: str
    guard: str
    boolean: str
    not_implemented: str


class GroupView(msgspec.Struct, frozen=True):
    """A service or action, which only groups classes: its name and that in the file."""

    name: str
    purpose: str
    stem: str


Purposes = Mapping[ir.TypeName, str]


def message(
    structure: ir.Message,
    references: References,
    purposes: Purposes,
    file: str,
    *,
    converts: bool,
) -> MessageView:
    """Return the view of a structure's class; `file` is the one that defines it."""
    naming = Naming.of(structure)
    views = tuple(
        fields.view(field, references, naming, file, converts=converts)
        for field in structure.fields
    )
    names = tuple_of(*(f'"{view.name}"' for view in views))
    entries = tuple(view.description for view in views)
    doubt = views[0].doubt if views else ()
    return MessageView(
        name=references.name(structure.name),
        docstring=documentation.message(structure, purposes[structure.name], entries, file),
        match_args="\n".join(lines(names, 4, "__match_args__ = ")).partition(" = ")[2],
        constants=tuple(_constants(structure, file)),
        fields=views,
        equality=equality(structure, naming.receiver, references),
        receiver=naming.receiver,
        options=naming.options,
        guard="\n".join(if_one_or_all(naming.options, doubt, 8)).lstrip(),
        boolean=f"{naming.builtins}bool",
        not_implemented=naming.not_implemented,
    )


def _constants(structure: ir.Message, file: str) -> Iterator[ConstantView]:
    for one in structure.constants:
        statement = assign(one.name, literals.scalar(one.type, one.value), 4)
        yield ConstantView(
            _statement(statement), documentation.attribute(one, documentation.words(one), file)
        )
    for field in structure.fields:
        if field.default:
            yield ConstantView(_statement(fields.default_constant(field)))


def _statement(on_lines: Iterable[str]) -> str:
    return "\n".join(on_lines).lstrip()


def services(interface: ir.Interface, purposes: Purposes) -> tuple[GroupView, ...]:
    """Return the views of a service, or of the services that an action consists of."""
    return tuple(
        GroupView(
            name=pynames.class_(service.name),
            purpose=purposes.get(service.name, f"The service {service.name}."),
            stem=service.name.name,
        )
        for service in derive.services(interface)
    )


def action(interface: ir.Action) -> GroupView:
    """Return the view of an action."""
    name = interface.name
    return GroupView(pynames.class_(name), f"The action {name}.", name.name)
