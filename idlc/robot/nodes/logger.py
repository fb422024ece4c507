"""Loggers, as those of rclpy: to stderr in the format of ROS 2, and to /rosout."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterable
from enum import IntEnum
from typing import Any, NamedTuple

from idlc.robot.errors import RobotError


class LoggingSeverity(IntEnum):
    """The levels of messages, as numbers of rcl_interfaces/msg/Log."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


_COLOURS = {
    LoggingSeverity.DEBUG: "\033[32m",
    LoggingSeverity.WARN: "\033[33m",
    LoggingSeverity.ERROR: "\033[31m",
    LoggingSeverity.FATAL: "\033[31m",
}
#: Levels by the name of a logger; the empty name is that of all others.
_levels: dict[str, LoggingSeverity] = {}


class Record(NamedTuple):
    """A logged message; `time` is the system's, in nanoseconds."""

    time: int
    level: LoggingSeverity
    name: str
    message: str
    file: str
    function: str
    line: int


class _Place:
    """The earlier calls of one logging statement."""

    def __init__(self) -> None:
        self.is_first = True
        self.last = 0


_places: dict[tuple[Any, int], _Place] = {}


class Logger:
    """A logger; `name` has dots between its parts, and children have the levels of parents."""

    def __init__(self, name: str, publish: Callable[[Record], None] | None = None) -> None:
        self.name = name
        self._publish = publish

    def get_child(self, name: str) -> Logger:
        """Return the logger of a part."""
        return Logger(f"{self.name}.{name}", self._publish)

    def set_level(self, level: int) -> None:
        """Log messages of this level and above."""
        _levels[self.name] = LoggingSeverity(level)

    def get_effective_level(self) -> LoggingSeverity:
        """Return the level of this logger, or of its nearest parent that has one."""
        name = self.name
        while name:
            if level := _levels.get(name, LoggingSeverity.UNSET):
                return level
            name = name.rpartition(".")[0]
        return _levels.get("", LoggingSeverity.INFO)

    def is_enabled_for(self, severity: int) -> bool:
        """Return whether messages of this level are logged."""
        return severity >= self.get_effective_level()

    def log(
        self,
        message: str,
        severity: int,
        *,
        once: bool = False,
        skip_first: bool = False,
        throttle_duration_sec: float | None = None,
        throttle_time_source_type: Any = None,
    ) -> bool:
        """Log a message; return whether it was logged.

        The options apply to the line of the program: `once`, all times but the first, or once in
        this many seconds, by the clock `throttle_time_source_type` if one is given.
        """
        level = LoggingSeverity(severity)
        if level < self.get_effective_level():
            return False
        frame = sys._getframe(1)  # noqa: SLF001 - as rclpy and logging do
        while frame.f_code.co_filename == __file__ and frame.f_back is not None:
            frame = frame.f_back
        code = frame.f_code
        if once or skip_first or throttle_duration_sec is not None:
            place = _places.setdefault((code, frame.f_lineno), _Place())
            is_first, place.is_first = place.is_first, False
            if (once and not is_first) or (skip_first and is_first):
                return False
            if throttle_duration_sec is not None:
                source = throttle_time_source_type
                now = time.monotonic_ns() if source is None else source.now().nanoseconds
                if not is_first and 0 <= now - place.last < throttle_duration_sec * 1e9:
                    return False
                place.last = now
        where = _text(code.co_filename), code.co_name, frame.f_lineno
        record = Record(time.time_ns(), level, self.name, _text(message), *where)
        _write(record)
        if self._publish is not None:
            self._publish(record)
        return True

    def debug(self, message: str, **options: Any) -> bool:
        """Log for developers; options as `log`."""
        return self.log(message, LoggingSeverity.DEBUG, **options)

    def info(self, message: str, **options: Any) -> bool:
        """Log for information; options as `log`."""
        return self.log(message, LoggingSeverity.INFO, **options)

    def warning(self, message: str, **options: Any) -> bool:
        """Log a warning; options as `log`."""
        return self.log(message, LoggingSeverity.WARN, **options)

    warn = warning

    def error(self, message: str, **options: Any) -> bool:
        """Log an error; options as `log`."""
        return self.log(message, LoggingSeverity.ERROR, **options)

    def fatal(self, message: str, **options: Any) -> bool:
        """Log an error that ends the node; options as `log`."""
        return self.log(message, LoggingSeverity.FATAL, **options)


def _text(value: object) -> str:
    """Return text that can be encoded."""
    return str(value).encode(errors="replace").decode()


def get_logger(name: str) -> Logger:
    """Return a logger that writes to stderr only."""
    return Logger(name)


def set_levels(levels: Iterable[tuple[str, str]]) -> None:
    """Set levels by the names of loggers; raise RobotError for a level that does not exist."""
    for name, level in levels:
        try:
            _levels[name] = LoggingSeverity[level.upper()]
        except KeyError:
            known = ", ".join(each.name.lower() for each in LoggingSeverity)
            raise RobotError(
                f"`{level}` is not a level of loggers", f"write one of {known}"
            ) from None


def _write(record: Record) -> None:
    seconds, rest = divmod(record.time, 10**9)
    text = f"[{record.level.name}] [{seconds}.{rest:09}] [{record.name}]: {record.message}"
    stream = sys.stderr
    if stream is None:  # as under pythonw on Windows
        return
    if (colour := _COLOURS.get(record.level)) and _has_colours(stream):
        text = f"{colour}{text}\033[0m"
    stream.write(f"{text}\n")
    stream.flush()


def _has_colours(stream: Any) -> bool:
    wish = os.environ.get("RCUTILS_COLORIZED_OUTPUT", "")
    return wish == "1" if wish in ("0", "1") else bool(stream.isatty())
