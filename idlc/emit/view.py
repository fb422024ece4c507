"""The view-model: what each generated page says, as finished strings.

In: the model. Out: frozen structs of lines and tuples that templates only lay out. All text from
interface files has gone through `literals`, all names through `pynames`.
"""

from __future__ import annotations

import msgspec

from idlc.emit import documentation, fields, groups, literals, pynames
from idlc.emit.codec import statements, wire_plan
from idlc.emit.codec.constants import Tables
from idlc.emit.codec.decode import decode, is_bulk
from idlc.emit.codec.encode import encode
from idlc.emit.equality import equality
from idlc.emit.python_lines import WIDTH, Group, assign, call, if_any, lines, tuple_of
from idlc.emit.references import References, referred, wrapped
from idlc.model import derive, ir
from idlc.model.names import snake_case


class MessageView(msgspec.Struct, frozen=True):
    """A message class and its codec. All members are finished lines."""

    name: str
    body: tuple[str, ...]
    init: tuple[str, ...]
    equality: tuple[str, ...]
    codec: tuple[str, ...]
    tables: tuple[str, ...]
    encode: tuple[str, ...]
    decode: tuple[str, ...]
    result: str


class ModuleView(msgspec.Struct, frozen=True):
    """The module of one interface."""

    path: str
    origin: str
    pragmas: tuple[str, ...]
    summary: str
    imports: tuple[str, ...]
    messages: tuple[MessageView, ...]
    groups: tuple[groups.GroupView, ...]


PRAGMAS = (
    '# mypy: disable-error-code="import-not-found,import-untyped"',
    "# pyright: reportMissingImports=false, reportMissingTypeStubs=false",
)


HIDING_PRAGMAS = ("# pyright: reportIncompatibleMethodOverride=false",)


def origin(name: ir.TypeName) -> str:
    """Return an interface's file, as package/kind/Name.kind."""
    return f"{name}.{name.kind}"


def module(
    interface: ir.Interface, messages: wire_plan.Messages, modules: pynames.Modules
) -> ModuleView:
    """Return the view of an interface's module; `modules` names all of its package."""
    name = interface.name
    references = References(interface, messages, modules)
    structures = derive.messages(interface)
    return ModuleView(
        path=f"{name.kind}/{modules[name]}.py",
        origin=origin(name),
        pragmas=(
            *(PRAGMAS if _has_others(references, messages) else ()),
            *(HIDING_PRAGMAS if any(map(_hides_methods, structures)) else ()),
        ),
        summary=f"The classes of {name}.",
        imports=tuple(_imports(references, structures, name.kind)),
        messages=tuple(
            _message(structure, interface, references, messages) for structure in structures
        ),
        groups=tuple(groups.views(interface)),
    )


def _hides_methods(structure: ir.Message) -> bool:
    return any(pynames.hides_method(field.name) for field in structure.fields)


def _has_others(references: References, messages: wire_plan.Messages) -> bool:
    waiting = [*references.direct, *references.implied]
    while waiting:
        name = waiting.pop()
        if name.package != references.package:
            return True
        waiting += referred(messages[name])
    return False


def _imports(
    references: References, structures: tuple[ir.Message, ...], kind: ir.Kind
) -> list[str]:
    used = {fields.support(field.type) for message in structures for field in message.fields}
    standard = ["import builtins as _builtins"] if any(map(fields.shadows, structures)) else []
    if "sequence" in used:
        standard.append("from array import array as _array")
    inside, outside = references.imports(references.direct, kind)
    relative = ["from .. import _idlc"]
    if "array" in used:
        relative.append("from .._idlc import arrays as _arrays")
    result = [*standard, *([""] if standard else []), *relative, *inside]
    if outside:
        result += ["", "with _idlc.importing():", *(f"    {line}" for line in wrapped(outside))]
    if references.implied:
        implied = references.modules()
        result += ["", "TYPE_CHECKING = False", "if TYPE_CHECKING:"]
        result += [f"    import {module} as {name}" for module, name in implied]
        result += [
            "else:",
            *(f'    {name} = _idlc.Package("{module}")' for module, name in implied),
        ]
    return result


def _message(
    structure: ir.Message,
    interface: ir.Interface,
    references: References,
    messages: wire_plan.Messages,
) -> MessageView:
    views = _field_views(structure, references)
    names = pynames.Locals()
    steps = wire_plan.steps(structure, messages, names)
    tables = Tables(names)
    writing = encode(steps, tables, 8)
    makers, needed = _makers(structure.name, steps, references, tables)
    bulk = is_bulk(steps)
    reading = statements.text_of(
        decode(steps, tables, makers[structure.name], makers, bulk=bulk), 8
    )
    definitions = tuple(
        line for name, value in tables.definitions for line in assign(name, value, 4)
    )
    arrays = any("_arrays." in line for line in definitions) and not _has_arrays(interface)
    return MessageView(
        name=references.name(structure.name),
        body=tuple(_body(structure, views)),
        init=tuple(_init(structure, views)),
        equality=tuple(equality(structure, _receiver(structure), references)),
        codec=_codec_head(structure.name),
        tables=(*_codec_imports(needed, references, interface.name.kind, arrays), *definitions),
        encode=tuple(writing),
        decode=tuple(reading),
        result=f"_idlc.Codec(encode, decode{', bulk=True' if bulk else ''})",
    )


def _codec_head(name: ir.TypeName) -> tuple[str, ...]:
    # with a suffix, or the codec of a message `Arrays` would hide the import `_arrays`
    function = f"def _{snake_case(name.name)}_codec"
    head = f"{function}(order: str, reading: _idlc.Reading) -> _idlc.Codec:"
    if len(head) <= WIDTH:
        return (head,)
    return (f"{function}(", "    order: str, reading: _idlc.Reading", ") -> _idlc.Codec:")


def _has_arrays(interface: ir.Interface) -> bool:
    """Whether a module holds fixed-size numeric arrays itself and so imports numpy."""
    return any(
        fields.support(field.type) == "array"
        for message in derive.messages(interface)
        for field in message.fields
    )


def _codec_imports(
    needed: list[ir.TypeName], references: References, kind: ir.Kind, arrays: bool
) -> list[str]:
    """Return the imports inside a codec: what only it needs, and only when it is used."""
    inside, outside = references.imports(needed, kind)
    if arrays:
        inside.insert(0, "from .._idlc import arrays as _arrays")
    result = [f"    {line}" for line in wrapped(inside)]
    if outside:
        result += [""] if inside else []
        result.append("    with _idlc.importing():")
        result += [f"        {line}" for line in wrapped(outside)]
    return [*result, ""] if result else []


def _body(structure: ir.Message, views: list[fields.FieldView]) -> list[str]:
    """Return the class's docstring, names, constants and fields."""
    public = [f'"{pynames.field(field.name)}"' for field in structure.fields]
    types = tuple(f'"{field.name}": "{fields.idl_text(field.type)}"' for field in structure.fields)
    doc = documentation.message(structure, f"{structure.name}.")
    return [
        *literals.docstring(doc, 4),
        "",
        *lines(tuple_of(*public), 4, "__match_args__ = "),
        *lines(_table(types), 4, "_fields_and_field_types = "),
        *_separated(_constants(structure)),
        *_separated([_declaration(view) for view in views]),
    ]


def _declaration(view: fields.FieldView) -> str:
    # type checkers take a field of a method's name for a mistake
    ignore = "  # type: ignore[assignment]" if pynames.hides_method(view.name) else ""
    return f"    {view.declaration}{ignore}"


def _table(items: tuple[str, ...]) -> Group:
    return call("_idlc.table", Group("", items, brackets="{}"))


def _separated(block: list[str]) -> list[str]:
    return ["", *block] if block else []


def _field_views(structure: ir.Message, references: References) -> list[fields.FieldView]:
    receiver, qualify = _receiver(structure), fields.shadows(structure)
    return [fields.view(field, references, receiver, qualify) for field in structure.fields]


def _receiver(structure: ir.Message) -> str:
    # no field can begin with an underscore
    return "_self" if any(field.name == "self" for field in structure.fields) else "self"


def _init(structure: ir.Message, views: list[fields.FieldView]) -> list[str]:
    """Return the constructor."""
    receiver = _receiver(structure)
    options = "_options" if any(f.name == "options" for f in structure.fields) else "options"
    doubts = [options, *(view.doubt for view in views[:1] if view.doubt)]
    return [
        "    def __init__(",
        f"        {receiver},",
        *(f"        {view.parameter}," for view in views),
        f"        **{options}: _idlc.Unpack[_idlc.Options],",
        "    ) -> None:",
        *if_any(doubts, call("_idlc.construct", receiver, options, "locals()"), 8),
        "            return",
        *(line for view in views for line in view.stores),
    ]


def _makers(
    own: ir.TypeName, steps: tuple[wire_plan.Step, ...], references: References, tables: Tables
) -> tuple[dict[ir.TypeName, str], list[ir.TypeName]]:
    """Return the functions that make empty objects, and the types to import for them."""
    makers: dict[ir.TypeName, str] = {}
    for type_ in (own, *_types(steps)):
        if type_ not in makers:
            name = references.name(type_)
            wanted = f"new_{snake_case(type_.name)}".replace("__", "_")
            maker = call("_idlc.maker", name)
            makers[type_] = tables.define(wanted, f"maker {name}", maker)
    known = references.own | references.direct
    return makers, [type_ for type_ in makers if type_ not in known]


def _types(steps: tuple[wire_plan.Step, ...]) -> list[ir.TypeName]:
    found: list[ir.TypeName] = []
    for step in steps:
        if isinstance(step, wire_plan.Enter):
            found.append(step.type)
        elif isinstance(step, wire_plan.Items):
            found += [step.type, *_types(step.body)]
    return found


def _constants(structure: ir.Message) -> list[str]:
    result = []
    for constant in structure.constants:
        result += assign(constant.name, literals.scalar(constant.type, constant.value), 4)
    for field in structure.fields:
        if field.default is not None:
            result += fields.default_constant(field)
    return result
