"""How one field looks in its class: annotation, parameter, default and storing."""

from __future__ import annotations

import msgspec

from idlc.emit import literals, pynames
from idlc.emit.codec.constants import numpy_name
from idlc.emit.python_lines import WIDTH, Group, Node, assign, call, flat, tuple_of
from idlc.emit.references import References
from idlc.model import ir

ANNOTATIONS = {"bool": "bool", "byte": "bytes", "float32": "float", "float64": "float"}
LISTS = frozenset({"bool", "byte"})
BUILTINS = frozenset({"bool", "bytes", "float", "int", "list", "str"})


class FieldView(msgspec.Struct, frozen=True):
    """A field: its line in the class, its parameter, and the lines that store it.

    `doubt` is true, in the constructor, for an argument that is perhaps not of the field's type.
    A field of numbers has none, because it converts what it is given.
    """

    name: str
    declaration: str
    parameter: str
    stores: tuple[str, ...]
    doubt: str = ""


def shadows(structure: ir.Message) -> bool:
    """Whether a field has the name of a type that annotations need."""
    return any(pynames.field(field.name) in BUILTINS for field in structure.fields)


def support(type_: ir.FieldType) -> str:
    """Return what a field needs of the runtime: "sequence", "array" or nothing."""
    if (
        isinstance(type_, (ir.Sequence, ir.Array))
        and isinstance(type_.element, ir.Primitive)
        and type_.element.name not in LISTS
    ):
        return "sequence" if isinstance(type_, ir.Sequence) else "array"
    return ""


def numeric_class(type_: ir.Sequence | ir.Array) -> str:
    """Return the descriptor class of a numeric array."""
    assert isinstance(type_.element, ir.Primitive)
    name = numpy_name(type_.element.name)
    stem = name.replace("uint", "UInt") if name.startswith("u") else name.capitalize()
    return stem + ("Sequence" if isinstance(type_, ir.Sequence) else "Array")


def idl_text(type_: ir.FieldType) -> str:
    """Return a type as rosidl's `get_fields_and_field_types` spells it."""
    match type_:
        case ir.Array(element, size):
            return f"{idl_text(element)}[{size}]"
        case ir.Sequence(element, bound):
            limit = "" if bound is None else f", {bound}"
            return f"sequence<{idl_text(element)}{limit}>"
        case ir.String(wide, bound):
            return ("wstring" if wide else "string") + ("" if bound is None else f"<{bound}>")
        case ir.Ref(target):
            return f"{target.package}/{target.name}"
        case ir.Primitive():
            return type_.info.idl
        case ir.Unknown():
            raise ValueError("an unknown type cannot be emitted")


def view(field: ir.Field, references: References, receiver: str, qualify: bool) -> FieldView:
    """Return the view of a field; `qualify` spells builtin types as attributes.

    `receiver` is what the constructor calls the object.
    """
    name = pynames.field(field.name)
    slot = f"{receiver}.{pynames.slot(field.name)}"
    prefix = "_builtins." if qualify else ""
    needs = support(field.type)
    if isinstance(field.type, (ir.Primitive, ir.String)):
        annotation = prefix + _element(field.type, references)
        default = _scalar_default(field)
        return FieldView(
            name,
            f"{name}: {annotation}",
            f"{name}: {annotation} = {default}",
            tuple(assign(slot, name, 8)),
            f"{name}.__class__ is not {annotation}",
        )
    if needs:
        return _numeric(field, name, slot)
    if isinstance(field.type, ir.Ref):
        annotation = _element(field.type, references)
        fresh = _fresh_message(field.type.target, references)
        known = "" if field.type.target in references.implied else annotation
    else:
        element = _element(ir.element_of(field.type), references)
        inner = prefix + element if element in BUILTINS else element
        annotation = f"{prefix}list[{inner}]"
        fresh = _fresh_list(field, references)
        known = f"{prefix}list"
    doubt = f"{name} is not None"
    if known:
        doubt = f"({doubt} and {name}.__class__ is not {known})"
    return FieldView(
        name,
        f"{name}: {annotation}",
        f"{name}: {annotation} | None = None",
        tuple(_store(slot, name, fresh, name)),
        doubt,
    )


def _element(element: ir.Element, references: References) -> str:
    match element:
        case ir.Primitive(name):
            return ANNOTATIONS.get(name, "int")
        case ir.String():
            return "str"
        case ir.Ref(target):
            return references.annotation(target)
        case ir.Unknown():
            raise ValueError("an unknown type cannot be emitted")


def _store(slot: str, name: str, fresh: Node, given: Node) -> list[str]:
    one = f"        {slot} = {flat(fresh)} if {name} is None else {flat(given)}"
    if len(one) <= 88:
        return [one]
    return [
        f"        if {name} is None:",
        *assign(slot, fresh, 12),
        "        else:",
        *assign(slot, given, 12),
    ]


def _fresh_message(target: ir.TypeName, references: References) -> Node:
    return f"{references.annotation(target)}()"


def _scalar_default(field: ir.Field) -> str:
    assert isinstance(field.type, (ir.Primitive, ir.String))
    if field.default is not None and not isinstance(field.default.value, tuple):
        return literals.scalar(field.type, field.default.value)
    return zero(field.type)


def zero(element: ir.Element) -> str:
    """Return the literal of the value without a declared default."""
    match element:
        case ir.Primitive("bool"):
            return "False"
        case ir.Primitive("byte"):
            return 'b"\\x00"'
        case ir.Primitive("float32" | "float64"):
            return "0.0"
        case ir.String():
            return '""'
        case _:
            return "0"


def _values(field: ir.Field) -> tuple[str, ...] | None:
    if field.default is None:
        return None
    values = field.default.value
    assert isinstance(values, tuple)
    return tuple(literals.scalar(ir.element_of(field.type), value) for value in values)


def _fresh_list(field: ir.Field, references: References) -> Node:
    values = _values(field)
    if values is not None:
        return Group("", values, brackets="[]")
    if isinstance(field.type, ir.Array):
        element = field.type.element
        if isinstance(element, ir.Ref):
            return call("_idlc.several", references.name(element.target), str(field.type.size))
        return f"[{zero(element)}] * {field.type.size}"
    return "[]"


def _fresh_numbers(field: ir.Field) -> Node:
    values = _values(field)
    assert isinstance(field.type, (ir.Sequence, ir.Array))
    assert isinstance(field.type.element, ir.Primitive)
    if isinstance(field.type, ir.Sequence):
        code = f'"{field.type.element.info.code}"'
        return call("_array", code, *([tuple_of(*values)] if values else []))
    dtype = f"_arrays.{numpy_name(field.type.element.name).upper()}"
    if values is None:
        return call("_arrays.zeros", str(field.type.size), dtype)
    return call("_arrays.array", tuple_of(*values), dtype)


def _numeric(field: ir.Field, name: str, slot: str) -> FieldView:
    assert isinstance(field.type, (ir.Sequence, ir.Array))
    assert isinstance(field.type.element, ir.Primitive)
    kind = numeric_class(field.type)
    fresh = _fresh_numbers(field)
    if isinstance(field.type, ir.Sequence):
        code = f'"{field.type.element.info.code}"'
        values = "_idlc.Floats" if kind.startswith("Float") else "_idlc.Integers"
        declaration = f"{name}: _idlc.{kind} = _idlc.{kind}()"
        given = call("_idlc.to_array", code, name, f'"{name}"')
    else:
        dtype = f"_arrays.{numpy_name(field.type.element.name).upper()}"
        values = "_arrays.Values"
        declaration = f"{name}: _arrays.{kind} = _arrays.{kind}({field.type.size})"
        given = call("_arrays.to_ndarray", dtype, str(field.type.size), name, f'"{name}"')
    return FieldView(
        name,
        declaration,
        f"{name}: {values} | None = None",
        tuple(_store(slot, name, fresh, given)),
    )


def comparison(field: ir.Field, receiver: str, references: References) -> str | Group:
    """Return the expression that tells whether a field is equal in `receiver` and `other`.

    It is a call for what may be an array, what has no type, and what is too long for a line.
    """
    slot = pynames.slot(field.name)
    plain = f"{receiver}.{slot} == other.{slot}"
    values = isinstance(field.type, (ir.Array, ir.Sequence)) and isinstance(
        field.type.element, ir.Primitive
    )
    element = ir.element_of(field.type)
    untyped = isinstance(element, ir.Ref) and element.target in references.implied
    if values or untyped or len(plain) > WIDTH - 16:
        return call("_idlc.same", f"{receiver}.{slot}", f"other.{slot}")
    return plain


def default_constant(field: ir.Field) -> list[str]:
    """Return the lines of the class attribute FIELD__DEFAULT."""
    name = f"{field.name.upper()}__DEFAULT"
    if isinstance(field.type, (ir.Primitive, ir.String)):
        return assign(name, _scalar_default(field), 4)
    if not support(field.type):
        return assign(name, call("_idlc.FreshList", *(_values(field) or ())), 4)
    fresh = _fresh_numbers(field)
    assert isinstance(fresh, Group)
    return assign(name, call("_idlc.Fresh", fresh.before, *fresh.items), 4)
