"""Loggers, as those of rclpy: to stderr in the format of ROS 2, and to /rosout."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from enum import IntEnum
from functools import partialmethod
from typing import Any


class LoggingSeverity(IntEnum):
    """The levels of messages, as numbers of rcl_interfaces/msg/Log."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


#: Levels by the name of a logger; the empty name is that of all others.
_levels: dict[str, LoggingSeverity] = {}
#: The times, in seconds, until which lines with options log nothing more.
_quiet: dict[tuple[Any, int], float] = {}


class Logger:
    """A logger; `name` has dots between its parts, and children have the levels of parents.

    `publish` gets the time in nanoseconds, and the other fields of rcl_interfaces/msg/Log.
    """

    def __init__(self, name: str, publish: Callable[..., None] | None = None) -> None:
        self.name = name
        self._publish = publish

    def get_child(self, name: str) -> Logger:
        """Return the logger of a part."""
        return Logger(f"{self.name}.{name}", self._publish)

    def set_level(self, level: int) -> None:
        """Log messages of this level and above."""
        _levels[self.name] = LoggingSeverity(level)

    def is_enabled_for(self, severity: int) -> bool:
        """Return whether messages of this level are logged, by the nearest parent with a level."""
        name = self.name
        while name and not _levels.get(name):
            name = name.rpartition(".")[0]
        return severity >= _levels.get(name, LoggingSeverity.INFO)

    def log(
        self, message: str, severity: int, *, once: bool = False, throttle_duration_sec: float = 0
    ) -> bool:
        """Log a message; return whether it was logged.

        The options apply to the line of the program: it logs `once`, or once in this many seconds.
        """
        if not self.is_enabled_for(severity):
            return False
        frame = sys._getframe(1)  # noqa: SLF001 - as rclpy and logging do
        code, line = frame.f_code, frame.f_lineno
        if once or throttle_duration_sec:
            now = time.monotonic()
            if now < _quiet.get((code, line), now):
                return False
            _quiet[code, line] = math.inf if once else now + throttle_duration_sec
        level, nanoseconds, message = LoggingSeverity(severity), time.time_ns(), _text(message)
        stamp = f"{nanoseconds // 10**9}.{nanoseconds % 10**9:09}"
        print(f"[{level.name}] [{stamp}] [{self.name}]: {message}", file=sys.stderr, flush=True)
        if self._publish is not None:
            file = _text(code.co_filename)
            self._publish(nanoseconds, level, self.name, message, file, code.co_name, line)
        return True

    # bound as `partial` of C, so that the caller's frame is next to that of `log`
    debug = partialmethod(log, severity=LoggingSeverity.DEBUG)
    info = partialmethod(log, severity=LoggingSeverity.INFO)
    warn = warning = partialmethod(log, severity=LoggingSeverity.WARN)
    error = partialmethod(log, severity=LoggingSeverity.ERROR)
    fatal = partialmethod(log, severity=LoggingSeverity.FATAL)


def _text(value: object) -> str:
    """Return text that can be encoded."""
    return str(value).encode(errors="replace").decode()


#: Without a node, a logger writes to stderr only.
get_logger = Logger


def answer_levels(request: Any, response: Any) -> Any:
    """Answer rcl_interfaces/srv/GetLoggerLevels with the levels that were set."""
    levels = [{"name": name, "level": _levels.get(name, 0)} for name in request.names]
    return type(response).from_dict({"levels": levels})


def set_levels(request: Any, response: Any) -> Any:
    """Set the levels in rcl_interfaces/srv/SetLoggerLevels that exist."""
    results = []
    for each in request.levels:
        is_level = each.level in [*LoggingSeverity]
        if is_level:
            _levels[each.name] = LoggingSeverity(each.level)
        reason = "" if is_level else "Failed reason: Invalid logger level."
        results.append({"successful": is_level, "reason": reason})
    return type(response).from_dict({"results": results})
