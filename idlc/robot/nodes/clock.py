"""Times, clocks and timers, as those of rclpy; `/clock` sets the clock of a simulated node."""

from __future__ import annotations

import math
import time
from enum import IntEnum
from functools import total_ordering
from typing import Any

from idlc.robot.nodes.executor import Callback, CallbackGroup, Ready
from idlc.robot.nodes.interfaces import standard

_SECOND = 10**9


class ClockType(IntEnum):
    """The kinds of clocks."""

    ROS_TIME = 1
    SYSTEM_TIME = 2
    STEADY_TIME = 3


_SYSTEM = ClockType.SYSTEM_TIME


@total_ordering
class _Nanoseconds:
    """The base class of times and durations."""

    clock_type: Any = None

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        self.nanoseconds = int(seconds * _SECOND) + int(nanoseconds)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self.nanoseconds == self._number(other)

    def __lt__(self, other: _Nanoseconds) -> bool:
        return self.nanoseconds < self._number(other)

    def __hash__(self) -> int:
        return hash(self.nanoseconds)

    def __repr__(self) -> str:
        return f"{type(self).__name__}(nanoseconds={self.nanoseconds})"

    def _number(self, other: _Nanoseconds) -> int:
        """Return the nanoseconds of the other; raise TypeError if it cannot be compared."""
        if self.clock_type is not other.clock_type:
            raise TypeError(f"{self!r} and {other!r} are of different clocks")
        return other.nanoseconds

    def to_msg(self) -> Any:
        """Return it as a message of builtin_interfaces."""
        seconds, rest = divmod(self.nanoseconds, _SECOND)
        kind = standard(f"builtin_interfaces/msg/{type(self).__name__}").kind
        return kind(sec=seconds, nanosec=rest)


class Duration(_Nanoseconds):
    """A number of nanoseconds, which can be negative."""


class Time(_Nanoseconds):
    """A time of a clock, in nanoseconds."""

    def __init__(
        self, *, seconds: float = 0, nanoseconds: int = 0, clock_type: ClockType = _SYSTEM
    ) -> None:
        super().__init__(seconds=seconds, nanoseconds=nanoseconds)
        self.clock_type = clock_type
        if not 0 <= self.nanoseconds < 2**63:
            raise ValueError(f"a time must be between 0 and 2**63 ns, not {self.nanoseconds}")

    def seconds_nanoseconds(self) -> tuple[int, int]:
        """Return whole seconds, and the nanoseconds after them."""
        return divmod(self.nanoseconds, _SECOND)

    def __add__(self, other: Duration) -> Time:
        return Time(nanoseconds=self.nanoseconds + other.nanoseconds, clock_type=self.clock_type)

    def __sub__(self, other: Any) -> Any:
        """Return the duration since another time, or the time before a duration."""
        if isinstance(other, Time):
            return Duration(nanoseconds=self.nanoseconds - self._number(other))
        return Time(nanoseconds=self.nanoseconds - other.nanoseconds, clock_type=self.clock_type)

    @classmethod
    def from_msg(cls, msg: Any, clock_type: ClockType = ClockType.ROS_TIME) -> Time:
        """Return the time in a message."""
        return cls(nanoseconds=msg.sec * _SECOND + msg.nanosec, clock_type=clock_type)


class Clock:
    """A clock; one of ROS_TIME is the system's, or simulated."""

    def __init__(self, *, clock_type: ClockType = _SYSTEM) -> None:
        self.clock_type = clock_type
        #: The simulated time in nanoseconds, `None` for the real one.
        self.simulated: int | None = None

    def now(self) -> Time:
        """Return the time now."""
        is_system = self.simulated is None and self.clock_type is not ClockType.STEADY_TIME
        nanoseconds = time.time_ns() if is_system else self.elapsed()
        return Time(nanoseconds=nanoseconds, clock_type=self.clock_type)

    def elapsed(self) -> int:
        """Return nanoseconds that do not jump when the clock of the system is set, for timers."""
        return time.monotonic_ns() if self.simulated is None else self.simulated


class Timer(Ready):
    """Calls back once in each period; calls that come too late are left out, not made up for."""

    def __init__(
        self, callback: Callback | None, group: CallbackGroup | None, period: int, clock: Clock
    ) -> None:
        super().__init__(group)
        if period < 0:
            raise ValueError("the period of a timer must not be negative")
        self.callback = callback
        self.clock = clock
        #: The period in nanoseconds; a new one counts from the next call on.
        self.timer_period_ns = period
        #: The time of the next call; infinite if the timer is cancelled.
        self._next: float = clock.elapsed() + period

    def begin_period(self) -> None:
        """Begin a period now; the executor notices when the last period would have ended."""
        self._next = self.clock.elapsed() + self.timer_period_ns

    def cancel(self) -> None:
        """Stop calling, until `reset`."""
        self._next = math.inf

    destroy = cancel

    def reset(self) -> None:
        """Begin a period now, also after `cancel`."""
        self.begin_period()
        self.wake()

    def wake(self) -> None:
        """Queue a call that is due, or have the executor look when the next one is."""
        if self.nanoseconds_left() <= 0:
            super().wake()
        elif self._executor is not None:
            self._executor.wake()

    def is_canceled(self) -> bool:
        """Return whether the timer is cancelled."""
        return self._next == math.inf

    def nanoseconds_left(self) -> float:
        """Return nanoseconds until the next call, infinite if cancelled, negative if it is late."""
        left = self._next - self.clock.elapsed()
        if self.timer_period_ns < left < math.inf:  # the simulated time moved back
            self.begin_period()
            return self.timer_period_ns
        return left

    def wake_if_ready(self) -> float:
        """Queue a call that is due; return seconds for which an executor can wait."""
        left = self.nanoseconds_left()
        if left <= 0:
            self.wake()
        # /clock ends the wait for simulated time
        return math.inf if left <= 0 or self.clock.simulated is not None else left / 1e9

    def take(self) -> Callback | None:
        """Return the callback if it is due."""
        left = self.nanoseconds_left()
        if left > 0:
            return None
        if period := self.timer_period_ns:
            self._next += period * (-left // period + 1)
        return self.callback


class GuardCondition(Timer):
    """Calls back after each `trigger`, which any thread may call."""

    def __init__(self, callback: Callback, group: CallbackGroup | None, clock: Clock) -> None:
        super().__init__(callback, group, 0, clock)
        self.cancel()

    def trigger(self) -> None:
        """Have the executor call back; until it does, further triggers count as one."""
        self._next = -math.inf
        self.wake()

    def take(self) -> Callback | None:
        """Return the callback if the condition was triggered."""
        was_triggered, self._next = self._next < math.inf, math.inf
        return self.callback if was_triggered else None
