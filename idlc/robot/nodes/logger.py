"""Loggers, as those of rclpy: to stderr in the format of ROS 2, and to /rosout."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from enum import IntEnum
from typing import Any, NamedTuple


class LoggingSeverity(IntEnum):
    """The levels of messages, as numbers of rcl_interfaces/msg/Log."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


#: The colours of levels, as numbers of ANSI.
_COLOURS = {"DEBUG": 32, "WARN": 33, "ERROR": 31, "FATAL": 31}
#: Levels by the name of a logger; the empty name is that of all others.
_levels: dict[str, LoggingSeverity] = {}
#: The times, in seconds, of the last messages of logging statements with options.
_logged: dict[tuple[Any, int], float] = {}


class Record(NamedTuple):
    """A logged message; `time` is the system's, in nanoseconds."""

    time: int
    level: LoggingSeverity
    name: str
    message: str
    file: str
    function: str
    line: int


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

    def is_enabled_for(self, severity: int) -> bool:
        """Return whether messages of this level are logged, by the nearest parent with a level."""
        name = self.name
        while name and not _levels.get(name):
            name = name.rpartition(".")[0]
        return severity >= _levels.get(name, LoggingSeverity.INFO)

    def log(
        self,
        message: str,
        severity: int,
        *,
        once: bool = False,
        skip_first: bool = False,
        throttle_duration_sec: float = 0.0,
    ) -> bool:
        """Log a message; return whether it was logged.

        The options apply to the line of the program: `once`, all times but the first, or once in
        this many seconds.
        """
        if not self.is_enabled_for(severity):
            return False
        frame = sys._getframe(1)  # noqa: SLF001 - as rclpy and logging do
        while frame.f_code.co_filename == __file__ and frame.f_back is not None:
            frame = frame.f_back
        code, line = frame.f_code, frame.f_lineno
        if once or skip_first or throttle_duration_sec:
            is_first, now = (code, line) not in _logged, time.monotonic()
            last = _logged.setdefault((code, line), float("-inf"))
            if (skip_first if is_first else once) or now - last < throttle_duration_sec:
                return False
            _logged[code, line] = now
        rest = _text(message), _text(code.co_filename), code.co_name, line
        record = Record(time.time_ns(), LoggingSeverity(severity), self.name, *rest)
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


#: Without a node, a logger writes to stderr only.
get_logger = Logger


def _write(record: Record) -> None:
    seconds, rest = divmod(record.time, 10**9)
    text = f"[{record.level.name}] [{seconds}.{rest:09}] [{record.name}]: {record.message}"
    if sys.stderr and sys.stderr.isatty() and (colour := _COLOURS.get(record.level.name)):
        text = f"\033[{colour}m{text}\033[0m"
    print(text, file=sys.stderr, flush=True)
