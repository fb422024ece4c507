"""Waits of tests: each names what it waits for, and gives up."""

import inspect
import os
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any

#: Seconds that a test waits for one thing, on a busy machine too.
LIMIT = 30
#: Seconds for programs: they compute, and share the processors with other tests.
PROGRAM = 90
#: Seconds for programs that work for long: these install, build, check or test whole packages,
#: show many pages, or exchange all messages of ROS 2 with rosidl.
WORK = 240
_WORKING = frozenset(
    "basedpyright benchmarks build cmake colcon drop_in_side.py emacs make maintenance.release mypy"
    " npm nvim one_side.py pip pre-commit pytest qemu-aarch64 rosidl_side.py uv valgrind"
    " venv".split()
)
_wait = subprocess.Popen.wait
_communicate = subprocess.Popen.communicate


def _rest() -> None:
    time.sleep(0.02)


def wait_for(
    condition: Callable[[], Any],
    what: str | Callable[[], str] = "",
    *,
    between: Callable[[], object] = _rest,
    limit: float = LIMIT,
) -> Any:
    """Return the value of a condition as soon as it holds.

    `what` is for the message of a wait in vain, which shows the text of the condition without it.
    `between` is called between two looks.
    """
    end = time.monotonic() + limit
    while not (value := condition()):
        if time.monotonic() > end:
            name = what() if callable(what) else what
            raise AssertionError(f"waited {limit} s in vain for {name or _text(condition)}")
        between()
    return value


def read_line(stream: Any, limit: float = LIMIT) -> Any:
    """Return the next line of a program's output."""
    lines: list[Any] = []
    reader = Thread(target=lambda: lines.append(stream.readline()), daemon=True)
    reader.start()
    reader.join(limit)
    assert lines, f"waited {limit} s in vain for a line of a program"
    return lines[0]


def join(*threads: Thread) -> None:
    """Wait for the ends of threads."""
    for thread in threads:
        thread.join(LIMIT)
        assert not thread.is_alive(), f"waited {LIMIT} s in vain for the end of {thread}"


def limit_programs() -> None:
    """Let no wait for a program be endless: TimeoutExpired names the program.

    This is for `subprocess.run`, too.
    """

    def wait(self: Any, timeout: float | None = None) -> int:
        return _wait(self, limit_of(self.args) if timeout is None else timeout)

    def communicate(self: Any, input: Any = None, timeout: float | None = None) -> Any:  # noqa: A002
        return _communicate(self, input, limit_of(self.args) if timeout is None else timeout)

    subprocess.Popen.wait = wait  # type: ignore[method-assign]
    subprocess.Popen.communicate = communicate  # type: ignore[method-assign]


def limit_of(command: Any) -> int:
    """Return the seconds that a test waits for a program."""
    is_word = isinstance(command, str | os.PathLike)
    words = [str(command)] if is_word else map(str, command)
    names = {Path(word).name for text in words for word in text.split()}
    return WORK if names & _WORKING else PROGRAM


def _text(condition: Callable[[], Any]) -> str:
    """Return the text of a lambda, or the name of another function."""
    name = getattr(condition, "__qualname__", repr(condition))
    return inspect.getsource(condition).strip() if "<lambda>" in name else name
