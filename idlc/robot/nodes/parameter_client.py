"""Parameters of other nodes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from idlc.robot.nodes.interfaces import standard
from idlc.robot.nodes.overrides import parameter_dict_from_yaml_file
from idlc.robot.parameters import PARAMETER_SERVICES, Parameter
from idlc.robot.qos import QoSProfile, qos_profile_services_default


class AsyncParameterClient:
    """Asks another node about its parameters; methods return the future of a response.

    `node` is a Node. `callback` gets the future when it is done.
    """

    def __init__(
        self,
        node: Any,
        remote_node_name: str,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: Any = None,
    ) -> None:
        self.node, self.remote_node_name = node, remote_node_name
        self._clients = {
            verb: node.create_client(
                standard(f"rcl_interfaces/srv/{verb.title().replace('_', '')}"),
                f"{remote_node_name}/{verb}",
                qos_profile=qos_profile,
                callback_group=callback_group,
            )
            for verb in PARAMETER_SERVICES
        }

    def services_are_ready(self) -> bool:
        """Return whether the node has all services of parameters."""
        return all(client.service_is_ready() for client in self._clients.values())

    def wait_for_services(self, timeout_sec: float | None = None) -> bool:
        """Wait for the services of the node; return whether they are there."""
        client: Any = self._clients["list_parameters"]
        return bool(client.wait_for(self.services_are_ready, timeout_sec))

    def _ask(self, verb: str, callback: Any, **values: Any) -> Any:
        client = self._clients[verb]
        future = client.call_async(client.interface.kind.Request(**values))
        if callback is not None:
            future.add_done_callback(callback)
        return future

    def list_parameters(
        self, prefixes: Sequence[str] | None = None, depth: int | None = None, callback: Any = None
    ) -> Any:
        """Ask for the names of parameters, at most `depth` parts longer than a prefix."""
        values = {"prefixes": [*(prefixes or ())], "depth": depth or 0}
        return self._ask("list_parameters", callback, **values)

    def get_parameters(self, names: Sequence[str], callback: Any = None) -> Any:
        """Ask for values."""
        return self._ask("get_parameters", callback, names=names)

    def get_parameter_types(self, names: Sequence[str], callback: Any = None) -> Any:
        """Ask for types."""
        return self._ask("get_parameter_types", callback, names=names)

    def describe_parameters(self, names: Sequence[str], callback: Any = None) -> Any:
        """Ask for descriptors."""
        return self._ask("describe_parameters", callback, names=names)

    def set_parameters(self, parameters: Iterable[Any], callback: Any = None) -> Any:
        """Set parameters one by one; each is a Parameter or its message."""
        return self._ask("set_parameters", callback, parameters=_messages(parameters))

    def set_parameters_atomically(self, parameters: Iterable[Any], callback: Any = None) -> Any:
        """Set all of the parameters or none."""
        return self._ask("set_parameters_atomically", callback, parameters=_messages(parameters))

    def delete_parameters(self, names: Iterable[str], callback: Any = None) -> Any:
        """Set parameters to NOT_SET."""
        return self.set_parameters(map(Parameter, names), callback)

    def load_parameter_file(
        self, parameter_file: str, use_wildcard: bool = False, callback: Any = None
    ) -> Any:
        """Set the parameters in a file."""
        messages = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters(messages.values(), callback)

    def load_parameter_file_atomically(
        self, parameter_file: str, use_wildcard: bool = False, callback: Any = None
    ) -> Any:
        """Set all of the parameters in a file or none."""
        messages = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters_atomically(messages.values(), callback)


def _messages(parameters: Iterable[Any]) -> list[Any]:
    return [
        parameter.to_parameter_msg() if isinstance(parameter, Parameter) else parameter
        for parameter in parameters
    ]
