"""The bases of generated services and actions: names for their messages, never instances."""

from __future__ import annotations

from .errors import MissingPackageError, importing
from .message import InterfaceMeta, metaclass_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar


class Package:
    """A module of another package, imported when one of its classes is asked for."""

    def __init__(self, module: str) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Any:
        """Return a class; what begins with an underscore is none."""
        if name[0] == "_":
            raise AttributeError(f"{self._module} has no class {name!r}")
        with importing():
            return getattr(__import__(self._module, fromlist=[name]), name)


class Imported:
    """A class attribute: a class of another package, imported when it is asked for."""

    def __init__(self, module: str, name: str) -> None:
        self._package = Package(module)
        self._name = name

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        """Return the class; without the package, the attribute is missing."""
        try:
            return getattr(self._package, self._name)
        except MissingPackageError as error:
            raise AttributeError(str(error)) from error


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
        metaclass = metaclass_of(cls, name, namespace)
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
