"""`Generic` and `TypeVar` for type checkers alone.

typing and what it imports take longer than all that a message needs, so this package imports
typing, collections.abc and functools only for type checkers, who take TYPE_CHECKING for true
whoever defines it.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Generic, TypeVar
else:

    class Generic:
        """A base that can be subscripted and does nothing."""

        def __class_getitem__(cls, _parameters):
            return cls

    def TypeVar(name, *_):
        """Return what a type variable is called."""
        return name


__all__ = ["Generic", "TypeVar"]
