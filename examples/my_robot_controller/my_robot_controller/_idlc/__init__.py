"""Support for generated messages: what their modules share. Copied into each package.

It imports the standard library only; `arrays` imports numpy, `typesupport` looks for rclpy.
"""

from __future__ import annotations

from array import array as array

# what generated code is written with
from .cdr import *  # noqa: F403
from .codec import *  # noqa: F403
from .message import *  # noqa: F403
from .names import *  # noqa: F403
from .names import lazily
from .sequences import *  # noqa: F403

#: What generated code expects of the runtime. Each runtime serves all code of its number.
PROTOCOL = 1

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .conversions import Any as Any
    from .conversions import Floats as Floats
    from .conversions import Integers as Integers
    from .conversions import Iterable as Iterable
    from .conversions import Join as Join
    from .conversions import Options as Options
    from .conversions import TypeAlias as TypeAlias
    from .conversions import Unpack as Unpack
else:
    _HINTS = "Any Floats Integers Iterable Join Options TypeAlias Unpack"
    __getattr__, __dir__ = lazily(
        __name__, dict.fromkeys(_HINTS.split(), "conversions")
    )
