"""Type descriptions → messages: the inverse of `describe`, for descriptions from running programs.

A description comes from another program. It is accepted only if it is complete and has the type
hash that the program announces; idlc prints its names, and uses them for nothing else.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import one_line
from idlc.language.parse import parse
from idlc.model import catalog, ir
from idlc.model.describe import (
    ARRAY_OFFSET,
    STRING_TYPE_IDS,
    DescriptionDict,
    FieldDict,
    IndividualDict,
    TypeDict,
    individual,
)
from idlc.model.distros import NEWEST
from idlc.model.ir import spell
from idlc.model.link import Model, circles, link
from idlc.model.lowering.lower import lower

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_PRIMITIVES = {
    info.type_id: ir.Primitive(name) for name, info in ir.PRIMITIVES.items() if name != "char"
}
_STRINGS = {type_id: kind for kind, type_id in STRING_TYPE_IDS.items()}


class DescriptionError(ValueError):
    """A description is incomplete or contradicts its hash; the text gives the reason."""


def model_of_description(
    description: DescriptionDict, name: str, type_hash: str, program: str
) -> Model:
    """Return the model of a type of this name and hash, as `program` describes it.

    Raises DescriptionError. Each message has a source of its own, for locations in it.
    """
    messages: dict[ir.TypeName, ir.Message] = {}
    for part in (description["type_description"], *description["referenced_type_descriptions"]):
        message = message_of(part, program)
        if message.name in messages:
            raise DescriptionError(f"it describes `{message.name}` twice")
        messages[message.name] = message
    for message in messages.values():
        for target in message.references:
            if target not in messages:
                raise DescriptionError(f"it does not describe `{target}`")
    if next(circles(messages, lambda name: messages[name].holders, set()), None):
        raise DescriptionError("it describes a message that contains itself")
    top = next(iter(messages))
    if str(top) != name:
        raise DescriptionError(f"it describes `{one_line(str(top))}` instead")
    model = Model(top.package, (messages[top],), messages)
    if model.describer.hash(name) != type_hash:
        raise DescriptionError("its description has another type hash")
    return model


def message_of(part: IndividualDict, program: str) -> ir.Message:
    """Return the message that one description describes; raises DescriptionError."""
    name = _type_name(part["type_name"])
    bare: list[FieldDict] = [{**field, "default_value": ""} for field in part["fields"]]
    written = part["fields"] if bare != individual(ir.Message(name=name))["fields"] else []
    types: dict[str, ir.FieldType] = {}
    for field in written:
        if not _NAME.fullmatch(field["name"]) or field["name"] in types:
            raise DescriptionError(f"`{one_line(field['name'])}` is not the name of one field")
        types[field["name"]] = _type(field["type"])
    lines = {field: spell(type_, name.package) for field, type_ in types.items()}
    text = "".join(f"{type_} {field}\n" for field, type_ in lines.items())
    source = Source(f"{name} ({program})", text)
    fields: list[ir.Field] = []
    start = 0
    for own, type_ in types.items():
        middle = start + len(lines[own])
        end = middle + 1 + len(own)
        spans = Span(source, start, middle), Span(source, middle + 1, end)
        fields.append(ir.Field(name=own, type=type_, type_span=spans[0], name_span=spans[1]))
        start = end + 1
    return ir.Message(name=name, source=source, fields=tuple(fields))


def _type_name(text: str) -> ir.TypeName:
    try:
        name = ir.TypeName.parse(text)
    except ValueError:
        name = ir.TypeName("", "msg", "")
    if not (_NAME.fullmatch(name.package) and _NAME.fullmatch(name.name)):
        raise DescriptionError(f"`{one_line(text)}` is not the name of a type")
    return name


def _type(type_: TypeDict) -> ir.FieldType:
    shape, element_id = divmod(type_["type_id"], ARRAY_OFFSET)
    element: ir.Element
    if element_id == 1:
        element = ir.Ref(_type_name(type_["nested_type_name"]))
    elif element_id in _STRINGS:
        wide, bounded = _STRINGS[element_id]
        element = ir.String(wide, type_["string_capacity"] if bounded else None)
    elif element_id in _PRIMITIVES:
        element = _PRIMITIVES[element_id]
    else:
        raise DescriptionError(f"it uses type {element_id}, which .msg files do not have")
    match shape:
        case 0:
            return element
        case 1:
            return ir.Array(element, type_["capacity"])
        case 2:
            return ir.Sequence(element, type_["capacity"])
        case 3:
            return ir.Sequence(element)
    raise DescriptionError(f"it uses the unknown type {type_['type_id']}")


#: Characters of all sources together; more are left alone.
MAX_TEXT = 1 << 20


def model_of_sources(
    texts: Mapping[ir.TypeName, str], name: ir.TypeName, type_hash: str, program: str = "a node"
) -> Model | None:
    """Return the model of texts, if the type `name` has this hash in it."""
    if sum(map(len, texts.values())) > MAX_TEXT:
        return None
    report = Report()
    own = [
        lower(parse(Source(f"{own} ({program})", text)), own, report, NEWEST)
        for own, text in texts.items()
    ]
    model = link(name.package, own, catalog, report)
    return model if not report.had_errors and model.hash(name) == type_hash else None


def reported_model(
    description: DescriptionDict,
    sources: Mapping[str, str],
    name: str,
    type_hash: str,
    program: str,
) -> Model:
    """Return the model of a type of this name and hash; raises DescriptionError.

    The sources have constants, units and comments, so they are preferred if they have that hash. A
    program may leave them out, and has none for the types that services and actions imply.
    """
    texts = {_type_name(text_name): text for text_name, text in sources.items()}
    top = _type_name(name)
    is_file = top.kind == "msg" and top in texts
    model = model_of_sources(texts, top, type_hash, program) if is_file else None
    return (
        model.only({top}) if model else model_of_description(description, name, type_hash, program)
    )
