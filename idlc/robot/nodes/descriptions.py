"""The service `~/get_type_description`, which describes the types of a node's endpoints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from idlc.robot.nodes.interfaces import Interface
from idlc.runtime.typeinfo import Types

SERVICE = "type_description_interfaces/srv/GetTypeDescription"


def describe(interfaces: Mapping[str, Interface], request: Any, response: Any) -> Any:
    """Fill in the response to a request, from the types that a node uses."""
    interface = interfaces.get(request.type_name)
    if interface is None:
        response.failure_reason = "the node does not use this type"
        return response
    if request.type_hash and request.type_hash != interface.hash:
        response.failure_reason = f"the node uses the type with the hash {interface.hash}"
        return response
    types = interface.types
    names = [*_reached(types, interface.name)]
    sources = [_source(types, name) for name in names] if request.include_type_sources else []
    return type(response).from_dict(
        {
            "successful": True,
            "type_description": {
                "type_description": types.descriptions[interface.name],
                "referenced_type_descriptions": [
                    types.descriptions[name] for name in sorted(names[1:])
                ],
            },
            "type_sources": [source for source in sources if source],
        }
    )


def _reached(types: Types, name: str) -> Iterator[str]:
    """Yield a type, and then the types that it uses."""
    names = {name: None}
    waiting = [name]
    while waiting:
        name = waiting.pop()
        yield name
        for field in types.descriptions[name]["fields"]:
            nested = field["type"]["nested_type_name"]
            if nested and nested not in names:
                names[nested] = None
                waiting.append(nested)


def _source(types: Types, name: str) -> dict[str, str] | None:
    """Return the text of a type, `None` if it is not known: packages contain their own."""
    if name in types.sources:
        encoding, text = name.split("/")[1], types.sources[name]
    elif name.split("/")[1] != "msg":  # a part of a service or action
        encoding, text = "implicit", ""
    else:
        return None
    return {"type_name": name, "encoding": encoding, "raw_file_contents": text}
