"""Names that only annotations use, imported when someone evaluates these."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeAlias, TypedDict

if TYPE_CHECKING:
    from typing_extensions import Unpack
else:
    try:
        from typing import Unpack
    except ImportError:  # Python 3.10

        class Unpack:
            """Stands for what is said of keyword arguments."""

            def __class_getitem__(cls, options):
                return options


#: What numeric sequences take.
Integers: TypeAlias = Iterable[int]
Floats: TypeAlias = Iterable[float]
#: The function that receives a message's parts.
Join: TypeAlias = Callable[[list[Any]], Any]


class Options(TypedDict, total=False):
    """The keywords of every constructor besides the fields."""

    #: Raise AssertionError when a wrong value is assigned, as rosidl's classes do.
    check_fields: bool


__all__ = [
    "Floats",
    "Integers",
    "Iterable",
    "Join",
    "Options",
    "TypeAlias",
    "Unpack",
]
