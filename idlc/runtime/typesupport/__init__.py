"""Type support for rclpy, made from Python: what rclpy finds on a class's metaclass.

rclpy reads capsules from `type(cls)` and, if they are missing, calls the metaclass's
`__import_type_support__`, which comes here. Nothing else imports these modules.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any

from ..names import wire_name
from . import c, services
from .abi import has_hashes
from .descriptions import load
from .extension import OF_RCL, extension

#: Middlewares that take encoded messages through Fast DDS's type support.
_OPAQUE = ("rmw_fastrtps_cpp", "rmw_zenoh_cpp")
#: Middlewares that have a type support of their own, generated in C++.
_UNSUPPORTED = ("rmw_connextdds", "rmw_connextddsmicro")

#: What rclpy reads from the metaclass; the type support comes last, because its presence
#: says that all is there.
_SUPPORT = "_TYPE_SUPPORT"
_MEMORY = (
    "_CREATE_ROS_MESSAGE",
    "_DESTROY_ROS_MESSAGE",
    "_CONVERT_FROM_PY",
    "_CONVERT_TO_PY",
)


@cache
def _implementation() -> ModuleType:
    """Return the module that fits the middleware of this process."""
    try:
        utilities = import_module("rclpy.utilities")
    except ImportError as error:
        raise ImportError(
            "type support needs rclpy: install it (for example `pip install "
            "ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp`), or source your ROS 2 "
            "installation first"
        ) from error
    middleware = utilities.get_rmw_implementation_identifier()
    if middleware in _UNSUPPORTED:
        raise ImportError(
            f"idlc's type support does not know {middleware}: set RMW_IMPLEMENTATION to "
            "rmw_fastrtps_cpp or rmw_cyclonedds_cpp, or build the interface package "
            "with colcon"
        )
    if middleware in _OPAQUE:
        from . import fastrtps as implementation
    else:
        from . import structs as implementation  # type: ignore[no-redef]
    return implementation


def _name(cls: Any) -> str:
    """Return the full name of a class as ROS 2 writes it."""
    kind = cls.__module__.split(".")[-2]
    return f"{load().package}/{kind}/{wire_name(cls.__name__)}"


def _handle(cls: Any) -> int:
    """Return the address of any class's type support, whoever made the class."""
    meta = type(cls)
    if getattr(meta, _SUPPORT) is None:
        meta.__import_type_support__()
    return c.capsule_pointer(getattr(meta, _SUPPORT))


def _set_capsules(cls: Any, capsules: dict[str, object]) -> None:
    for attribute, capsule in capsules.items():
        setattr(type(cls), attribute, capsule)


@cache
def _message(cls: Any) -> c.MessageSupport:
    name = _name(cls)
    if name.partition("/")[0] in OF_RCL:
        raise ImportError(
            f"ROS reads the memory of {name} itself, and what it was built with is not "
            "here: install that package with your ROS 2, in the version that idlc compiled"
        )
    return _implementation().message(cls, name)  # type: ignore[no-any-return]


@cache
def _base() -> Any:
    """Return the class that messages derive from since ROS 2 Lyrical, None before."""
    try:
        return import_module("rosidl_pycommon.interface_base_classes").BaseMessage
    except (ImportError, AttributeError):
        return None


def import_message(cls: Any) -> None:
    """Give `type(cls)` the capsules that rclpy reads from a message class."""
    if _base() is not None:
        _base().register(cls)
    built = extension(cls, _name(cls))
    if built:
        _set_capsules(cls, built.message())
        return
    handle, *functions = map(c.capsule, _message(cls))
    _set_capsules(cls, dict(zip(_MEMORY, functions, strict=True)))
    _set_capsules(cls, {_SUPPORT: handle})


def import_service(cls: Any) -> None:
    """Give `type(cls)`, and those of its messages, the capsules that rclpy reads."""
    request, response = map(_handle, (cls.Request, cls.Response))
    # ROS 2 Humble knows no events, and has no package that they need
    happened = _handle(cls.Event) if has_hashes() else 0
    built = extension(cls, _name(cls))
    if built:
        _set_capsules(cls, {_SUPPORT: built.service()})
        return
    event = services.event(cls, happened) if happened else services.Event()
    support = services.service(_name(cls), request, response, event, _implementation())
    _set_capsules(cls, {_SUPPORT: c.capsule(support)})


def import_action(cls: Any) -> None:
    """Give `type(cls)`, and those of what it consists of, the capsules that rclpy reads.

    Goals are identified by GoalInfo, which rclpy converts without asking for its type support.
    """
    parts = cls.Impl
    _handle(import_module("action_msgs.msg").GoalInfo)
    its_services = (
        _handle(parts.SendGoalService),
        _handle(parts.GetResultService),
        _handle(parts.CancelGoalService),
    )
    messages = (_handle(parts.FeedbackMessage), _handle(parts.GoalStatusMessage))
    built = extension(cls, _name(cls))
    if built:
        _set_capsules(cls, {_SUPPORT: built.action()})
        return
    support = services.action(_name(cls), its_services, messages)
    _set_capsules(cls, {_SUPPORT: c.capsule(support)})
