"""Reading the values of options that describe endpoints.

Raises ValueError with a message for people where a value cannot be understood.
"""

from __future__ import annotations

import re

from idlc.scaffold.roles.role import Value

_TOPIC = re.compile(r"(~?/)?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")


def typed(text: str, shape: str = "TYPE:NAME") -> Value:
    """Return the interface and the name that `TYPE:NAME` means."""
    type_, colon, topic = text.partition(":")
    if not colon or not type_ or not topic:
        raise ValueError(f"`{text}` is not {shape}, such as `std_msgs/String:chatter`")
    if not _TOPIC.fullmatch(topic) or "__" in topic:
        raise ValueError(
            f"`{topic}` cannot be the name of a topic, service or action: use letters, digits "
            "and single underscores, parts separated by `/`"
        )
    return Value(type_, topic)


def positive(text: str, what: str, unit: str) -> float:
    """Return the number that a text is, within reasonable limits."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1e-6 <= value <= 1e6:
        raise ValueError(f"{what} must be a number of {unit} above 0, not `{text}`")
    return value


def interval(seconds: float) -> str:
    """Return a period in seconds as source."""
    text = repr(round(seconds, 6))
    return text if abs(float(text) - seconds) < seconds * 1e-9 else f"1.0 / {1.0 / seconds:.6g}"
