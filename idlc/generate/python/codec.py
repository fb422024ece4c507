"""The view of a module of codecs: statements for each message of a module of classes."""

from __future__ import annotations

import msgspec

from idlc.generate.python import statements
from idlc.generate.python.decode import decode, is_bulk
from idlc.generate.python.encode import encode
from idlc.generate.python.imports import References
from idlc.generate.python.lines import assign, call
from idlc.generate.python.statements import Tables
from idlc.model import ir, python_names
from idlc.model.names import snake_case
from idlc.wire import plan


class CodecView(msgspec.Struct, frozen=True):
    """The codec of a message class: all but the names are finished lines, indented."""

    name: str
    function: str
    imports: tuple[str, ...]
    outside: tuple[str, ...]
    constants: tuple[str, ...]
    encode: tuple[str, ...]
    decode: tuple[str, ...]
    is_bulk: bool


def codec(structure: ir.Message, references: References, messages: plan.Messages) -> CodecView:
    """Return the view of a structure's codec."""
    names = python_names.Locals()
    steps = plan.steps(structure, messages, names)
    tables = Tables(names)
    writing = encode(steps, tables, 8)
    makers = _makers(structure.name, steps, references, tables)
    foreign = {
        type_: references.name(type_) for type_ in makers if type_.package != references.package
    }
    bulk = is_bulk(steps)
    reading = statements.text_of(
        decode(steps, tables, makers[structure.name], makers, foreign, bulk=bulk), 8
    )
    constants = tuple(line for name, value in tables.definitions for line in assign(name, value, 4))
    inside, outside = references.imports(set(makers) - {structure.name}, 4)
    if any("_arrays." in line for line in constants):
        inside.insert(0, "    from .._idlc import arrays as _arrays")
    return CodecView(
        name=references.name(structure.name),
        function=f"{snake_case(structure.name.name).replace('__', '_')}_codec",
        imports=tuple(inside),
        outside=tuple(outside),
        constants=constants,
        encode=tuple(writing),
        decode=tuple(reading),
        is_bulk=bulk,
    )


def _makers(
    own: ir.TypeName, steps: tuple[plan.Step, ...], references: References, tables: Tables
) -> dict[ir.TypeName, str]:
    """Return the functions that make empty objects of the message and of those in it."""
    makers: dict[ir.TypeName, str] = {}
    for type_ in (own, *_types(steps)):
        if type_ not in makers:
            name = "kind" if type_ == own else references.name(type_)
            stem = f"new_{snake_case(type_.name)}".replace("__", "_")
            makers[type_] = tables.define(stem, f"maker {name}", call("_idlc.maker", name))
    return makers


def _types(steps: tuple[plan.Step, ...]) -> list[ir.TypeName]:
    types: list[ir.TypeName] = []
    for step in steps:
        if isinstance(step, plan.Enter):
            types.append(step.type)
        elif isinstance(step, plan.Items):
            types += [step.type, *_types(step.body)]
    return types
