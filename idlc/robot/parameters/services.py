"""The six services by which other programs read and set the parameters of a node."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from idlc.robot.nodes.interfaces import standard
from idlc.robot.parameters.declared import HasParameters
from idlc.robot.parameters.values import Parameter, ParameterException, message_of
from idlc.robot.qos import qos_profile_parameters


def add_services(node: HasParameters, create_service: Callable[..., Any]) -> None:
    """Create the services of a node; their messages are compiled for the first request."""
    for name, answer in _ANSWERS.items():
        kind = "".join(word.capitalize() for word in name.split("_"))
        service = standard(f"rcl_interfaces/srv/{kind}")
        create_service(f"~/{name}", service, _bound(answer, node), qos_profile_parameters)


def _bound(answer: Callable[..., None], node: HasParameters) -> Callable[[Any, Any], Any]:
    def callback(request: Any, response: Any) -> Any:
        answer(node, request, response)
        return response

    return callback


def _all_or_none(get: Callable[[str], Any], names: list[str]) -> list[Any]:
    """Return an entry for each name; none if one of the parameters does not exist."""
    try:
        return [get(name) for name in names]
    except ParameterException:
        return []


def _describe(node: HasParameters, request: Any, response: Any) -> None:
    response.descriptors = _all_or_none(node.describe_parameter, request.names)


def _get(node: HasParameters, request: Any, response: Any) -> None:
    parameters = _all_or_none(node.get_parameter, request.names)
    response.values = [parameter.get_parameter_value() for parameter in parameters]


def _types(node: HasParameters, request: Any, response: Any) -> None:
    response.types = _all_or_none(node.get_parameter_type, request.names)


def _list(node: HasParameters, request: Any, response: Any) -> None:
    response.result = node.list_parameters(request.prefixes, request.depth)


def _set(node: HasParameters, request: Any, response: Any) -> None:
    response.results = [_set_all(node, [message]) for message in request.parameters]


def _set_atomically(node: HasParameters, request: Any, response: Any) -> None:
    response.result = _set_all(node, request.parameters)


def _set_all(node: HasParameters, messages: list[Any]) -> Any:
    try:
        parameters = [Parameter.from_parameter_msg(message) for message in messages]
        return node.set_parameters_atomically(parameters)
    except (ParameterException, ValueError) as error:
        return message_of("SetParametersResult", successful=False, reason=str(error))


_ANSWERS: dict[str, Callable[[HasParameters, Any, Any], None]] = {
    "describe_parameters": _describe,
    "get_parameters": _get,
    "get_parameter_types": _types,
    "list_parameters": _list,
    "set_parameters": _set,
    "set_parameters_atomically": _set_atomically,
}
