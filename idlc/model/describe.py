"""Type descriptions and RIHS01 hashes (language 6), from one place."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import TypedDict

from idlc.model import derive, ir

#: By whether a string is wide, and whether it is bounded.
STRING_TYPE_IDS = {(False, False): 17, (True, False): 18, (False, True): 21, (True, True): 22}
ARRAY_OFFSET = 48
BOUNDED_SEQUENCE_OFFSET = 96
SEQUENCE_OFFSET = 144


class TypeDict(TypedDict):
    """A field's type; key order is part of the hash."""

    type_id: int
    capacity: int
    string_capacity: int
    nested_type_name: str


class FieldDict(TypedDict):
    """A field; key order is part of the hash."""

    name: str
    type: TypeDict
    default_value: str


class IndividualDict(TypedDict):
    """One structure."""

    type_name: str
    fields: list[FieldDict]


class DescriptionDict(TypedDict):
    """One structure and all that it refers to, sorted by name."""

    type_description: IndividualDict
    referenced_type_descriptions: list[IndividualDict]


def type_dict(type_: ir.FieldType) -> TypeDict:
    """Return a type as it enters the type hash."""
    capacity = offset = string_capacity = 0
    nested = ""
    if isinstance(type_, ir.Array):
        capacity, offset = type_.size, ARRAY_OFFSET
    elif isinstance(type_, ir.Sequence):
        capacity = type_.bound or 0
        offset = SEQUENCE_OFFSET if type_.bound is None else BOUNDED_SEQUENCE_OFFSET
    match ir.element_of(type_):
        case ir.Primitive() as element:
            type_id = element.info.type_id
        case ir.String(wide, bound):
            type_id, string_capacity = STRING_TYPE_IDS[wide, bound is not None], bound or 0
        case ir.Ref(target):
            type_id, nested = 1, str(target)
        case ir.Unknown():
            raise ValueError("an unknown type has no description")
    return {
        "type_id": type_id + offset,
        "capacity": capacity,
        "string_capacity": string_capacity,
        "nested_type_name": nested,
    }


def individual(message: ir.Message) -> IndividualDict:
    """Return a structure's own description, the dummy member included."""
    return {
        "type_name": str(message.name),
        "fields": [
            {
                "name": field.name,
                "type": type_dict(field.type),
                "default_value": field.default.text if field.default else "",
            }
            for field in message.wire_fields
        ],
    }


class Describer:
    """Descriptions and hashes over a closed set of interfaces, each made once.

    `interfaces` must hold every interface that is referred to, and no `Unknown` type;
    a missing name raises KeyError.
    """

    def __init__(self, interfaces: Mapping[ir.TypeName, ir.Interface]) -> None:
        self._described: set[ir.TypeName] = set()
        self._individuals: dict[str, IndividualDict] = {}
        self._hashes: dict[str, str] = {}
        self._texts: dict[str, str] = {}
        self.add(interfaces)

    def add(self, interfaces: Mapping[ir.TypeName, ir.Interface]) -> None:
        """Describe more interfaces; together they must be a closed set again."""
        new = interfaces.keys() - self._described
        self._described |= new
        for name in new:
            interface = interfaces[name]
            for message in derive.structures(interface):
                self._individuals[str(message.name)] = individual(message)

    def _closure(self, name: str) -> list[str]:
        """Return all names that `name` refers to, itself excluded, in code-point order."""
        return sorted(derive.closure(self._direct(name), self._direct))

    def _direct(self, name: str) -> set[str]:
        types = (field["type"] for field in self._individuals[name]["fields"])
        return {type_["nested_type_name"] for type_ in types} - {""}

    def description(self, name: str) -> DescriptionDict:
        """Return the full description of a structure, service or action by its full name."""
        return {
            "type_description": self._individuals[name],
            "referenced_type_descriptions": [
                self._individuals[nested] for nested in self._closure(name)
            ],
        }

    def hash(self, name: str) -> str:
        """Return RIHS01_ and 64 hexadecimal digits for a full name."""
        digest = self._hashes.get(name)
        if digest is None:
            references = ", ".join(self._hashed_text(n) for n in self._closure(name))
            text = (
                f'{{"type_description": {self._hashed_text(name)}, '
                f'"referenced_type_descriptions": [{references}]}}'
            )
            digest = "RIHS01_" + hashlib.sha256(text.encode("ascii")).hexdigest()
            self._hashes[name] = digest
        return digest

    def _hashed_text(self, name: str) -> str:
        """Return the JSON of an individual description without default values."""
        text = self._texts.get(name)
        if text is None:
            own = self._individuals[name]
            fields = [{"name": field["name"], "type": field["type"]} for field in own["fields"]]
            text = json.dumps({"type_name": own["type_name"], "fields": fields})
            self._texts[name] = text
        return text

    def installed(self, name: str) -> dict[str, object]:
        """Return the content of the Name.json file that ROS 2 installs for a full name."""
        hashes = [
            {"type_name": described, "hash_string": self.hash(described)}
            for described in (name, *self._closure(name))
        ]
        return {"type_description_msg": self.description(name), "type_hashes": hashes}
