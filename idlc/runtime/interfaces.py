"""The bases of generated services and actions: names for their messages, never instances."""

from __future__ import annotations

import sys

from .errors import MissingPackageError, importing
from .lazy import OnDemand
from .message import InterfaceMeta, metaclass_of
from .names import wire_name

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


def _protocol(module: str) -> Any:
    """Return the module of what ROS 2 adds to the service or action of a module."""
    return __import__(f"{module}__protocol", fromlist=["__name__"])


def _event(service: Any) -> Any:
    name = f"{wire_name(service.__name__)}_Event"
    service.Event = getattr(_protocol(service.__module__), name)
    return service.Event


def _impl(action: Any) -> Any:
    name = f"{wire_name(action.__name__)}_Impl"
    action.Impl = getattr(_protocol(action.__module__), name)
    return action.Impl


def complete(protocol: str) -> None:
    """Put what is in the module `protocol` into that which rosidl has all classes in.

    There pickles look for classes, and whoever evaluates annotations for what they name.
    """
    known = vars(sys.modules[protocol.removesuffix("__protocol")])
    for name, value in vars(sys.modules[protocol]).items():
        known.setdefault(name, value)


def _protocol_getter(module: str) -> Any:
    """Return a module's `__getattr__`, which finds what ROS 2 adds."""

    def get(name: str) -> Any:
        if name[0] != "_" and hasattr(_protocol(module), name):
            return getattr(_protocol(module), name)
        raise AttributeError(f"module {module!r} has no attribute {name!r}")

    return get


class _GroupMeta(InterfaceMeta):
    """Gives each service and action a metaclass of its own, for its type support.

    What ROS 2 adds is in a module of its own, imported when somebody asks for it.
    """

    _interface: ClassVar[Any] = None
    #: The attribute that stands for it, in a class that is not itself part of it.
    _added: ClassVar[str]

    def __new__(
        cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any]
    ) -> Any:
        if not bases:
            return super().__new__(cls, name, bases, namespace)
        metaclass = metaclass_of(cls, name, namespace)
        made: Any = type.__new__(metaclass, name, bases, namespace)
        metaclass._interface = made
        if cls._added not in namespace:
            module: Any = sys.modules[made.__module__]
            module.__getattr__ = _protocol_getter(made.__module__)
        return made

    def __call__(cls, *_values: object, **_named: object) -> Any:
        raise NotImplementedError(
            f"{cls.__name__} is a name for its messages, not a message"
        )


class ServiceMeta(_GroupMeta):
    """The metaclass of services."""

    _added = "Event"

    @classmethod
    def __import_type_support__(cls) -> None:
        """Set the capsule that rclpy reads from this metaclass."""
        from . import typesupport

        typesupport.import_service(cls._interface)


class ActionMeta(_GroupMeta):
    """The metaclass of actions."""

    _added = "Impl"

    @classmethod
    def __import_type_support__(cls) -> None:
        """Set the capsule that rclpy reads from this metaclass."""
        from . import typesupport

        typesupport.import_action(cls._interface)


class Service(metaclass=ServiceMeta):
    """The base of services: `Request`, `Response` and `Event` are their messages."""

    if not TYPE_CHECKING:
        Event = OnDemand(_event)


class Action(metaclass=ActionMeta):
    """The base of actions: `Goal`, `Result` and `Feedback` are their messages."""

    if not TYPE_CHECKING:
        Impl = OnDemand(_impl)
