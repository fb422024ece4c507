"""What is wrong with a recording, or with what was asked of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class RecordingError(Exception):
    """A recording, or a part of it, cannot be read; `hint` says what can be done about it."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message, hint)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message} ({self.hint})" if self.hint else self.message


@contextmanager
def of_file(name: str) -> Iterator[None]:
    """Have errors say which file is meant."""
    try:
        yield
    except RecordingError as error:
        if f"`{name}`" in error.message:
            raise
        raise RecordingError(f"`{name}`: {error.message}", error.hint) from None
