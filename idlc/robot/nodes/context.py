"""Contexts: `init`, `shutdown` and `ok`, the session that nodes share, and signals."""

from __future__ import annotations

import atexit
import signal
import sys
import threading
from collections.abc import Sequence
from contextlib import AbstractContextManager
from enum import Enum
from typing import Any
from weakref import WeakSet

from idlc.robot.errors import RobotError
from idlc.robot.nodes.arguments import Arguments, parse_arguments
from idlc.robot.nodes.logger import get_logger
from idlc.robot.session import Session, open_session


class SignalHandlerOptions(Enum):
    """The signals that shut the default context down."""

    NO = 0
    ALL = 3


class Context(AbstractContextManager["Context"]):
    """A session, and the arguments of the program. The session is opened by the first node."""

    def __init__(self, session: Session | None = None) -> None:
        self.arguments = Arguments()
        self._address = ""
        self._session = session
        self._is_own = session is None
        self._is_valid = session is not None
        self._lock = threading.Lock()
        #: Objects with a method `wake` to call at shutdown, also in a signal handler.
        self.sleepers: WeakSet[Any] = WeakSet()

    def init(
        self,
        args: Sequence[str] | None = None,
        signal_handler_options: SignalHandlerOptions | None = None,
        address: str = "",
    ) -> Context:
        """Begin; the result can be used in a `with` statement, which shuts it down.

        `args` are those of the program, `sys.argv` by default. `address` is a robot, such as
        `dds/192.168.1.20` or `tcp/robot:7447` (see `open_session`). Ctrl-C and SIGTERM shut the
        default context down. Raises RobotError.
        """
        if self._is_valid:
            raise RobotError("the context is initialized already", "call `shutdown()` first")
        self.arguments = parse_arguments(sys.argv if args is None else args)
        self._address, self._is_valid = address, True
        is_wanted = self is _default and signal_handler_options is not SignalHandlerOptions.NO
        if is_wanted and threading.current_thread() is threading.main_thread():
            for number in {signal.SIGINT, signal.SIGTERM} - _previous.keys():
                _previous[number] = signal.signal(number, _handle)
        return self

    @property
    def session(self) -> Session:
        """The session; opened if it is not. Raises RobotError."""
        with self._lock:
            if not self._is_valid:
                raise RobotError("the context is not initialized", "call `idlc.robot.init()` first")
            if self._session is None:
                self._session = open_session(self._address)
                for note in self._session.notes:
                    get_logger("idlc").warning(note)
                # tokens go at once, and no thread of the transport calls a program that ends
                atexit.register(self.shutdown)
            return self._session

    def ok(self) -> bool:
        """Return whether the context is initialized and not shut down."""
        return self._is_valid

    def invalidate(self) -> None:
        """End all waits; nodes stay in the graph until `shutdown`. For signal handlers."""
        self._is_valid = False
        for sleeper in [*self.sleepers]:
            sleeper.wake()

    def shutdown(self) -> None:
        """Shut down: nodes leave the graph, and executors stop. May be called again.

        A session that was given is not closed.
        """
        self.invalidate()
        with self._lock:
            session, self._session = self._session, None
        if session is not None and self._is_own:
            atexit.unregister(self.shutdown)
            session.close()
        if self is _default and threading.current_thread() is threading.main_thread():
            for number in [*_previous]:
                if signal.getsignal(number) is _handle:
                    signal.signal(number, _previous.pop(number))

    def __exit__(self, *_: object) -> None:
        self.shutdown()


_default = Context()
_previous: dict[int, Any] = {}


def get_default_context() -> Context:
    """Return the context of programs that name none."""
    return _default


def _handle(number: int, frame: Any) -> None:
    _default.invalidate()
    # of Ctrl-C, the one that raises KeyboardInterrupt
    if callable(previous := _previous.get(number)):
        previous(number, frame)


def init(
    *,
    args: Sequence[str] | None = None,
    context: Context | None = None,
    signal_handler_options: SignalHandlerOptions | None = None,
    address: str = "",
) -> Context:
    """Begin in a context, or in the default context; see `Context.init`."""
    return (context or _default).init(args, signal_handler_options, address)


def ok(*, context: Context | None = None) -> bool:
    """Return whether a context is initialized and not shut down."""
    return (context or _default).ok()


def shutdown(*, context: Context | None = None) -> None:
    """Shut a context down: nodes leave the graph, and executors stop. May be called again."""
    (context or _default).shutdown()


#: In rclpy, `shutdown` fails if it is called twice.
try_shutdown = shutdown
