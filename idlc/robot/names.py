"""Names of ROS 2: their validity and expansion, the parts of actions, and type names of DDS."""

from __future__ import annotations

import re
from typing import NamedTuple

#: The longest name of a topic, service or namespace, and of a node.
MOST_NAME = 247
MOST_NODE_NAME = 255

_ABSOLUTE = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+", re.ASCII)
_RULE = (
    f"write at most {MOST_NAME} characters, such as `arm/joint_1`: letters, digits, `_`, and `/` "
    "between parts that start with no digit"
)
_TYPE = re.compile(r"([a-z]\w*)/(msg|srv|action)/([A-Za-z]\w*)", re.ASCII)
_DDS_TYPE = re.compile(r"([a-z]\w*)::(msg|srv|action)::dds_::([A-Za-z]\w*)_", re.ASCII)
#: The longest name of a type.
MOST_TYPE = 512
_ACTION = "/_action/"


class InvalidNameError(ValueError):
    """A name that ROS 2 does not accept; the message says why."""


def dds_type(name: str) -> str:
    """Return the name in DDS of a type such as `std_msgs/msg/String`.

    Raises InvalidNameError if it is not the full name of a type.
    """
    match = _TYPE.fullmatch(name)
    if match is None or len(name) > MOST_TYPE:
        raise InvalidNameError(f"`{name}` is not a type name; write `package/msg/Name`")
    return "{}::{}::dds_::{}_".format(*match.groups())


def ros_type(name: str) -> str | None:
    """Return the type with this name in DDS; `None` if it is not a name of that form."""
    match = _DDS_TYPE.fullmatch(name) if len(name) <= MOST_TYPE else None
    return "/".join(match.groups()) if match else None


def is_absolute(name: str) -> bool:
    """Return whether this is the valid, expanded name of a topic or service."""
    return len(name) <= MOST_NAME and _ABSOLUTE.fullmatch(name) is not None


def is_namespace(name: str) -> bool:
    """Return whether this is a valid, expanded namespace; `/` is the root."""
    return name == "/" or is_absolute(name)


def is_node_name(name: str) -> bool:
    """Return whether this is a valid name of a node, without its namespace."""
    return len(name) <= MOST_NODE_NAME and name.isascii() and name.isidentifier()


def full_name(namespace: str, name: str) -> str:
    """Return the absolute name of a node, topic or service in a namespace."""
    return f"{namespace.rstrip('/')}/{name}"


def expand_namespace(namespace: str) -> str:
    """Return a namespace with its leading slash; empty means the root.

    Raises InvalidNameError if it is not valid.
    """
    return "/" if namespace in ("", "/") else expand_name(namespace, "/", "")


def expand_name(name: str, namespace: str, node: str) -> str:
    """Return the absolute name of a topic or service that a node calls `name`.

    `~/x` is private to the node, `x` is in its namespace, `/x` is absolute. Raises InvalidNameError
    if the name is not valid.
    """
    absolute = name if name.startswith("/") else full_name(namespace, name)
    if name == "~" or name.startswith("~/"):
        absolute = full_name(namespace, node) + name[1:]
    if not is_absolute(absolute):
        raise InvalidNameError(f"`{name}` is not a name; {_RULE}")
    return absolute


class ActionParts(NamedTuple):
    """The names of the three services and two topics of an action."""

    send_goal: str
    cancel_goal: str
    get_result: str
    feedback: str
    status: str


def action_names(action: str) -> ActionParts:
    """Return the names of the services and topics of an action with this absolute name."""
    return ActionParts(*(f"{action}{_ACTION}{part}" for part in ActionParts._fields))


def action_part(name: str) -> tuple[str, str] | None:
    """Return the action and its part, such as `send_goal`, that a topic or service belongs to."""
    action, separator, part = name.rpartition(_ACTION)
    return (action, part) if separator and action and part in ActionParts._fields else None
