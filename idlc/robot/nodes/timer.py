"""Timers, by the clock of their node or another."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from idlc.robot.nodes.clock import Clock
from idlc.robot.nodes.executor import CallbackGroup, Ready


class Timer(Ready):
    """Calls back once in each period; calls that come too late are left out, not made up for."""

    def __init__(
        self,
        callback: Callable[[], Any] | None,
        group: CallbackGroup | None,
        period: int,
        clock: Clock,
        *,
        autostart: bool = True,
    ) -> None:
        super().__init__(group)
        if period < 0:
            raise ValueError("the period of a timer must not be negative")
        self.callback = callback
        self.clock = clock
        self._period = period
        self._last = self._next = 0
        self._is_canceled = not autostart
        self._restart()
        clock.at_jump.append(self._restart)

    @property
    def timer_period_ns(self) -> int:
        """The period in nanoseconds; a new one counts from the next call on."""
        return self._period

    @timer_period_ns.setter
    def timer_period_ns(self, nanoseconds: int) -> None:
        self._period = int(nanoseconds)

    def _restart(self) -> None:
        self._last = self.clock.elapsed()
        self._next = self._last + self._period

    def begin_period(self) -> None:
        """Begin a period now; the executor notices when the last period would have ended."""
        self._is_canceled = False
        self._restart()

    def cancel(self) -> None:
        """Stop calling, until `reset`."""
        self._is_canceled = True

    def reset(self) -> None:
        """Begin a period now, also after `cancel`."""
        self.begin_period()
        if self._executor is not None:
            self._executor.wake()

    def is_canceled(self) -> bool:
        """Return whether the timer is cancelled."""
        return self._is_canceled

    def is_ready(self) -> bool:
        """Return whether a call is due."""
        return not self._is_canceled and self.clock.elapsed() >= self._next

    def time_since_last_call(self) -> int:
        """Return nanoseconds since the last call, or the start."""
        return self.clock.elapsed() - self._last

    def time_until_next_call(self) -> int | None:
        """Return nanoseconds until the next call, negative if it is late, `None` if cancelled."""
        return None if self._is_canceled else self._next - self.clock.elapsed()

    def seconds_left(self) -> float | None:
        """Return seconds for which an executor can wait; `None` if only the clock ends the wait."""
        left = self.time_until_next_call()
        if left is not None and left > 0 and self.clock.ros_time_is_active:
            return None
        return None if left is None else left / 1e9

    def take(self) -> Callable[[], Any] | None:
        """Return the callback if it is due."""
        if not self.is_ready():
            return None
        self._last = now = self.clock.elapsed()
        self._next += self._period
        if self._period and self._next <= now:
            self._next += (now - self._next) // self._period * self._period + self._period
        return self.callback

    def destroy(self) -> None:
        """Stop for good."""
        self.cancel()
        if self._restart in self.clock.at_jump:
            self.clock.at_jump.remove(self._restart)
