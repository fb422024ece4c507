"""Time, durations and clocks, as those of rclpy; `/clock` sets the clock of a simulated node."""

from __future__ import annotations

import time
from collections.abc import Callable
from enum import IntEnum
from functools import total_ordering
from typing import Any

from idlc.robot.nodes.interfaces import standard

_SECOND = 10**9


def _message(name: str, nanoseconds: int) -> Any:
    seconds, rest = divmod(nanoseconds, _SECOND)
    return standard(f"builtin_interfaces/msg/{name}").kind(sec=seconds, nanosec=rest)


class ClockType(IntEnum):
    """The kinds of clocks."""

    ROS_TIME = 1
    SYSTEM_TIME = 2
    STEADY_TIME = 3


@total_ordering
class Duration:
    """A number of nanoseconds, which can be negative."""

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        self.nanoseconds = int(seconds * _SECOND) + int(nanoseconds)

    def __repr__(self) -> str:
        return f"Duration(nanoseconds={self.nanoseconds})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Duration) and self.nanoseconds == other.nanoseconds

    def __lt__(self, other: Duration) -> bool:
        return self.nanoseconds < other.nanoseconds

    def __hash__(self) -> int:
        return hash(self.nanoseconds)

    def to_msg(self) -> Any:
        """Return it as builtin_interfaces/msg/Duration."""
        return _message("Duration", self.nanoseconds)

    @classmethod
    def from_msg(cls, msg: Any) -> Duration:
        """Return the duration in a message."""
        return cls(nanoseconds=msg.sec * _SECOND + msg.nanosec)


@total_ordering
class Time:
    """A time of a clock, in nanoseconds."""

    def __init__(
        self,
        *,
        seconds: float = 0,
        nanoseconds: int = 0,
        clock_type: ClockType = ClockType.SYSTEM_TIME,
    ) -> None:
        self.nanoseconds = int(seconds * _SECOND) + int(nanoseconds)
        self.clock_type = clock_type
        if not 0 <= self.nanoseconds < 2**63:
            raise ValueError(f"a time must be between 0 and 2**63 ns, not {self.nanoseconds}")

    def __repr__(self) -> str:
        return f"Time(nanoseconds={self.nanoseconds}, clock_type={self.clock_type.name})"

    def seconds_nanoseconds(self) -> tuple[int, int]:
        """Return whole seconds, and the nanoseconds after them."""
        return divmod(self.nanoseconds, _SECOND)

    def __add__(self, other: Duration) -> Time:
        total = self.nanoseconds + other.nanoseconds
        return Time(nanoseconds=total, clock_type=self.clock_type)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        """Return the duration since another time, or the time before a duration."""
        rest = self.nanoseconds - other.nanoseconds
        if isinstance(other, Time):
            self._same_clock(other)
            return Duration(nanoseconds=rest)
        return Time(nanoseconds=rest, clock_type=self.clock_type)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Time) and self.nanoseconds == self._same_clock(other).nanoseconds

    def __lt__(self, other: Time) -> bool:
        return self.nanoseconds < self._same_clock(other).nanoseconds

    def __hash__(self) -> int:
        return hash(self.nanoseconds)

    def _same_clock(self, other: Time) -> Time:
        if self.clock_type is not other.clock_type:
            names = f"{self.clock_type.name} and {other.clock_type.name}"
            raise TypeError(f"times of different clocks, {names}, cannot be compared")
        return other

    def to_msg(self) -> Any:
        """Return it as builtin_interfaces/msg/Time."""
        return _message("Time", self.nanoseconds)

    @classmethod
    def from_msg(cls, msg: Any, clock_type: ClockType = ClockType.ROS_TIME) -> Time:
        """Return the time in a message."""
        return cls(nanoseconds=msg.sec * _SECOND + msg.nanosec, clock_type=clock_type)


class Clock:
    """A clock; one of ROS_TIME is the system's, or simulated while `simulated` is not `None`."""

    def __init__(self, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> None:
        self.clock_type = clock_type
        self._simulated: int | None = None
        #: Called with no arguments when simulated time begins, moves back, or ends.
        self.at_jump: list[Callable[[], None]] = []

    @property
    def ros_time_is_active(self) -> bool:
        """True if the time is simulated."""
        return self._simulated is not None

    def now(self) -> Time:
        """Return the time now."""
        if self._simulated is not None:
            nanoseconds = self._simulated
        elif self.clock_type is ClockType.STEADY_TIME:
            nanoseconds = time.monotonic_ns()
        else:
            nanoseconds = time.time_ns()
        return Time(nanoseconds=nanoseconds, clock_type=self.clock_type)

    def elapsed(self) -> int:
        """Return nanoseconds that do not jump when the clock of the system is set, for timers."""
        return time.monotonic_ns() if self._simulated is None else self._simulated

    def simulate(self, nanoseconds: int | None) -> None:
        """Set the simulated time, `None` for the real one."""
        before, self._simulated = self._simulated, nanoseconds
        if before is None or nanoseconds is None or nanoseconds < before:
            for jump in self.at_jump if before != nanoseconds else ():
                jump()
