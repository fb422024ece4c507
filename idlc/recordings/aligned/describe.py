"""Facts about columns that their values do not show: units, enums and quaternions."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import NamedTuple

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.parse import parse
from idlc.model import ir
from idlc.model.enums import enums
from idlc.model.lowering.lower import lower
from idlc.recordings.columns.plan import code_of_time
from idlc.runtime.typeinfo import FieldInfo, Structure


class ColumnLeaf(NamedTuple):
    """A column without columns in it: its path, and the message and field that it comes from."""

    path: str
    structure: Structure
    field: FieldInfo


def leaves(structure: Structure, prefix: str = "") -> Iterator[ColumnLeaf]:
    """Yield the columns of a type's flat table."""
    for field in structure.fields:
        nested = None if field.is_list else field.nested
        if nested and not code_of_time(nested):
            yield from leaves(nested, f"{prefix}{field.name}.")
        else:
            yield ColumnLeaf(prefix + field.name, structure, field)


def metadata(structure: Structure) -> dict[str, dict[str, str]]:
    """Return the metadata of the columns that have a unit or an enum."""
    result: dict[str, dict[str, str]] = {}
    by_type: dict[str, dict[str, dict[str, str]]] = {}
    for leaf in leaves(structure):
        name = leaf.structure.name
        if name not in by_type:
            by_type[name] = _of_fields(leaf.structure)
        if facts := by_type[name].get(leaf.field.name):
            result[leaf.path] = facts
    return result


def _of_fields(structure: Structure) -> dict[str, dict[str, str]]:
    """Return the metadata of a message's fields, as its definition describes them."""
    source = structure.types.sources.get(structure.name)
    if source is None or "/msg/" not in structure.name:
        return {}
    text = Source(f"{structure.name}.msg", source)
    message = lower(parse(text), ir.TypeName.parse(structure.name), Report())
    if not isinstance(message, ir.Message):
        return {}
    facts: dict[str, dict[str, str]] = {
        field.name: {"ros2.unit": field.unit} for field in message.fields if field.unit
    }
    for enum in enums(message, "all"):
        names = {str(constant.value): name for name, constant in enum.members.items()}
        for field in enum.fields:
            facts.setdefault(field.name, {})["ros2.enum"] = json.dumps(names)
    return facts


def quaternions(structure: Structure) -> list[list[str]]:
    """Return the columns x, y, z and w of each quaternion of a type."""
    groups: dict[str, list[str]] = {}
    for leaf in leaves(structure):
        if leaf.structure.name.endswith("/Quaternion"):
            groups.setdefault(leaf.path.rpartition(".")[0], []).append(leaf.path)
    return [paths for paths in groups.values() if [path[-1] for path in paths] == [*"xyzw"]]
