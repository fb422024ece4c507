"""Support for generated messages: what their modules share. Copied into each package.

It imports the standard library only; `arrays` imports numpy, `typesupport` looks for rclpy.
"""

# what these modules have is all for generated code
# flake8: noqa

from __future__ import annotations

from array import array as array

from .cdr import *
from .codec import *
from .message import *
from .names import *
from .names import lazily
from .sequences import *

#: What generated code expects of the runtime. Each runtime serves all code of its number.
PROTOCOL = 1

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable as Iterable
    from typing import TypeAlias as TypeAlias

    from typing_extensions import Unpack as Unpack

    from . import arrays as arrays
    from .checked import construct as construct
    from .conversions import *
    from .protocol import *
    from .typeinfo import *
else:
    _HINTS = "Floats Integers Iterable Join Options TypeAlias Unpack"
    _LAZY = {**dict.fromkeys(_HINTS.split(), "conversions"), "type_hash": "typeinfo"}
    _LAZY["construct"] = "checked"
    _lazy, __dir__ = lazily(__name__, _LAZY)

    def __getattr__(name):
        """Return what is imported on first use, `arrays` for modules with these names, too."""
        if name == "arrays":
            return __import__(f"{__name__}.arrays", fromlist=["Values"])
        return _lazy(name)
