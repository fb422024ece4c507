"""The error of everything that goes wrong between a program and a robot."""

from __future__ import annotations

from idlc.diagnostics.errors import HintedError


class RobotError(HintedError):
    """A problem with the connection or the robot."""
