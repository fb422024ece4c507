"""Messages of each version for the node translator."""

from __future__ import annotations

from .versions.types.translator_new.my_msgs.msg import (
    Drive as NewDrive,
)
from .versions.types.translator_new.my_msgs.msg import (
    Wheel as NewWheel,
)
from .versions.types.translator_new.my_msgs.srv import (
    Ask as NewAsk,
)
from .versions.types.translator_old.my_msgs.msg import (
    Drive as OldDrive,
)
from .versions.types.translator_old.my_msgs.msg import (
    Wheel as OldWheel,
)
from .versions.types.translator_old.my_msgs.srv import (
    Ask as OldAsk,
)

__all__ = [
    'NewAsk',
    'NewDrive',
    'OldAsk',
    'OldDrive',
    'new_ask_request',
    'new_drive',
    'old_ask_response',
]


def new_wheel(old: OldWheel) -> NewWheel:
    """Return the message as NewWheel."""
    new = NewWheel()
    new.radius = float(old.radius)
    # field `name` was added: it gets its default value
    return new


def new_drive(old: OldDrive) -> NewDrive:
    """Return the message as NewDrive."""
    new = NewDrive()
    # TODO: field `velocity` is where `speed` and `gone` was, and may replace it
    raise NotImplementedError('velocity')
    # TODO: field `brakes` is where `speed` and `gone` was, and may replace it
    raise NotImplementedError('brakes')
    # TODO: field `mode` changed from `byte` to `int8`: not every number fits
    raise NotImplementedError('mode')
    new.wheels = [new_wheel(value) for value in old.wheels]
    # field `gear` was added: it gets its default, 3
    # field `speed` was removed: its data is dropped
    # field `gone` was removed: its data is dropped
    return new


def new_ask_request(old: OldAsk.Request) -> NewAsk.Request:
    """Return the message as NewAsk.Request."""
    new = NewAsk.Request()
    new.name = old.name
    # field `loud` was added: it gets its default value
    return new


def old_ask_response(old: NewAsk.Response) -> OldAsk.Response:
    """Return the message as OldAsk.Response."""
    new = OldAsk.Response()
    new.count = old.count
    # field `why` was removed: its data is dropped
    return new
