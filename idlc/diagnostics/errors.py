"""An exception with a hint, for what programs and commands report in the same words."""

from __future__ import annotations


class HintedError(Exception):
    """An error with a message, and with a hint: something to do about it."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message, hint)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message} ({self.hint})" if self.hint else self.message
