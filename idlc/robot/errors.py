"""The error of everything that goes wrong between a program and a robot."""

from __future__ import annotations


class RobotError(Exception):
    """A problem with the connection or the robot; `hint` is something to do about it."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message, hint)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message} ({self.hint})" if self.hint else self.message
