"""The view of message, service and action classes: what the templates lay out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import msgspec

from idlc.generate.python import fields, lines
from idlc.generate.python.fields import FieldView, Naming
from idlc.generate.python.imports import References
from idlc.generate.python.lines import (
    WIDTH,
    Group,
    Node,
    all_of,
    any_of,
    assign,
    call,
    if_one_or_all,
    layout_lines,
    tuple_of,
)
from idlc.model import derive, ir, python_names
from idlc.project.templates import Code, Text


class Equality(msgspec.Struct, frozen=True):
    """Conditions under each of which two messages differ, and the expression of what is left.

    That is True or False, also where fields hold numpy's scalars.
    """

    differences: tuple[Code, ...]
    rest: Code


def equality(structure: ir.Message, receiver: str, references: References) -> Equality:
    """Return how `receiver` and `other` are compared."""
    scalars = [field for field in structure.fields if _is_scalar(field, receiver)]
    others = [field for field in structure.fields if field not in scalars]
    if not others:
        return Equality((), Code(_all_equal(scalars, receiver)))
    parts = [_compared(field, receiver, references) for field in others]
    calls: list[Node] = [part for part in parts if isinstance(part, Group)]
    plain = [part for part in parts if isinstance(part, str)]
    if plain and all(_is_foreign(field, references) for field in others):
        # another package's class may have no types
        calls += plain[:-1]
        last = layout_lines(call("bool", plain[-1]), 8, "return ")
    else:
        last = all_of(plain, 8) if plain else layout_lines(calls.pop(), 8, "return ")
    differences = [_operator(field, receiver, "!=") for field in scalars]
    differences += [_between(layout_lines(part, 8, "if not ", ":"), "if ", ":") for part in calls]
    return Equality(tuple(map(Code, differences)), Code(_between(last, "return ", "")))


def _between(statement: list[str], before: str, after: str) -> str:
    return "\n".join(statement).strip().removeprefix(before).removesuffix(after)


def _is_foreign(field: ir.Field, references: References) -> bool:
    """Return whether what two values are compared by may be of another package."""
    element = ir.element_of(field.type)
    return not isinstance(element, ir.Ref) or element.target.package != references.package


def _is_scalar(field: ir.Field, receiver: str) -> bool:
    scalar = isinstance(field.type, (ir.Primitive, ir.String))
    return scalar and len(_operator(field, receiver, "==")) <= WIDTH - 16


def _operator(field: ir.Field, receiver: str, operator: str) -> str:
    slot = python_names.slot(field.name)
    return f"{receiver}.{slot} {operator} other.{slot}"


def _compared(field: ir.Field, receiver: str, references: References) -> str | Group:
    """Return whether a field is equal.

    It is a call for possible arrays, untyped values, and expressions too long for a line.
    """
    plain = _operator(field, receiver, "==")
    element = ir.element_of(field.type)
    is_array = isinstance(field.type, (ir.Array, ir.Sequence)) and isinstance(element, ir.Primitive)
    untyped = isinstance(element, ir.Ref) and element.target in references.implied
    if is_array or untyped or len(plain) > WIDTH - 16:
        slot = python_names.slot(field.name)
        return call("_idlc.same", f"{receiver}.{slot}", f"other.{slot}")
    return plain


def _all_equal(scalars: list[ir.Field], receiver: str) -> str:
    """Return the expression for messages of nothing but numbers and texts.

    What `!=` returns is only tested: that is faster than to make a bool of it.
    """
    if not scalars:
        return "True"
    if len(scalars) == 1:
        return _between(
            layout_lines(call("bool", _operator(scalars[0], receiver, "==")), 8), "", ""
        )
    conditions = [_operator(field, receiver, "!=") for field in scalars]
    return _between(any_of(conditions, 8, "return not (", ")"), "return ", "")


class ConstantView(msgspec.Struct, frozen=True):
    """A constant, or a default that has the place of one; the file says nothing about that."""

    statement: Code
    docstring: Text = Text("")


class MessageView(msgspec.Struct, frozen=True, kw_only=True):
    """A message class.

    `receiver`, `options` and `boolean` are what its methods call `self`, further
    keywords and the builtins of these names, which names of the interface may hide. `guard` is
    the head of the `if` for a constructor that was given something unusual.
    """

    name: Code
    docstring: fields.Docstring
    match_args: Code
    constants: tuple[ConstantView, ...]
    fields: tuple[FieldView, ...]
    equality: Equality
    receiver: Code
    options: Code
    guard: Code
    boolean: Code


class GroupView(msgspec.Struct, frozen=True):
    """A service or action, which only groups classes: its name and that in the file."""

    name: Code
    purpose: Text
    stem: Code


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
    doubt = fields.doubt(structure, references, naming, converts=converts)
    return MessageView(
        name=Code(references.name(structure.name)),
        docstring=fields.message(structure, purposes[structure.name], entries, file),
        match_args=Code("\n".join(layout_lines(names, 4, "__match_args__ = ")).partition(" = ")[2]),
        constants=tuple(_constants(structure, file)),
        fields=views,
        equality=equality(structure, naming.receiver, references),
        receiver=Code(naming.receiver),
        options=Code(naming.options),
        guard=_statement(if_one_or_all(naming.options, doubt, 8)),
        boolean=Code(f"{naming.builtins}bool"),
    )


def _constants(structure: ir.Message, file: str) -> Iterator[ConstantView]:
    for constant in structure.constants:
        statement = assign(constant.name, lines.scalar(constant.type, constant.value), 4)
        words = fields.field_words(constant)
        yield ConstantView(_statement(statement), fields.attribute(constant, words, file))
    for field in structure.fields:
        if field.default:
            yield ConstantView(_statement(fields.default_constant(field)))


def _statement(on_lines: Iterable[str]) -> Code:
    return Code("\n".join(on_lines).lstrip())


def services(interface: ir.Interface, purposes: Purposes) -> tuple[GroupView, ...]:
    """Return the views of a service, or of the services that an action consists of."""
    return tuple(
        GroupView(
            name=Code(python_names.class_(service.name)),
            purpose=Text(purposes.get(service.name, f"The service {service.name}.")),
            stem=Code(service.name.name),
        )
        for service in derive.services(interface)
    )


def action(interface: ir.Action) -> GroupView:
    """Return the view of an action."""
    name = interface.name
    return GroupView(Code(python_names.class_(name)), Text(f"The action {name}."), Code(name.name))
