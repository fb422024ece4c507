"""The view of message, service and action classes: what the templates lay out."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from idlc.generate.python import fields, literals
from idlc.generate.python.fields import Docstring, FieldView, Naming
from idlc.generate.python.imports import References
from idlc.generate.templates import Code, EscapedText
from idlc.model import enums, ir, python_names


class ConstantView(msgspec.Struct, frozen=True):
    """A constant, or a default that has the place of one; the file says nothing about that.

    With `arguments`, its value is the function that is called with them.
    """

    name: Code
    value: Code
    arguments: tuple[Code, ...] = ()
    docstring: Docstring = Docstring(EscapedText(""))


class EnumView(msgspec.Struct, frozen=True):
    """A nested class of integers, with the names of the fields whose values these are."""

    name: Code
    fields: tuple[Code, ...]
    members: tuple[ConstantView, ...]


class MessageView(msgspec.Struct, frozen=True, kw_only=True):
    """A message class; `usual` is the class of the first field's values."""

    name: Code
    docstring: Docstring
    constants: tuple[ConstantView, ...]
    enums: tuple[EnumView, ...]
    fields: tuple[FieldView, ...]
    usual: Code
    naming: Naming


class GroupView(msgspec.Struct, frozen=True):
    """A service or action, which only groups classes: its name and that in the file."""

    name: Code
    purpose: EscapedText
    stem: Code


def message(structure: ir.Message, references: References, purpose: str) -> MessageView:
    """Return the view of a structure's class; `purpose` is its docstring without a comment."""
    naming = Naming.of(structure)
    class_ = references.name(structure.name)
    views, classes = [], dict[str, str]()
    for enum in enums.enums(structure, references.surroundings.enums):
        names = tuple(Code(python_names.field(field.name)) for field in enum.fields)
        members = (
            _constant(member, name, references.file) for name, member in enum.members.items()
        )
        views.append(EnumView(Code(enum.name), names, tuple(members)))
        classes |= {field.name: f"{class_}.{enum.name}" for field in enum.fields}
    usual = [fields.usual_class(field, references, naming) for field in structure.fields[:1]]
    return MessageView(
        name=Code(class_),
        docstring=fields.message(structure, purpose, references.file),
        constants=tuple(_constants(structure, references.file)),
        enums=tuple(views),
        fields=tuple(
            fields.view(field, references, naming, classes.get(field.name, ""))
            for field in structure.fields
        ),
        usual=usual[0] if usual else Code(""),
        naming=naming,
    )


def _constants(structure: ir.Message, file: str) -> Iterator[ConstantView]:
    for constant in structure.constants:
        yield _constant(constant, constant.name, file)
    for field in structure.fields:
        if default := field.default:
            name = Code(fields.default_name(field))
            yield ConstantView(name, *fields.default(field.type, default.value))


def _constant(constant: ir.Constant, name: str, file: str) -> ConstantView:
    value = Code(literals.scalar(constant.type, constant.value))
    return ConstantView(Code(name), value, docstring=fields.attribute(constant, file))


def group(interface: ir.Service | ir.Action) -> GroupView:
    """Return the view of a service or action."""
    name = interface.name
    purpose = f"The {'action' if isinstance(interface, ir.Action) else 'service'} {name}."
    return GroupView(Code(python_names.class_(name)), EscapedText(purpose), Code(name.name))
