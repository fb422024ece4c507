"""Type support for rclpy, made from Python: what rclpy finds on the metaclass of a class.

rclpy reads capsules from `type(cls)` and, if they are missing, calls the metaclass's
`__import_type_support__`, which comes here. Nothing else imports these modules.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

from . import typesupport_c as c
from . import typesupport_services as services


def _road() -> ModuleType:
    """Return the module that fits the middleware of this process."""
    from . import typesupport_fastrtps

    return typesupport_fastrtps


def _handle(cls: Any) -> int:  # noqa: ANN401
    """Return the address of any class's type support, whoever made the class."""
    meta = type(cls)
    if meta._TYPE_SUPPORT is None:
        meta.__import_type_support__()
    return c.capsule_pointer(meta._TYPE_SUPPORT)


def import_message(cls: Any) -> None:  # noqa: ANN401
    """Give `type(cls)` the capsules that rclpy reads from a message class."""
    meta = type(cls)
    capsules = _road().message(cls, cls._type_name)
    meta._CREATE_ROS_MESSAGE = capsules.create
    meta._DESTROY_ROS_MESSAGE = capsules.destroy
    meta._CONVERT_FROM_PY = capsules.convert_from_py
    meta._CONVERT_TO_PY = capsules.convert_to_py
    meta._TYPE_SUPPORT = capsules.type_support


def import_service(cls: Any) -> None:  # noqa: ANN401
    """Give `type(cls)` the capsule that rclpy reads from a service class."""
    road = _road()
    event = services.event(cls.Event, _handle(cls.Event), road)
    support = services.service(
        cls._type_name, _handle(cls.Request), _handle(cls.Response), event, road
    )
    type(cls)._TYPE_SUPPORT = c.capsule(support)


def import_action(cls: Any) -> None:  # noqa: ANN401
    """Give `type(cls)` the capsule that rclpy reads from an action class."""
    parts = cls.Impl
    support = services.action(
        cls._type_name,
        (
            _handle(parts.SendGoalService),
            _handle(parts.GetResultService),
            _handle(parts.CancelGoalService),
        ),
        (_handle(parts.FeedbackMessage), _handle(parts.GoalStatusMessage)),
    )
    type(cls)._TYPE_SUPPORT = c.capsule(support)
