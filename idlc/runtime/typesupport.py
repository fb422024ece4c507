"""Type support for rclpy, made from Python: what rclpy finds on the metaclass of a class.

rclpy reads capsules from `type(cls)` and, if they are missing, calls the metaclass's
`__import_type_support__`, which comes here.
"""

from __future__ import annotations


def import_message(cls: type) -> None:
    """Give `type(cls)` the capsules that rclpy reads from a message class."""
    from . import typesupport_c as c
    from . import typesupport_fastrtps as road

    meta = type(cls)
    for name, capsule in road.capsules().items():
        setattr(meta, name, capsule)
    meta._TYPE_SUPPORT = c.capsule(road.message_support(cls, cls._type_name))
