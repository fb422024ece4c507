"""The view of a field in its class: annotation, parameter, default and storing."""

from __future__ import annotations

from textwrap import dedent
from typing import NamedTuple

import msgspec

from idlc.generate.python import literals
from idlc.generate.python.imports import References
from idlc.generate.templates import Code, EscapedText
from idlc.model import comments, ir, python_names
from idlc.model.idl_text import idl_text
from idlc.model.ir import spell
from idlc.wire.plan import LIST_PRIMITIVES


class Docstring(msgspec.Struct, frozen=True):
    """A docstring: its first line, which may be empty for none at all, and those after a blank."""

    line: EscapedText
    more: tuple[EscapedText, ...] = ()


def message(structure: ir.Message, purpose: str, file: str) -> Docstring:
    """Return a class's docstring: the structure's comment, or else its `purpose`.

    `file` is the one that defines it, within its package.
    """
    described: list[ir.Field | ir.Constant] = [*structure.fields, *structure.constants]
    spans = [definition.name_span for definition in described if definition.name_span]
    place = ""
    if spans:  # somebody wrote some of it
        source, start, _ = min(spans, key=lambda span: span.start)
        # The line of a later section would change with each field of those before, and people
        # review what one more field changes.
        is_later = "\n---" in f"\n{source.text[:start]}"
        place = file if is_later else f"{file}:{source.position(start)[0]}"
    comment = _lines(structure.comment)
    names = [field.name for field in structure.fields if field.name in python_names.METHODS]
    if not comment and not names and place:
        purpose, place = f"{purpose.removesuffix('.')}, defined in {place}.", ""
    line, *more = comment or [purpose]
    if more and not more[0]:
        del more[0]
    class_ = python_names.class_(structure.name)
    methods = f"super({class_}, message)", f"super({class_}, {class_})"
    hidden = [
        f"Fields hide the methods of the same name ({', '.join(names)}):",
        f"`{methods[0]}` still has them, and `{methods[1]}` those of the class.",
    ]
    for paragraph in (hidden if names else [], [f"Defined in {place}"] if place else []):
        if paragraph:
            more += ["", *paragraph] if more else paragraph
    return Docstring(literals.between_quotes(line), tuple(map(EscapedText, more)))


def purposes(interface: ir.Interface) -> list[str]:
    """Return what each section of an interface is for."""
    match interface:
        case ir.Message():
            return [f"{interface.name}."]
        case ir.Service():
            kind, sections = "service", ["request", "response"]
        case ir.Action():
            kind, sections = "action", ["goal", "result", "feedback"]
    return [f"The {section} of the {kind} {interface.name}." for section in sections]


def attribute(described: ir.Field | ir.Constant, file: str) -> Docstring:
    """Return what editors show of a field or constant: its definition and comment.

    The file is named without a line number, which other lines would change. There is nothing for
    fields that ROS 2 adds: their annotation says it all.
    """
    if described.name_span is None:
        return Docstring(EscapedText(""))
    unit = f" [{literals.prose(described.unit)}]" if described.unit else ""
    definition = f"{spell(described.type)} {described.name}{unit}"
    comment = _lines(described.comment)
    if len(comment) > 1:
        return Docstring(EscapedText(f"{definition} ({file})"), tuple(map(EscapedText, comment)))
    words = f". {comment[0]}" if comment else ""
    return Docstring(EscapedText(f"{definition}{words} ({file})"))


def _lines(comment: tuple[str, ...]) -> list[str]:
    """Return a comment as lines of a docstring; blank ones around it are left out."""
    text = dedent("\n".join(map(literals.prose, comment))).strip("\n")
    return text.split("\n") if text else []


ANNOTATIONS = {"bool": "bool", "byte": "bytes", "float32": "float", "float64": "float"}
ZEROS = {"bool": "False", "byte": 'b"\\x00"', "float32": "0.0", "float64": "0.0"}
BUILTINS = frozenset({"bool", "bytes", "float", "int", "list", "locals", "object", "str"})


class FieldView(msgspec.Struct, frozen=True, kw_only=True):
    """A field. `wire_name` and `idl` are its name and type in rosidl.

    `fresh` is the default of a field whose parameter is None without an argument. Assigning to a
    field of `numbers` takes longer than to its slot, because it converts them. `is_array`: the
    field is equal to another with the same elements, whatever holds them. A deprecated field has
    the name of a descriptor, which type checkers see, and says what to use: it is read as `read`
    and takes `values`.
    """

    name: Code
    wire_name: Code
    slot: Code
    idl: Code
    annotation: Code
    parameter: Code
    fresh: Code
    docstring: Docstring
    numbers: bool
    is_scalar: bool
    is_array: bool
    descriptor: Code
    deprecation: Code
    read: Code
    values: Code


class Naming(msgspec.Struct, frozen=True):
    """The names in a class of what its fields could hide: `self`, keywords and builtins' module."""

    receiver: Code
    options: Code
    builtins: Code

    @classmethod
    def of(cls, structure: ir.Message) -> Naming:
        """Return the naming of a structure's class; no field can begin with an underscore."""
        names = {field.name for field in structure.fields}
        return cls(
            receiver=Code("_self" if "self" in names else "self"),
            options=Code("_options" if "options" in names else "options"),
            builtins=Code("_builtins." if shadows(structure) else ""),
        )


def shadows(structure: ir.Message) -> bool:
    """Return whether a field has the name of a builtin that the class needs."""
    return any(python_names.field(field.name) in BUILTINS for field in structure.fields)


def number_info(type_: ir.FieldType) -> ir.PrimitiveInfo | None:
    """Return the facts of the elements of a numeric array; `None` for any other type."""
    match type_:
        case ir.Sequence(ir.Primitive(name)) | ir.Array(ir.Primitive(name)):
            return None if name in LIST_PRIMITIVES else ir.PRIMITIVES[name]
    return None


def numeric_class(type_: ir.FieldType, info: ir.PrimitiveInfo) -> str:
    """Return the descriptor class of a numeric array."""
    name = info.dtype
    stem = name.replace("uint", "UInt") if name.startswith("u") else name.capitalize()
    return f"_idlc.{stem}Sequence" if isinstance(type_, ir.Sequence) else f"_arrays.{stem}Array"


def view(field: ir.Field, references: References, naming: Naming, enum: str = "") -> FieldView:
    """Return the view of a field; `enum` is the class of its values.

    If the class converts values, `None` is the default, and a list is made of any iterable.
    """
    name = python_names.field(field.name)
    shape = _shape(field, references, naming, enum)
    deprecation = comments.deprecation(field.comment)
    ignored = ""
    if name in python_names.METHODS:  # type checkers take that for a mistake
        ignored, deprecation = "  # type: ignore[assignment]", None
    is_list = isinstance(field.type, (ir.Array, ir.Sequence))
    return FieldView(
        name=Code(name),
        wire_name=Code(field.name),
        slot=Code(python_names.slot(field.name)),
        idl=Code(idl_text(field.type)),
        annotation=Code(shape.annotation + ignored),
        parameter=Code(f"{shape.values} = {shape.default}"),
        fresh=Code(shape.fresh),
        docstring=attribute(field, references.file),
        numbers=number_info(field.type) is not None,
        is_scalar=isinstance(field.type, (ir.Primitive, ir.String)),
        is_array=is_list and isinstance(ir.element_of(field.type), ir.Primitive),
        descriptor=Code(f"{python_names.slot(field.name)}_" if deprecation else ""),
        deprecation=Code(literals.string_literal(deprecation or "")),
        read=Code(shape.read),
        values=Code(shape.values.removesuffix(" | None")),
    )


def usual_class(field: ir.Field, references: References, naming: Naming) -> Code:
    """Return the class of what is usually assigned to a field; empty if it takes any values."""
    if number_info(field.type):
        return Code("")
    if isinstance(field.type, (ir.Array, ir.Sequence)):
        return Code(f"{naming.builtins}list")
    return Code(_builtin(_element(field.type, references), naming))


class _Shape(NamedTuple):
    """The type, annotation, parameter values and default of a field."""

    read: str
    annotation: str
    values: str
    default: str = "None"
    fresh: str = ""


def _shape(field: ir.Field, references: References, naming: Naming, enum: str) -> _Shape:
    element = _builtin(_element(ir.element_of(field.type), references), naming)
    if isinstance(field.type, (ir.Primitive, ir.String)):
        element = f"{enum} | {element}" if enum else element
        declared = field.default and default(field.type, field.default.value)[0]
        value = declared or zero(field.type)
        if references.converts:
            return _Shape(element, element, f"{element} | None", fresh=value)
        return _Shape(element, element, element, value)
    if isinstance(field.type, ir.Ref):
        return _Shape(element, element, f"{element} | None", fresh=f"{element}()")
    read = f"{naming.builtins}list[{element}]"
    if info := number_info(field.type):
        read, annotation, values, fresh = _numbers(field.type, info)
    elif references.converts:
        inside = getattr(ir.element_of(field.type), "name", "")
        function = f"_idlc.read_{LIST_PRIMITIVES[inside]}" if inside in LIST_PRIMITIVES else ""
        annotation = f"_idlc.ListOf[{element}] = _idlc.ListOf({function})"
        values, fresh = f"_idlc.Iterable[{element}]", _fresh_list(field, references)
    else:
        annotation = values = read
        fresh = _fresh_list(field, references)
    if field.default is not None:
        fresh = f"{naming.receiver}.{default_name(field)}"
    return _Shape(read, annotation, f"{values} | None", fresh=fresh)


def _builtin(name: str, naming: Naming) -> str:
    return naming.builtins + name if name in BUILTINS else name


def _element(element: ir.Element, references: References) -> str:
    match element:
        case ir.Primitive(name):
            return ANNOTATIONS.get(name, "int")
        case ir.String():
            return "str"
        case ir.Ref(target):
            return references.name(target)
        case ir.Unknown():
            raise ValueError("an unknown type cannot be emitted")


def zero(element: ir.Element) -> str:
    """Return the literal of the value without a declared default."""
    if isinstance(element, ir.Primitive):
        return ZEROS.get(element.name, "0")
    return '""'


def _fresh_list(field: ir.Field, references: References) -> str:
    if isinstance(field.type, ir.Array):
        element = field.type.element
        if isinstance(element, ir.Ref):
            return f"_idlc.several({references.name(element.target)}, {field.type.size})"
        return f"[{zero(element)}] * {field.type.size}"
    return "[]"


def _numbers(type_: ir.FieldType, info: ir.PrimitiveInfo) -> tuple[str, str, str, str]:
    """Return what an array of numbers is read as, its annotation, values and fresh default."""
    descriptor = numeric_class(type_, info)
    if isinstance(type_, ir.Array):
        fresh = f"_arrays.zeros({type_.size}, _arrays.{info.dtype.upper()})"
        annotation = f"{descriptor} = {descriptor}({type_.size})"
        return f"_NDArray[_np.{info.dtype}]", annotation, "_arrays.Values", fresh
    number, values = ("int", "Integers") if info.low is not None else ("float", "Floats")
    annotation = f"{descriptor} = {descriptor}()"
    return f"_idlc.array[{number}]", annotation, f"_idlc.{values}", f'_array("{info.code}")'


def default_name(field: ir.Field) -> str:
    """Return the class attribute that holds a field's declared default."""
    return f"{field.name.upper()}__DEFAULT"


def default(type_: ir.FieldType, value: ir.Value) -> tuple[Code, tuple[Code, ...]]:
    """Return a declared default of a type: an expression, or a function and its arguments."""
    element = ir.element_of(type_)
    if not isinstance(value, tuple):
        return Code(literals.scalar(element, value)), ()
    values = tuple(Code(literals.scalar(element, item)) for item in value)
    if info := number_info(type_):
        return Code("_idlc.Fresh"), (Code(f"{numeric_class(type_, info)}.of"), *values)
    return Code("_idlc.FreshList" if values else "_idlc.FreshList()"), values
