"""Arguments of functions: an error names the kind of value that a function needs."""

from __future__ import annotations

import os
from typing import Any

from idlc.runtime.names import owner_of
from idlc.runtime.typeinfo import structure_of


def texts(value: Any, what: str) -> tuple[str, ...]:
    """Return the texts and paths that an argument lists, or the single one that it is.

    Raises TypeError.
    """
    try:
        listed = (value,) if isinstance(value, (str, os.PathLike)) else tuple(value)
        return tuple(str(os.fspath(each)) for each in listed)
    except TypeError:
        raise TypeError(f"{what} are texts, not {value!r}") from None


def message_class(kind: Any) -> Any:
    """Return a class that idlc generated; raise TypeError for anything else."""
    try:
        is_message = isinstance(kind, type) and bool(structure_of(owner_of(kind)))
    except (AttributeError, ImportError, KeyError, TypeError, ValueError):
        is_message = False
    if not is_message:
        what = "give one of a package that `idlc gen` wrote, or of `idlc.load(...)`"
        raise TypeError(f"{kind!r} is not a message class of idlc: {what}")
    return kind
