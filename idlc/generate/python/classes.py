"""The view of message, service and action classes: what the templates lay out."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from idlc.generate.python import fields, literals
from idlc.generate.python.fields import Docstring, FieldView, Naming
from idlc.generate.python.imports import References
from idlc.model import ir, python_names
from idlc.project.templates import Code, Text


class ConstantView(msgspec.Struct, frozen=True):
    """A constant, or a default that has the place of one; the file says nothing about that.

    With `arguments`, its value is the function that is called with them.
    """

    name: Code
    value: Code
    arguments: tuple[Code, ...] = ()
    docstring: Docstring = Docstring(Text(""))


class MessageView(msgspec.Struct, frozen=True, kw_only=True):
    """A message class; `usual` is the class of the first field's values."""

    name: Code
    docstring: Docstring
    constants: tuple[ConstantView, ...]
    fields: tuple[FieldView, ...]
    usual: Code
    naming: Naming


class GroupView(msgspec.Struct, frozen=True):
    """A service or action, which only groups classes: its name and that in the file."""

    name: Code
    purpose: Text
    stem: Code


def message(structure: ir.Message, references: References, purpose: str) -> MessageView:
    """Return the view of a structure's class; `purpose` is its docstring without a comment."""
    naming = Naming.of(structure)
    usual = [fields.usual_class(field, references, naming) for field in structure.fields[:1]]
    return MessageView(
        name=Code(references.name(structure.name)),
        docstring=fields.message(structure, purpose, references.file),
        constants=tuple(_constants(structure, references.file)),
        fields=tuple(fields.view(field, references, naming) for field in structure.fields),
        usual=usual[0] if usual else Code(""),
        naming=naming,
    )


def _constants(structure: ir.Message, file: str) -> Iterator[ConstantView]:
    for constant in structure.constants:
        value = Code(literals.scalar(constant.type, constant.value))
        docstring = fields.attribute(constant, file)
        yield ConstantView(Code(constant.name), value, docstring=docstring)
    for field in structure.fields:
        if default := field.default:
            name = Code(fields.default_name(field))
            yield ConstantView(name, *fields.default(field.type, default.value))


def group(interface: ir.Service | ir.Action) -> GroupView:
    """Return the view of a service or action."""
    name = interface.name
    purpose = f"The {'action' if isinstance(interface, ir.Action) else 'service'} {name}."
    return GroupView(Code(python_names.class_(name)), Text(purpose), Code(name.name))
