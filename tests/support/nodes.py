"""Nodes in processes of their own, and what they print."""

import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.support.waiting import LIMIT, wait_for

#: Python's report of an exception in a destructor or in a callback of its own. A signal that
#: interrupts a constructor of rclpy leaves an object that its `__del__` cannot handle. No node can
#: prevent that.
IGNORED = re.compile(
    r"Exception ignored in: .*\nTraceback .*\n"
    r"(?:  File \".*/rclpy/.*\n(?:  .*\n)+\w.*\n|(?:  .*\n)+KeyboardInterrupt: *\n)"
)


def next_without_drop(attempts: Iterator[tuple[int, str]]) -> tuple[int, str]:
    """Return the status and the output of the first attempt in which Fast DDS dropped no response.

    A service of rclpy drops its response if it does not meet the client's reader within 0.1 s,
    which happens on a busy machine; the client then waits for ever.
    """
    ended = next(attempts)
    while "failed to send response (timeout)" in ended[1]:
        following = next(attempts, None)
        if following is None:
            break
        ended = following
    return ended


class Running:
    """A node that runs; its output goes into a file."""

    def __init__(self, log: Path, words: list[str], folder: Path, environment: dict[str, str]):
        self.log = log
        with log.open("w") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-u", "-m", *words],
                cwd=folder,
                env=environment,
                stdout=output,
                stderr=output,
            )

    @property
    def output(self) -> str:
        return self.log.read_text()

    @property
    def fails(self) -> bool:
        """Whether the node printed a traceback that it could have prevented."""
        return "Traceback" in IGNORED.sub("", self.output)

    def said(self) -> list[str]:
        """Return what the node logged, without times and names."""
        return [line.partition("]: ")[2] for line in self.output.splitlines() if "]: " in line]

    def until(self, condition: Callable[[], bool]) -> None:
        wait_for(condition, lambda: f"a node, which printed:\n{self.output}")

    def says(self, text: str) -> None:
        self.until(lambda: text in self.output)

    def ends(self) -> int:
        self.until(lambda: self.process.poll() is not None)
        return self.process.returncode

    def end(self, how: signal.Signals = signal.SIGINT) -> int:
        self.process.send_signal(how)
        return self.ends()


@contextmanager
def nodes(
    folder: Path, logs: Path, environment: dict[str, str]
) -> Iterator[Callable[..., Running]]:
    """Yield a function that starts a module of a package; all are ended at the end."""
    started: list[Running] = []

    def start(*words: str) -> Running:
        log = logs / f"{len(started)}.log"
        started.append(Running(log, list(words), folder, environment))
        return started[-1]

    try:
        yield start
    finally:
        for node in started:
            node.process.kill()
            node.process.wait(LIMIT)
