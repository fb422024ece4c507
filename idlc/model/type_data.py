"""The types of a package as data, which its `_type_data.py` holds."""

from __future__ import annotations

from typing import Any

from idlc.model import derive, link
from idlc.model.describe import IndividualDict
from idlc.model.idl_text import file_text


def content(model: link.Model) -> dict[str, Any]:
    """Return a package's name, and all of its types with everything that they refer to.

    Descriptions and hashes are by full name, the package's own files by interface name. Other
    packages' files are left out: their text differs between an installation and the catalogue,
    and the same input must give the same output.
    """
    describer = model.describer
    descriptions: dict[str, IndividualDict] = {}
    for interface in model.own:
        for structure in derive.structures(interface):
            full = describer.description(str(structure.name))
            for description in (full["type_description"], *full["referenced_type_descriptions"]):
                descriptions[description["type_name"]] = description
    return {
        "package": model.package,
        "descriptions": dict(sorted(descriptions.items())),
        "hashes": {name: describer.hash(name) for name in sorted(descriptions)},
        "sources": sources(model),
    }


def sources(model: link.Model) -> dict[str, str]:
    """Return the files of a package's interfaces, by their names."""
    texts = {
        # rosidl reads texts so, and no checkout of git's makes a difference then
        str(interface.name): file_text(interface).replace("\r\n", "\n").replace("\r", "\n")
        for interface in model.own
        if interface.source is not None
    }
    return dict(sorted(texts.items()))
