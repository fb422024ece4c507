"""Python functions that C calls: their signals, errors and other threads.

An exception that leaves a ctypes callback leaves the result uninitialised, and a thread
that runs Python code may have to let another one run, whatever its C callers hold.
"""

from __future__ import annotations

import _thread
import ctypes
import logging
import opcode
from collections.abc import Callable
from ctypes import py_object
from importlib import import_module
from types import FunctionType
from typing import Any

from . import c

#: Arguments of the interpreter's RESUME instruction.
_AT_START, _IN_YIELD_FROM = 0, 2


def callback(prototype: Any, function: Callable[..., object]) -> int:
    """Return the C function that calls `function`, a `try` that catches everything."""
    return c.address(prototype(deaf(function)))


def deaf(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function, which begins with `try`, that no signal interrupts before that.

    Signal handlers run on entry of a Python function, before its first `try`, and what
    they raise would be lost with the result. The interpreter does not look for signals
    where a function resumes inside a `yield from`, so the function is made to look like one.
    (Python 3.10 has no such instruction; it does not look before a leading `try` either.)
    """
    assert isinstance(function, FunctionType)
    code = function.__code__
    raw = bytearray(code.co_code)
    resume = opcode.opmap.get("RESUME")
    at = next((at for at in range(0, len(raw), 2) if raw[at] == resume), None)
    if at is not None and raw[at + 1] == _AT_START:
        raw[at + 1] = _IN_YIELD_FROM
    return FunctionType(
        code.replace(co_code=bytes(raw)),
        function.__globals__,
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )


def interrupted(error: BaseException) -> bool:
    """Return whether a callback should try again because only a signal came in between.

    The signal is sent once more, by another thread: soon, but not before C code is
    left.
    """
    if isinstance(error, Exception):
        return False
    _thread.start_new_thread(_thread.interrupt_main, ())
    return True


def report(what: str, error: BaseException) -> None:
    """Log an error that cannot be raised because C called."""
    logging.getLogger(__package__).warning("%s: %s", what, error)


def taking(name: str, decode: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function that gives what `decode` does, and never raises.

    A signal does not cost the message; garbage is reported to rclpy by `_nothing_taken`.
    """

    def taken(memory: Any) -> Any:
        try:
            return decode(memory)
        except BaseException as error:
            failure = error
        try:
            if not interrupted(failure):
                report(f"a received {name} was dropped", failure)
                nothing = _nothing_taken(name, f"{name}: {failure}")
                thread = _thread.get_ident()
                return nothing[thread]
        except Exception:
            return None
        except BaseException:  # noqa: S110 (one more interrupt)
            pass
        return taken(memory)

    return deaf(taken)


def _nothing_taken(name: str, why: str) -> Any:
    """Return an object whose `[thread]` is `None`, and no message of that type to rclpy.

    rclpy accepts that only before a message is decoded. Afterwards an InvalidHandle
    does it, which executors expect from entities that die; it is an RMWError as well,
    which is what `deserialize_message` raises. It is raised in the thread when C code is
    left, and no sooner if no call follows; for actions, `None` is enough.
    """
    package, kind, _ = name.split("/")
    if kind == "action" or package == "action_msgs":
        return type("Nothing", (), {"__getitem__": {}.get})()
    errors = (
        import_module("rclpy.exceptions").InvalidHandle,
        import_module("rclpy._rclpy_pybind11").RMWError,
    )
    raised = type("UndecodableMessage", errors, {"__str__": lambda _: why})
    prototype = ctypes.PYFUNCTYPE(None, ctypes.c_ulong, py_object)
    later = prototype(
        ("PyThreadState_SetAsyncExc", ctypes.pythonapi), ((1,), (1, "", raised))
    )
    return type("Nothing", (), {"__getitem__": later})()
