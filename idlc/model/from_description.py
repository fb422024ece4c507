"""Type descriptions → messages: the inverse of `describe`, for descriptions from running programs.

A description comes from another program. It is accepted only if it is complete and has the type
hash that the program announces; idlc prints its names, and uses them for nothing else.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from msgspec.structs import replace

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import INCOMPLETE, Source, Span
from idlc.diagnostics.text import one_line
from idlc.language.parse import parse
from idlc.model import catalog, describe, ir
from idlc.model.distros import NEWEST
from idlc.model.ir import spell
from idlc.model.link import Model, circles, link
from idlc.model.lowering.lower import SECTIONS, lower
from idlc.model.node_sources import Defaults, default_of, field_line, field_lines, restore

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_PRIMITIVES = {
    info.type_id: ir.Primitive(name) for name, info in ir.PRIMITIVES.items() if name != "char"
}
_STRINGS = {type_id: kind for kind, type_id in describe.STRING_TYPE_IDS.items()}


class DescriptionError(ValueError):
    """A description is incomplete or contradicts its hash; the text gives the reason."""


def model_of_description(
    description: describe.DescriptionDict, name: str, type_hash: str, program: str
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


def message_of(part: describe.IndividualDict, program: str) -> ir.Message:
    """Return the message that one description describes; raises DescriptionError."""
    name = _type_name(part["type_name"])
    bare: list[describe.FieldDict] = [{**field, "default_value": ""} for field in part["fields"]]
    written = part["fields"] if bare != describe.individual(ir.Message(name=name))["fields"] else []
    bare_fields: dict[str, ir.Field] = {}
    for field in written:
        own = field["name"]
        if not _NAME.fullmatch(own) or own in bare_fields:
            raise DescriptionError(f"`{one_line(own)}` is not the name of one field")
        type_ = _type(field["type"])
        default = default_of(type_, field["default_value"])
        bare_fields[own] = ir.Field(name=own, type=type_, default=default)
    lines = [field_line(field, name.package) for field in bare_fields.values()]
    source = Source(f"{name} ({program})", f"{''.join(lines)}{INCOMPLETE}\n", program)
    fields: list[ir.Field] = []
    start = 0
    for own_field, line in zip(bare_fields.values(), lines, strict=True):
        middle = start + len(spell(own_field.type, name.package))
        spans = (
            Span(source, start, middle),
            Span(source, middle + 1, middle + 1 + len(own_field.name)),
        )
        fields.append(replace(own_field, type_span=spans[0], name_span=spans[1]))
        start += len(line)
    return ir.Message(name=name, source=source, fields=tuple(fields))


def defaults_of(description: describe.DescriptionDict) -> Defaults:
    """Return the default values in a description, as the node sends them."""
    every = (description["type_description"], *description["referenced_type_descriptions"])
    owners = ((_type_name(part["type_name"]), field) for part in every for field in part["fields"])
    return {(name, field["name"]): field["default_value"] for name, field in owners}


def _type_name(text: str) -> ir.TypeName:
    try:
        name = ir.TypeName.parse(text)
    except ValueError:
        name = ir.TypeName("", "msg", "")
    if not (_NAME.fullmatch(name.package) and _NAME.fullmatch(name.name)):
        raise DescriptionError(f"`{one_line(text)}` is not the name of a type")
    return name


def _type(type_: describe.TypeDict) -> ir.FieldType:
    shape, element_id = divmod(type_["type_id"], describe.ARRAY_OFFSET)
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
    """Return the model of texts, if the type `name` has this hash in it.

    The catalogue replaces incomplete texts of standard types if these have that hash, too.
    """
    if sum(map(len, texts.values())) > MAX_TEXT:
        return None
    standard = {own for own, text in texts.items() if INCOMPLETE in text and catalog.source(own)}
    rest = {own: text for own, text in texts.items() if own not in standard}
    model = _model(rest, name, type_hash, program) if standard else None
    return model or _model(texts, name, type_hash, program)


def _model(
    texts: Mapping[ir.TypeName, str], name: ir.TypeName, type_hash: str, program: str
) -> Model | None:
    report = Report()
    own = [
        lower(parse(Source(f"{own} ({program})", text, program)), own, report, NEWEST)
        for own, text in texts.items()
    ]
    model = link(name.package, own, catalog, report)
    return model if not report.had_errors and model.hash(name) == type_hash else None


def reported_model(
    description: describe.DescriptionDict,
    sources: Mapping[str, str],
    name: str,
    type_hash: str,
    program: str,
) -> Model:
    """Return the model of a type of this name and hash; raises DescriptionError.

    The sources have constants, units and comments, so they are preferred if they have that hash. A
    program may leave them out, and has none for the types that services and actions imply.
    """
    described = model_of_description(description, name, type_hash, program)
    top = _type_name(name)
    if top.kind != "msg":
        return described
    texts = node_texts(described.messages, sources, described.messages, defaults_of(description))
    model = model_of_sources(texts, top, type_hash, program)
    return model.only({top}) if model else described


def node_texts(
    names: Iterable[ir.TypeName],
    sources: Mapping[str, str],
    messages: Mapping[ir.TypeName, ir.Message],
    defaults: Defaults,
) -> dict[ir.TypeName, str]:
    """Return texts of interfaces by name: a node's sources as far as they are sound.

    `messages` are described by nodes. Interfaces without a sound source are made of them.
    """
    sources = sources if sum(map(len, sources.values())) <= MAX_TEXT else {}
    texts: dict[ir.TypeName, str] = {}
    for name in names:
        sections = [name._replace(name=name.name + suffix) for suffix in SECTIONS[name.kind]]
        parts = [messages[section] for section in sections if section in messages]
        if len(parts) < len(sections):
            continue
        source = sources.get(str(name))
        text = None if source is None else restore(name, source, parts, defaults)
        if text is None:
            described = (field_lines(part.fields, name.package) for part in parts)
            text = "---\n".join(described) + f"{INCOMPLETE}\n"
        texts[name] = text
    return texts
