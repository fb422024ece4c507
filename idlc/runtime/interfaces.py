"""The bases of generated services and actions: names for their messages, never instances."""

from __future__ import annotations

from .errors import importing
from .message import InterfaceMeta

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar


class Imported:
    """A class of another package, imported when it is asked for."""

    def __init__(self, module: str, name: str) -> None:
        self._module = module
        self._name = name

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        """Return the class."""
        return _imported(self._module, self._name)


def make(module: str, name: str) -> Any:
    """Return a new instance of another package's class."""
    return _imported(module, name)()


def _imported(module: str, name: str) -> Any:
    with importing():
        return getattr(__import__(module, fromlist=[name]), name)


def several(kind: Any, count: int) -> list[Any]:
    """Return a list of `count` new instances."""
    return [kind() for _ in range(count)]


class _GroupMeta(InterfaceMeta):
    """Gives each service and action a metaclass of its own, for its type support."""

    _interface: ClassVar[Any] = None

    def __new__(
        cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any]
    ) -> Any:
        if not bases:
            return super().__new__(cls, name, bases, namespace)
        metaclass: Any = type(
            f"Metaclass_{name}", (cls,), {"__module__": namespace["__module__"]}
        )
        made: Any = type.__new__(metaclass, name, bases, namespace)
        metaclass._interface = made
        return made

    def __call__(cls, *_values: object, **_named: object) -> Any:
        raise NotImplementedError(
            f"{cls.__name__} is a name for its messages, not a message"
        )


class ServiceMeta(_GroupMeta):
    """The metaclass of services."""

    @classmethod
    def __import_type_support__(cls) -> None:
        """Set the capsule that rclpy reads from this metaclass."""
        from . import typesupport

        typesupport.import_service(cls._interface)


class ActionMeta(_GroupMeta):
    """The metaclass of actions."""

    @classmethod
    def __import_type_support__(cls) -> None:
        """Set the capsule that rclpy reads from this metaclass."""
        from . import typesupport

        typesupport.import_action(cls._interface)


class Service(metaclass=ServiceMeta):
    """The base of services: `Request`, `Response` and `Event` are their messages."""


class Action(metaclass=ActionMeta):
    """The base of actions: `Goal`, `Result` and `Feedback` are their messages."""
