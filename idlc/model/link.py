"""Linking: interfaces of several packages become one immutable index by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Protocol

from idlc.model import derive, ir
from idlc.model.describe import Describer
from idlc.text.source import Source


class Library(Protocol):
    """Where other packages' interfaces come from, in order of precedence."""

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface, or `None` if there is none of that name."""

    def names(self, package: str) -> Iterable[str]:
        """Return the names of a package's messages; empty for an unknown package."""

    def packages(self) -> Iterable[str]:
        """Return the names of all packages, for suggestions."""


class Model:
    """A package's interfaces and everything that they refer to.

    `own` is sorted by name; `interfaces` also holds each interface that is reached from them,
    the implicit ones of services and actions included.
    """

    def __init__(
        self,
        package: str,
        own: tuple[ir.Interface, ...],
        interfaces: Mapping[ir.TypeName, ir.Interface],
    ) -> None:
        self.package = package
        self.own = own
        self.interfaces = interfaces

    @cached_property
    def messages(self) -> Mapping[ir.TypeName, ir.Message]:
        """Every structure by name, sections and derived ones included."""
        return {
            message.name: message
            for interface in self.interfaces.values()
            for message in derive.messages(interface)
        }

    @cached_property
    def describer(self) -> Describer:
        """Type descriptions and hashes of everything in the model."""
        return Describer(self.interfaces)
