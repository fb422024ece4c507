"""Makes the offered part of rclpy, and ROS 2's standard interfaces, importable in this process."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

from idlc.robot.offer.names import OFFERED

#: The page that lists the names.
PAGE = "docs/robot-nodes.md"


class _Offered(ModuleType):
    """A module of rclpy, whose names are imported when a program asks for them."""

    def __init__(self, name: str) -> None:
        super().__init__(name, "A part of rclpy, as idlc offers it.")
        self._homes = {
            word: home for home, words in OFFERED[name].items() for word in words.split()
        }
        self.__all__ = sorted(self._homes)

    def __getattr__(self, name: str) -> Any:
        if name in self._homes:
            value = getattr(import_module(self._homes[name]), name)
            setattr(self, name, value)
            return value
        raise AttributeError(not_offered(f"{self.__name__}.{name}"), name=name, obj=self)

    def __dir__(self) -> list[str]:
        return self.__all__


class _Importer(MetaPathFinder, Loader):
    """Finds the modules, unless they are installed."""

    def find_spec(self, name: str, _path: object = None, _target: object = None) -> Any:
        """Return the spec of a module; raise ModuleNotFoundError for other parts of rclpy."""
        if name in OFFERED:
            is_package = any(other.startswith(f"{name}.") for other in OFFERED)
            return ModuleSpec(name, self, is_package=is_package)
        package = name.partition(".")[0]
        if package == "rclpy":
            raise ModuleNotFoundError(not_offered(name), name=name)
        from idlc.model.catalog import packages

        if package not in packages():
            return None
        from idlc.recordings.load import known_spec

        return known_spec(package, name)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return a part of rclpy."""
        return _Offered(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing: names are imported on demand."""


def not_offered(name: str) -> str:
    """Return the message about a name of rclpy."""
    return f"idlc does not offer `{name}`; {PAGE} lists the names that idlc offers"


def install() -> None:
    """Begin to offer."""
    sys.meta_path.append(_Importer())
