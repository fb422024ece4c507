"""A node with the interfaces that its endpoints speak."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from idlc.model import ir
from idlc.scaffold import spec
from idlc.scaffold.roles.role import Endpoint, Request


class Placed(NamedTuple):
    """An endpoint with its interface, if its role has one, and a word for its names."""

    endpoint: Endpoint
    word: str
    interface: ir.Interface | None


class Asking(NamedTuple):
    """An endpoint that sends a request or a goal, which the command line describes."""

    request: Request
    word: str
    interface: ir.Interface


class Plan(NamedTuple):
    """A node with its endpoints and all messages that those may need."""

    node: spec.Node
    endpoints: tuple[Placed, ...]
    messages: Mapping[ir.TypeName, ir.Message]

    @property
    def asking(self) -> tuple[Asking, ...]:
        """The endpoints that send requests or goals."""
        return tuple(
            Asking(placed.endpoint.role.request, placed.word, placed.interface)
            for placed in self.endpoints
            if placed.endpoint.role.request and placed.interface
        )

    @property
    def once(self) -> bool:
        """Whether the node does what it is asked to and ends: it only calls others."""
        endpoints = self.node.endpoints
        only = all(endpoint.role.request for endpoint in endpoints)
        return bool(endpoints) and only and not self.node.lifecycle

    @property
    def packages(self) -> list[str]:
        """The packages that the node's module imports, rclpy among them; its own is not."""
        used = {placed.interface.name.package for placed in self.endpoints if placed.interface}
        modules = {module for one in self.node.endpoints for module in one.role.imports}
        libraries = {module.partition(".")[0] for module in modules} - sys.stdlib_module_names
        return sorted(({"rclpy"} | used | libraries) - {self.node.package})


def plan(
    node: spec.Node,
    interfaces: Iterable[ir.Interface | None],
    messages: Mapping[ir.TypeName, ir.Message],
) -> Plan:
    """Return a node with the interfaces of its endpoints, in their order."""
    placed = zip(node.endpoints, spec.words(node.endpoints), interfaces, strict=True)
    return Plan(node, tuple(Placed(*one) for one in placed), messages)
