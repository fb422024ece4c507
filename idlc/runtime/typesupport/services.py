"""Type support of services and actions, and the events of service introspection.

Both are made of the type support of their messages, so nothing here depends on
which kind that is.
"""

from __future__ import annotations

import ctypes
from ctypes import (
    PYFUNCTYPE,
    c_bool,
    c_int32,
    c_int64,
    c_uint8,
    c_uint32,
    c_void_p,
    py_object,
)
from types import ModuleType
from typing import Any, NamedTuple

from ..on_demand.typeinfo import Structure
from . import c, callbacks, introspection
from .introspection import about


class _EventInfo(ctypes.Structure):
    """`rosidl_service_introspection_info_t`."""

    _fields_ = (
        ("event_type", c_uint8),
        ("sec", c_int32),
        ("nanosec", c_uint32),
        ("client_gid", c_uint8 * 16),
        ("sequence_number", c_int64),
    )


class Event(NamedTuple):
    """The event part of a service's type support: all NULL where event messages cannot be had."""

    handle: int = 0
    create: int = 0
    destroy: int = 0


class _Memory:
    """The functions of message memory that a class's metaclass has for rclpy."""

    def __init__(self, cls: type) -> None:
        def function(name: str, *prototype: Any) -> Any:
            capsule = getattr(type(cls), name)
            return PYFUNCTYPE(*prototype)(c.capsule_pointer(capsule))

        self.create = function("_CREATE_ROS_MESSAGE", c_void_p)
        self.destroy = function("_DESTROY_ROS_MESSAGE", None, c_void_p)
        self.store = function("_CONVERT_FROM_PY", c_bool, py_object, c_void_p)
        self.fetch = function("_CONVERT_TO_PY", py_object, c_void_p)

    def messages(self, memory: int | None) -> list[object]:
        """Return the message in some memory, as events hold it; NULL is no message."""
        return [] if memory is None else [self.fetch(memory)]


def event(cls: Any, handle: int) -> Event:
    """Return how rcl makes and frees messages of a service's Event class.

    Both functions are needed as soon as there is a handle: rcl does not check for NULL.
    """
    requests, responses, events = map(_Memory, (cls.Request, cls.Response, cls.Event))

    def create(info: Any, _: int, request: int | None, response: int | None) -> int:
        memory = 0
        try:
            event_info = info.contents
            message = cls.Event(
                request=requests.messages(request),
                response=responses.messages(response),
            )
            message.info.event_type = event_info.event_type
            message.info.stamp.sec = event_info.sec
            message.info.stamp.nanosec = event_info.nanosec
            message.info.client_gid = list(event_info.client_gid)
            message.info.sequence_number = event_info.sequence_number
            memory = int(events.create())
            events.store(message, memory)
            return memory
        except BaseException as error:
            failure = error
        try:
            if memory:
                events.destroy(memory)
            if callbacks.interrupted(failure):
                return create(info, _, request, response)
            callbacks.report("a service event was not sent", failure)
        except BaseException:  # noqa: S110
            pass
        return 0

    def destroy(memory: int, _: int) -> bool:
        try:
            events.destroy(memory)
        except BaseException as error:
            failure = error
        else:
            return True
        try:  # noqa: SIM105 (a context manager would be called outside of it)
            callbacks.interrupted(failure)
        except BaseException:  # noqa: S110
            pass
        return True

    info = ctypes.POINTER(_EventInfo)
    return Event(
        handle,
        callbacks.callback(
            PYFUNCTYPE(c_void_p, info, c_void_p, c_void_p, c_void_p), create
        ),
        callbacks.callback(PYFUNCTYPE(c_bool, c_void_p, c_void_p), destroy),
    )


def service(
    structure: Structure, request: int, response: int, event: Event, kind: ModuleType
) -> int:
    """Return the address of a service's type support, made from its messages' handles."""
    identifier, data = kind.service(structure.name, request, response, event.handle)
    return c.pointer(
        c.ServiceTypeSupport(
            identifier,
            data,
            introspection.library().same_service,
            request,
            response,
            *event,
            about(structure),
        )
    )


def action(
    structure: Structure, services: tuple[int, int, int], messages: tuple[int, int]
) -> int:
    """Return the address of an action's type support.

    `services`: goal, result, cancel; `messages`: feedback, status.
    """
    return c.pointer(c.ActionTypeSupport(*services, *messages, about(structure)))
