"""The module `_idlc/type_data.py`: what rclpy, tools and error messages ask about types.

It is a module so that no installation can leave it out, as it can a data file. Its content is JSON
in string literals, so that no text of an interface file is code.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, TypedDict

from idlc.emit import literals
from idlc.export.file_text import file_text
from idlc.model import derive, link
from idlc.model.describe import IndividualDict


class TypesDict(TypedDict):
    """Descriptions and hashes by full name, and the package's own files by interface name.

    Other packages' files are left out: their text differs between an installation and the
    catalogue, and the same input must give the same output.
    """

    package: str
    descriptions: dict[str, IndividualDict]
    hashes: dict[str, str]
    sources: dict[str, str]


def content(model: link.Model) -> TypesDict:
    """Return the descriptions of a package's types and of everything that they refer to."""
    describer = model.describer
    descriptions: dict[str, IndividualDict] = {}
    for interface in model.own:
        structures = (*derive.messages(interface), *derive.pseudo_structures(interface))
        for structure in structures:
            full = describer.description(str(structure.name))
            for one in (full["type_description"], *full["referenced_type_descriptions"]):
                descriptions[one["type_name"]] = one
    sources = {
        # rosidl reads texts so, and no checkout of git's makes a difference then
        str(interface.name): file_text(interface).replace("\r\n", "\n").replace("\r", "\n")
        for interface in model.own
        if interface.source is not None
    }
    return {
        "package": model.package,
        "descriptions": dict(sorted(descriptions.items())),
        "hashes": {name: describer.hash(name) for name in sorted(descriptions)},
        "sources": dict(sorted(sources.items())),
    }


def source(model: link.Model, around: str = "") -> str:
    """Return the text of the module: one line of it for each type."""
    parts = _parts(content(model), around)
    lines = "".join(f"    {literals.text(part)}\n" for part in parts)
    return f'"""The types of {model.package}, read by `typeinfo`."""\n\nJSON = (\n{lines})\n'


def _parts(tables: TypesDict, around: str) -> Iterator[str]:
    """Yield pieces that joined are the JSON text."""
    yield f'{{"package":{_json(tables["package"])}'
    if around:
        yield f',"around":{_json(f"{around}.")}'
    for key in ("descriptions", "hashes", "sources"):
        mark = f',"{key}":{{'
        entries: dict[str, Any] = tables[key]
        for name, value in entries.items():
            yield f"{mark}{_json(name)}:{_json(value)}"
            mark = ","
        yield "}" if entries else mark + "}"
    yield "}"


_json = json.JSONEncoder(ensure_ascii=True, separators=(",", ":")).encode
