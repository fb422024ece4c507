"""A node with the interfaces that its endpoints speak."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from idlc.model import ir
from idlc.scaffold import spec

_CLIENTS = ("client", "action_client")


class Plan(NamedTuple):
    """A node with the interfaces of its endpoints and a word for each."""

    node: spec.Node
    interfaces: tuple[ir.Interface, ...]
    words: tuple[str, ...]
    messages: Mapping[ir.TypeName, ir.Message]

    @property
    def once(self) -> bool:
        """Whether the node does what it is asked to and ends: it only calls others."""
        node = self.node
        only = all(endpoint.role in _CLIENTS for endpoint in node.endpoints)
        return bool(node.endpoints) and only and not node.timers and not node.lifecycle

    @property
    def clients(self) -> tuple[tuple[spec.Endpoint, str, ir.Interface], ...]:
        """The endpoints that send requests or goals."""
        triples = zip(self.node.endpoints, self.words, self.interfaces, strict=True)
        return tuple(one for one in triples if one[0].role in _CLIENTS)

    @property
    def packages(self) -> list[str]:
        """The packages that the node's module imports, rclpy among them; its own is not."""
        found = {interface.name.package for interface in self.interfaces} | {"rclpy"}
        found |= (
            {"action_msgs"}
            if any(e.role == "action_client" for e in self.node.endpoints)
            else set()
        )
        return sorted(found - {self.node.package})


def plan(
    node: spec.Node,
    interfaces: Iterable[ir.Interface],
    messages: Mapping[ir.TypeName, ir.Message],
) -> Plan:
    """Return a node with the interfaces of its endpoints, in their order."""
    return Plan(node, tuple(interfaces), tuple(spec.words(node.endpoints)), messages)
