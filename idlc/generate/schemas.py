"""An interface in the languages of other tools: JSON Schema, MCAP, and plain facts as JSON."""

from __future__ import annotations

from idlc.model import derive, ir
from idlc.model.comments import deprecation
from idlc.model.ir import spell
from idlc.model.link import Model, held

Json = dict[str, object]

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def facts(interface: ir.Interface, model: Model) -> Json:
    """Return all facts about an interface and the messages that it uses."""
    used = [model.messages[name] for name in held(interface, model)]
    return {
        "name": str(interface.name),
        "hash": model.describer.hash(str(interface.name)) if model.distro.has_hashes else None,
        "structures": [_structure(part) for part in derive.sections(interface)],
        "uses": [_structure(part) for part in used],
    }


def _structure(message: ir.Message) -> Json:
    return {
        "name": str(message.name),
        "comment": list(message.comment),
        "constants": [
            {
                "name": constant.name,
                "type": spell(constant.type),
                "value": constant.value,
                "comment": list(constant.comment),
            }
            for constant in message.constants
        ],
        "fields": [
            {
                "name": field.name,
                "type": spell(field.type),
                "unit": field.unit,
                "comment": list(field.comment),
                **({} if field.default is None else {"default": field.default.value}),
                **({"optional": True} if field.optional else {}),
            }
            for field in message.fields
        ],
    }


def json_schema(interface: ir.Interface, model: Model) -> Json:
    """Return the JSON Schema of the result of `to_dict()`; a service has one for each part."""
    parts = derive.sections(interface)
    used = held(interface, model)
    definitions = {str(name): _object(model.messages[name]) for name in used}
    head: Json = {"$schema": DIALECT, "title": str(interface.name)}
    if len(parts) == 1:
        head |= _object(parts[0])
    else:
        definitions |= {str(part.name): _object(part) for part in parts}
        head["anyOf"] = [_reference(part.name) for part in parts]
    return {**head, "$defs": definitions} if definitions else head


def _reference(name: ir.TypeName) -> Json:
    return {"$ref": "#/$defs/" + str(name).replace("/", "~1")}


def _object(message: ir.Message) -> Json:
    about: Json = {"description": "\n".join(message.comment)} if message.comment else {}
    properties = {}
    for field in message.fields:
        schema = properties[field.name] = _value(field.type)
        if field.comment:
            schema["description"] = "\n".join(field.comment)
        if deprecation(field.comment) is not None:
            schema["deprecated"] = True
        if field.unit:
            schema["x-unit"] = field.unit
        if field.default is not None:
            schema["default"] = field.default.value
    return {
        **about,
        "type": "object",
        "properties": properties,
        "required": [field.name for field in message.fields if field.default is None],
        "additionalProperties": False,
    }


def _value(type_: ir.FieldType) -> Json:
    match type_:
        case ir.Array():
            limits = {"minItems": type_.size, "maxItems": type_.size}
            return {"type": "array", "items": _value(type_.element), **limits}
        case ir.Sequence():
            most = {} if type_.bound is None else {"maxItems": type_.bound}
            return {"type": "array", "items": _value(type_.element), **most}
        case ir.String():
            longest = {} if type_.bound is None else {"maxLength": type_.bound}
            return {"type": "string", **longest}
        case ir.Ref():
            return _reference(type_.target)
        case ir.Primitive("bool"):
            return {"type": "boolean"}
        case ir.Primitive():
            if type_.info.low is None:
                return {"type": "number"}
            return {"type": "integer", "minimum": type_.info.low, "maximum": type_.info.high}
        case ir.Unknown():
            return {}
