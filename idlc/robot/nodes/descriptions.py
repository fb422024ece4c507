"""The service `~/get_type_description`, which describes the types of a node's endpoints."""

from __future__ import annotations

from typing import Any

from idlc.runtime.typeinfo import types_of

#: The parameter without which, or with True, a node has the service.
START_SERVICE = "start_type_description_service"
SERVICE = "type_description_interfaces/srv/GetTypeDescription"


def describe(node: Any, request: Any, response: Any) -> Any:
    """Fill in the response to a request, from the types that a Node uses."""
    used = {each.interface.name: each.interface for each in node.endpoints}
    interface = used.get(request.type_name)
    if interface is None or request.type_hash not in ("", interface.hash):
        problem = f"uses the hash {interface.hash}" if interface else "does not use this type"
        response.failure_reason = f"the node {problem}"
        return response
    types = types_of(interface.kind)
    names = [interface.name]
    for name in names:
        nested = dict.fromkeys(field.nested.name for field in types[name].members if field.nested)
        names += [other for other in nested if other not in names]
    first, *others = [types.descriptions[name] for name in (names[0], *sorted(names[1:]))]
    sources = []
    for name in names if request.include_type_sources else ():
        kind, text = name.split("/")[1], types.sources.get(name)
        if text is not None:
            sources.append({"type_name": name, "encoding": kind, "raw_file_contents": text})
        elif kind != "msg":  # a part of a service or action; packages contain their own messages
            sources.append({"type_name": name, "encoding": "implicit"})
    description = {"type_description": first, "referenced_type_descriptions": others}
    return type(response).from_dict(
        {"successful": True, "type_description": description, "type_sources": sources}
    )
