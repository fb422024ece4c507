"""The view of a field in its class: annotation, parameter, default and storing."""

from __future__ import annotations

from typing import NamedTuple

import msgspec

from idlc.generate.python import lines
from idlc.generate.python.imports import References
from idlc.generate.python.lines import (
    WIDTH,
    Group,
    Node,
    assign,
    call,
    docstring,
    flat,
    prose,
    tuple_of,
    wrapped,
)
from idlc.model import derive, ir, python_names
from idlc.model.ir import spell
from idlc.project.templates import Code, Text
from idlc.wire.plan import LIST_PRIMITIVES


class DocstringSection(msgspec.Struct, frozen=True):
    """A list in a docstring, such as that of the attributes."""

    title: Text
    entries: tuple[Text, ...]


class Docstring(msgspec.Struct, frozen=True):
    """A class's docstring: `text` of one or more lines, and lists after it."""

    text: Text
    sections: tuple[DocstringSection, ...] = ()

    @property
    def is_one_line(self) -> bool:
        """True if the closing quotes are on the line of the opening ones."""
        return not self.sections and "\n" not in self.text


def message(structure: ir.Message, purpose: str, entries: tuple[Text, ...], file: str) -> Docstring:
    """Return a message's docstring: its comment, or else its `purpose`, and its fields' entries.

    `file` is the one that defines it, within its package.
    """
    lines = [prose(line) for line in structure.comment] or [purpose]
    if len(lines) > 1 and lines[1]:
        lines.insert(1, "")
    lines += _hidden(structure)
    place = _place(structure, file)
    lines += ["", f"Defined in {place}"] if place else []
    constants = tuple(_constant(c) for c in structure.constants if c.comment or c.unit)
    sections = (
        DocstringSection(Text("Attributes"), entries),
        DocstringSection(Text("Constants"), constants),
    )
    filled = tuple(section for section in sections if section.entries)
    return Docstring(Text(docstring(lines, one_line=not filled)), filled)


def purposes(interface: ir.Interface) -> dict[ir.TypeName, str]:
    """Return what the messages of a service or action are for, and an action's services."""
    name = interface.name.name
    match interface:
        case ir.Message():
            return {interface.name: f"{interface.name}."}
        case ir.Service():
            return {
                interface.request.name: f"The request of the service {interface.name}.",
                interface.response.name: f"The response of the service {interface.name}.",
                **_event(interface, f"a call of {name}"),
            }
        case ir.Action():
            send, get = derive.services(interface)
            goal = f"a {name} goal"
            words = {
                send.name: f"Starts {goal}",
                send.request.name: f"Sent by a client to start {goal}",
                send.response.name: f"Tells a client whether {goal} was accepted, and when",
                get.name: f"Waits for the result of {goal}",
                get.request.name: f"Sent by a client to wait for the result of {goal}",
                get.response.name: f"Tells a client how {goal} ended, and its result",
                derive.feedback_message(interface).name: f"Published while {goal} is executed",
            }
            return {
                interface.goal.name: f"The goal of the action {interface.name}.",
                interface.result.name: f"The result of the action {interface.name}.",
                interface.feedback.name: f"The feedback of the action {interface.name}.",
                **{type_name: f"{text}. Added by ROS 2." for type_name, text in words.items()},
                **_event(send, f"a call that starts {goal}"),
                **_event(get, "a call that waits for a result"),
            }


def _event(service: ir.Service, call: str) -> dict[ir.TypeName, str]:
    text = f"Published about {call}, where services are introspected. Added by ROS 2."
    return {derive.event(service).name: text}


def _hidden(structure: ir.Message) -> list[str]:
    """Return how to call the methods that fields hide."""
    hidden = [field.name for field in structure.fields if python_names.hides_method(field.name)]
    if not hidden:
        return []
    name = python_names.class_(structure.name)
    text = (
        f"Fields hide the methods of the same name ({', '.join(hidden)}): "
        f"`super({name}, message)` still has them, and `super({name}, {name})` those of the class."
    )
    return ["", *lines.wrapped(text, 4)]


def _place(structure: ir.Message, file: str) -> str:
    """Return the file and line where a structure begins; empty if nobody wrote any of it.

    Later sections have no line: it would change with each field of those before, and people review
    what one more field changes.
    """
    described: list[ir.Field | ir.Constant] = [*structure.fields, *structure.constants]
    spans = [definition.name_span for definition in described if definition.name_span]
    if not spans:
        return ""
    first = min(spans, key=lambda span: span.start)
    if "\n---" in f"\n{first.source.text[: first.start]}":
        return file
    return f"{file}:{first.source.position(first.start)[0]}"


def _constant(constant: ir.Constant) -> Text:
    return entry(constant.name, constant, field_words(constant))


def field_words(described: ir.Field | ir.Constant) -> str:
    """Return the unit and comment of a field or constant, the suffix of its type or name."""
    unit = f" [{lines.prose(described.unit)}]" if described.unit else ""
    comment = " ".join(lines.prose(line).strip() for line in described.comment).strip()
    return unit + (f". {comment}" if comment else "")


def entry(name: str, described: ir.Field | ir.Constant, suffix: str) -> Text:
    """Return the entry of a field or constant in a list, on as many lines as it takes."""
    text = f"{name}: {spell(described.type)}{suffix}"
    return Text("\n".join(lines.wrapped(text, 8, hanging=4)))


def attribute(described: ir.Field | ir.Constant, suffix: str, file: str) -> Text:
    """Return the statement that editors show of a field or constant: its definition and comment.

    The file is named without a line number, which other lines would change. The statement is empty
    for fields that ROS 2 adds: their annotation says it all.
    """
    if described.name_span is None:
        return Text("")
    lines = wrapped(f"{spell(described.type)} {described.name}{suffix} ({file})", 6)
    text = docstring(lines, one_line=True)
    return Text(f'"""{text}"""' if len(lines) == 1 else f'"""{text}\n"""')


ANNOTATIONS = {"bool": "bool", "byte": "bytes", "float32": "float", "float64": "float"}
BUILTINS = frozenset({"bool", "bytes", "float", "int", "list", "str"})


class FieldView(msgspec.Struct, frozen=True, kw_only=True):
    """A field, as text; `store` is a statement on as many lines as it takes.

    `wire_name` and `idl` are its name and type in rosidl.
    """

    name: Code
    wire_name: Code
    idl: Code
    description: Text
    docstring: Text
    annotation: Code
    parameter: Code
    store: Code


class Naming(msgspec.Struct, frozen=True):
    """The names in a class of what its fields could hide: `self` and builtins."""

    receiver: str
    options: str
    builtins: str

    @classmethod
    def of(cls, structure: ir.Message) -> Naming:
        """Return the naming of a structure's class; no field can begin with an underscore."""
        names = {field.name for field in structure.fields}
        return cls(
            receiver="_self" if "self" in names else "self",
            options="_options" if "options" in names else "options",
            builtins="_builtins." if shadows(structure) else "",
        )


def shadows(structure: ir.Message) -> bool:
    """Return whether the class needs a builtin whose name a field has."""
    return any(python_names.field(field.name) in BUILTINS for field in structure.fields)


def support(type_: ir.FieldType) -> str:
    """Return what a field needs of the runtime: "sequence", "array" or nothing."""
    if (
        isinstance(type_, (ir.Sequence, ir.Array))
        and isinstance(type_.element, ir.Primitive)
        and type_.element.name not in LIST_PRIMITIVES
    ):
        return "sequence" if isinstance(type_, ir.Sequence) else "array"
    return ""


def numeric_class(type_: ir.Sequence | ir.Array) -> str:
    """Return the descriptor class of a numeric array."""
    assert isinstance(type_.element, ir.Primitive)
    name = ir.PRIMITIVES[type_.element.name].dtype
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


def view(
    field: ir.Field, references: References, naming: Naming, file: str, *, converts: bool
) -> FieldView:
    """Return the view of a field; `file` is the one that defines it.

    With `converts`, `None` is the default of any field, and a list is made of any iterable.
    """
    name = python_names.field(field.name)
    slot = f"{naming.receiver}.{python_names.slot(field.name)}"
    shape = _shape(field, references, naming, converts=converts)
    words = field_words(field)
    return FieldView(
        name=Code(name),
        wire_name=Code(field.name),
        idl=Code(idl_text(field.type)),
        description=entry(name, field, words),
        docstring=attribute(field, words, file),
        annotation=Code(shape.annotation + _ignored(name)),
        parameter=Code(shape.parameter),
        store=Code("\n".join(_store(slot, name, shape)).lstrip()),
    )


def doubt(
    structure: ir.Message, references: References, naming: Naming, *, converts: bool
) -> tuple[str, ...]:
    """Return conditions that all hold for a first argument that is perhaps not of its field's type.

    There are none for a field of numbers, which converts any argument.
    """
    first = structure.fields[:1]
    return _shape(first[0], references, naming, converts=converts).doubt if first else ()


class _Shape(NamedTuple):
    """The code that fields of one kind share: annotations, and the value stored in the slot.

    `fresh` is the default of a field whose parameter is None without an argument.
    """

    annotation: str
    parameter: str
    stored: Node
    fresh: Node = ""
    doubt: tuple[str, ...] = ()


def _shape(field: ir.Field, references: References, naming: Naming, *, converts: bool) -> _Shape:
    name = python_names.field(field.name)
    kind = f"{name}.__class__"  # faster than a call, and no field can hide it
    if isinstance(field.type, (ir.Primitive, ir.String)):
        annotation = naming.builtins + _element(field.type, references)
        default = _scalar_default(field)
        unlike = f"{kind} is not {annotation}"
        if not converts:
            return _Shape(annotation, f"{annotation} = {default}", name, doubt=(unlike,))
        parameter = f"{annotation} | None = None"
        return _Shape(annotation, parameter, name, default, (f"{name} is not None", unlike))
    if support(field.type):
        return _numbers(field, name)
    if isinstance(field.type, ir.Ref):
        annotation = _element(field.type, references)
        fresh: Node = f"{annotation}()"
        expected = "" if field.type.target in references.implied else annotation
    else:
        element = _element(ir.element_of(field.type), references)
        inner = naming.builtins + element if element in BUILTINS else element
        expected = f"{naming.builtins}list"
        annotation = f"{expected}[{inner}]"
        fresh = _fresh_list(field, references)
    doubt = (f"{name} is not None", *([f"{kind} is not {expected}"] if expected else []))
    if converts and not isinstance(field.type, ir.Ref):
        inside = getattr(ir.element_of(field.type), "name", "")
        read = [f"_idlc.read_{LIST_PRIMITIVES[inside]}"] if inside in LIST_PRIMITIVES else []
        stored = call("_idlc.to_list", name, f'"{name}"', *read)
        declared = assign(f"{name}: _idlc.ListOf[{inner}]", f"_idlc.ListOf({', '.join(read)})", 4)
        annotation = "\n".join(declared).strip().removeprefix(f"{name}: ")
        parameter = f"_idlc.Iterable[{inner}] | None = None"
        if len(name) + len(parameter) + 11 > WIDTH:
            parameter = parameter.replace(" |", "\n        |")
        return _Shape(annotation, parameter, stored, fresh, doubt)
    return _Shape(annotation, f"{annotation} | None = None", name, fresh, doubt)


def _ignored(name: str) -> str:
    # type checkers take a field of a method's name for a mistake
    return "  # type: ignore[assignment]" if python_names.hides_method(name) else ""


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


def _store(slot: str, name: str, shape: _Shape) -> list[str]:
    """Return the statement that gives a slot its value, indented as in the constructor."""
    if not shape.fresh:
        return assign(slot, shape.stored, 8)
    line = f"        {slot} = {flat(shape.fresh)} if {name} is None else {flat(shape.stored)}"
    if len(line) <= WIDTH:
        return [line]
    return [
        f"        if {name} is None:",
        *assign(slot, shape.fresh, 12),
        "        else:",
        *assign(slot, shape.stored, 12),
    ]


def _scalar_default(field: ir.Field) -> str:
    assert isinstance(field.type, (ir.Primitive, ir.String))
    if field.default is not None and not isinstance(field.default.value, tuple):
        return lines.scalar(field.type, field.default.value)
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
    return tuple(lines.scalar(ir.element_of(field.type), value) for value in values)


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
    dtype = f"_arrays.{ir.PRIMITIVES[field.type.element.name].dtype.upper()}"
    if values is None:
        return call("_arrays.zeros", str(field.type.size), dtype)
    return call("_arrays.array", tuple_of(*values), dtype)


def _numbers(field: ir.Field, name: str) -> _Shape:
    assert isinstance(field.type, (ir.Sequence, ir.Array))
    assert isinstance(field.type.element, ir.Primitive)
    kind = numeric_class(field.type)
    fresh = _fresh_numbers(field)
    if isinstance(field.type, ir.Sequence):
        code = f'"{field.type.element.info.code}"'
        values = "_idlc.Floats" if kind.startswith("Float") else "_idlc.Integers"
        annotation = f"_idlc.{kind} = _idlc.{kind}()"
        stored = call("_idlc.to_array", code, name, f'"{name}"')
    else:
        dtype = f"_arrays.{ir.PRIMITIVES[field.type.element.name].dtype.upper()}"
        values = "_arrays.Values"
        annotation = f"_arrays.{kind} = _arrays.{kind}({field.type.size})"
        stored = call("_arrays.to_ndarray", dtype, str(field.type.size), name, f'"{name}"')
    return _Shape(annotation, f"{values} | None = None", stored, fresh)


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
