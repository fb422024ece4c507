"""What is wrong with a recording, or with what was asked of it."""

from __future__ import annotations


class RecordingError(Exception):
    """A recording, or a part of it, cannot be read; `hint` says what can be done about it."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message, hint)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message} ({self.hint})" if self.hint else self.message
