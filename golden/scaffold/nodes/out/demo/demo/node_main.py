"""What the `main` of each node needs: it ends without a traceback, whenever a signal comes."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import atexit
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager, suppress
from functools import wraps
import signal
from threading import Event
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import get_default_context, try_shutdown

Main = Callable[..., None]


@atexit.register
def ignore_signals() -> None:
    """Ignore signals while Python ends: a second Ctrl-C would kill the process there."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


class WakingExecutor(SingleThreadedExecutor):
    """An executor that wakes up once a second: rclpy can miss a signal while it starts."""

    # `__del__` asks for it even where a signal ended `__init__` before it was there
    _sigint_gc: Any = None

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and run it, but never wait without end."""
        super().spin_once(1.0 if timeout_sec is None else timeout_sec)


def until_shutdown(main: Main) -> Main:
    """Make `main` return quietly on Ctrl-C, SIGTERM or a shutdown of rclpy."""

    def run(args: list[str] | None) -> None:
        try:
            main(args)
        except Exception:
            # a signal can shut rclpy down before the node is complete, which is no error
            context = get_default_context()
            if context.handle is None or context.ok():
                raise

    @wraps(main)
    def quiet(args: list[str] | None = None) -> None:
        try:
            run(args)
        except (KeyboardInterrupt, ExternalShutdownException):
            pass
        finally:
            # the signal that ended the node may be shutting rclpy down right now
            with suppress(KeyboardInterrupt, RuntimeError):
                try_shutdown()

    return quiet


class Once:
    """Runs coroutines of a node to their end; Ctrl-C and SIGTERM interrupt that."""

    def __init__(self, interrupted: Event) -> None:
        """Create the executor; `interrupted` is set by a signal."""
        self._interrupted = interrupted
        self._executor = SingleThreadedExecutor()
        self._succeeded = True

    @property
    def status(self) -> int:
        """Return the exit status: 0 if all succeeded, 130 if interrupted, otherwise 1."""
        return 130 if self._interrupted.is_set() else 0 if self._succeeded else 1

    def run(
        self,
        node: Node,
        work: Callable[..., Coroutine[Any, Any, bool]],
        request: object,
        cancel: Callable[[], Coroutine[Any, Any, None]] | None = None,
    ) -> None:
        """Run a coroutine that returns whether it succeeded; `cancel` it if interrupted."""
        self._executor.add_node(node)
        task = self._executor.create_task(work, request)
        ended = self._interrupted.is_set
        while self._executor.context.ok() and not (task.done() or ended()):
            self._executor.spin_once(timeout_sec=0.1)
        self._succeeded = self._succeeded and bool(task.result())
        if self._interrupted.is_set() and cancel is not None:
            task = self._executor.create_task(cancel)
            rclpy.spin_until_future_complete(node, task, self._executor)


@contextmanager
def interruptible(args: list[str] | None) -> Iterator[Once]:
    """Start rclpy for work that is done once, and shut it down after that."""
    interrupted = Event()
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, lambda *_: interrupted.set())
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        yield Once(interrupted)
    finally:
        try_shutdown()
