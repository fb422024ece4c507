"""What is made when someone asks for it: modules of a package, attributes of a class."""

from __future__ import annotations

import sys

from .names import public_name
from .typing_stub import Generic, TypeVar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from dataclasses import Field
    from typing import Any

Value = TypeVar("Value")


def lazily(
    package: str, modules: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` (PEP 562) for a package's names, by their `modules`.

    Classes are found by their names on the wire, too.
    """

    def get(name: str) -> Any:
        if name not in modules:
            name = public_name(name)
        module = modules.get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        # what importlib.import_module does, without its import
        value = getattr(__import__(f"{package}.{module}", fromlist=[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        own = {*vars(sys.modules[package]), *modules}
        return sorted(own - {"TYPE_CHECKING", "annotations"})

    return get, names


class Fresh(Generic[Value]):
    """A class attribute whose value is made anew at each access, for mutable defaults."""

    def __init__(self, make: Callable[..., Value], *arguments: Any) -> None:
        self._make = make
        self._arguments = arguments

    def __get__(self, instance: object, owner: type | None = None) -> Value:
        """Return a new value."""
        return self._make(*self._arguments)


class FreshList(Fresh[list[Value]]):
    """A class attribute whose value is a new list of the same values at each access."""

    def __init__(self, *values: Value) -> None:
        super().__init__(list, values)


class OnDemand:
    """A class attribute that is made when someone asks for it.

    What goes wrong is an AttributeError, as those expect who look at all attributes of a class.
    """

    def __init__(self, make: Callable[[type], Any]) -> None:
        self._make = make

    def __get__(self, instance: object, owner: type) -> Any:
        """Return the value."""
        try:
            return self._make(owner)
        except Exception as error:
            raise AttributeError(str(error)) from error


def slot_types(kind: type) -> tuple[Any, ...]:
    """Return SLOT_TYPES of a message class."""
    from .on_demand import typeinfo

    return typeinfo.slot_types(kind)


def dataclass_fields(kind: type) -> dict[str, Field[Any]]:
    """Return what the module dataclasses asks a message class for."""
    from .on_demand import fields

    return fields.dataclass_fields(kind)


def dataclass_params(_kind: type) -> Any:
    """Return how dataclasses would have made a message class."""
    from .on_demand.fields import PARAMETERS

    return PARAMETERS
