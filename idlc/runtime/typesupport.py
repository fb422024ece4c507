"""Type support for rclpy, made from Python: what rclpy finds on the metaclass of a class.

rclpy reads capsules from `type(cls)` and, if they are missing, calls the metaclass's
`__import_type_support__`, which comes here. Nothing else imports these modules.
"""

from __future__ import annotations

from ctypes import PYFUNCTYPE, py_object
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any

from . import typesupport_c as c
from . import typesupport_services as services
from .typesupport_descriptions import load
from .typesupport_extension import extension

#: Middlewares that take encoded messages through Fast DDS's type support.
_OPAQUE = ("rmw_fastrtps_cpp", "rmw_zenoh_cpp")
#: Middlewares that have a type support of their own, generated in C++.
_UNSUPPORTED = ("rmw_connextdds", "rmw_connextddsmicro")


@cache
def _road() -> ModuleType:
    """Return the module that fits the middleware of this process."""
    try:
        utilities = import_module("rclpy.utilities")
    except ImportError as error:
        raise ImportError(
            "type support needs rclpy: install it (for example `pip install ros-jazzy-rclpy "
            "ros-jazzy-rmw-fastrtps-cpp`), or source your ROS 2 installation first"
        ) from error
    middleware = utilities.get_rmw_implementation_identifier()
    if middleware in _UNSUPPORTED:
        raise ImportError(
            f"idlc's type support does not know {middleware}: set RMW_IMPLEMENTATION to "
            "rmw_fastrtps_cpp or rmw_cyclonedds_cpp, or build the interface package with colcon"
        )
    if middleware in _OPAQUE:
        from . import typesupport_fastrtps as road
    else:
        from . import typesupport_structs as road  # type: ignore[no-redef]
    return road


def _name(cls: Any) -> str:
    """Return the full name of a class as ROS 2 writes it."""
    kind = cls.__module__.split(".")[-2]
    return f"{load().package}/{kind}/{cls.__name__}"


def _handle(cls: Any) -> int:
    """Return the address of any class's type support, whoever made the class."""
    meta = type(cls)
    if meta._TYPE_SUPPORT is None:
        meta.__import_type_support__()
    return c.capsule_pointer(meta._TYPE_SUPPORT)


@cache
def _capsules() -> tuple[object, object, object]:
    """Return what is the same for all classes: destroy, convert from and convert to Python."""
    names = ("Py_DecRef", "PyNumber_MatrixMultiply", "PyNumber_Positive")
    destroy, convert_from_py, convert_to_py = map(c.c_function, names)
    return c.capsule(destroy), c.capsule(convert_from_py), c.capsule(convert_to_py)


def import_message(cls: Any) -> None:
    """Give `type(cls)` the capsules that rclpy reads from a message class."""
    meta = type(cls)
    built = extension(cls, _name(cls))
    if built:
        for attribute, capsule in built.message().items():
            setattr(meta, attribute, capsule)
        return
    support = _message(cls)
    create = c.address(PYFUNCTYPE(py_object)(support.memory))
    meta._CREATE_ROS_MESSAGE = c.capsule(create)
    meta._DESTROY_ROS_MESSAGE, meta._CONVERT_FROM_PY, meta._CONVERT_TO_PY = _capsules()
    meta._TYPE_SUPPORT = c.capsule(support.handle)


@cache
def _message(cls: Any) -> c.MessageSupport:
    return _road().message(cls, _name(cls))  # type: ignore[no-any-return]


def import_service(cls: Any) -> None:
    """Give `type(cls)` the capsule that rclpy reads from a service class."""
    built = extension(cls, _name(cls))
    if built:
        type(cls)._TYPE_SUPPORT = built.service()
        return
    event = services.event(cls.Event, _handle(cls.Event), _message(cls.Event).memory)
    support = services.service(
        _name(cls), _handle(cls.Request), _handle(cls.Response), event, _road()
    )
    type(cls)._TYPE_SUPPORT = c.capsule(support)


def import_action(cls: Any) -> None:
    """Give `type(cls)` the capsule that rclpy reads from an action class."""
    built = extension(cls, _name(cls))
    if built:
        type(cls)._TYPE_SUPPORT = built.action()
        return
    parts = cls.Impl
    support = services.action(
        _name(cls),
        (
            _handle(parts.SendGoalService),
            _handle(parts.GetResultService),
            _handle(parts.CancelGoalService),
        ),
        (_handle(parts.FeedbackMessage), _handle(parts.GoalStatusMessage)),
    )
    type(cls)._TYPE_SUPPORT = c.capsule(support)
