"""Paths to values in a message, such as `header.stamp.sec`, `position[3]` or `name[*]`.

In: paths as texts, and the structure that they begin in. Out: a tree of the values to read, in
which paths that begin alike share their nodes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

import msgspec

from idlc.diagnostics.text import did_you_mean
from idlc.model import ir
from idlc.wire.layout import Messages

#: A field's name, and the index of an element of it; `*` is all of them.
_PART = re.compile(r"(\w+)(?:\[(-?\d{1,10}|\*)\])?", re.ASCII)


class PathError(ValueError):
    """Paths that a structure does not have; the text has a line for each."""


class Wanted(msgspec.Struct):
    """The values to read in a value.

    `numbers` are those of the paths that end here, `type` is the value's. Elements are by their
    index, or by None if all of them are wanted.
    """

    type: ir.FieldType
    numbers: list[int] = []
    fields: dict[str, Wanted] = {}
    elements: dict[int | None, Wanted] = {}

    def all_numbers(self) -> list[int]:
        """Return the numbers of all paths that lead here or further."""
        inner = (*self.fields.values(), *self.elements.values())
        return [*self.numbers, *(number for node in inner for number in node.all_numbers())]


def wanted_values(paths: Iterable[str], message: ir.Message, messages: Messages) -> Wanted:
    """Return the tree of what paths lead to; raise PathError if some lead nowhere."""
    top = Wanted(ir.Ref(message.name))
    problems = []
    for number, path in enumerate(paths):
        try:
            _add(top, path, number, messages)
        except PathError as error:
            problems.append(str(error))
    if problems:
        raise PathError("\n".join(problems))
    return top


def _add(node: Wanted, path: str, number: int, messages: Messages) -> None:
    for part in path.split("."):
        match = _PART.fullmatch(part)
        if match is None:
            hint = "a path is written as in `header.stamp`, `position[3]` or `name[*]`"
            raise PathError(f"`{path}` is not a path: {hint}")
        name, index = match.groups()
        if not isinstance(node.type, ir.Ref):
            raise PathError(f"`{path}`: {_problem(node.type, name)}")
        fields = {field.name: field.type for field in messages[node.type.target].fields}
        if name not in fields:
            hint = did_you_mean(name, fields) or f"it has {', '.join(fields) or 'none'}"
            raise PathError(f"`{path}`: {node.type.target} has no field `{name}`; {hint}")
        node = node.fields.setdefault(name, Wanted(fields[name]))
        if index is not None:
            node = _element(node, path, name, None if index == "*" else int(index))
    node.numbers.append(number)


def _problem(type_: ir.FieldType, name: str) -> str:
    if isinstance(type_, (ir.Array, ir.Sequence)):
        return f"`{name}` is in the elements of a list: add an index such as `[0]`, or `[*]`"
    return f"there is no `{name}` in a {ir.spell(type_)}"


def _element(node: Wanted, path: str, name: str, index: int | None) -> Wanted:
    if not isinstance(node.type, (ir.Array, ir.Sequence)):
        raise PathError(f"`{path}`: `{name}` is not a list, so it has no index")
    most = node.type.size if isinstance(node.type, ir.Array) else node.type.bound
    if index is not None and most is not None and not -most <= index < most:
        raise PathError(f"`{path}`: `{name}` has at most {most} elements")
    return node.elements.setdefault(index, Wanted(node.type.element))
