"""The standard streams: their encoding, and whether they have colours; and signals to stop."""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from threading import Event

#: Replacements of characters that an encoding does not have.
_PLAIN = {"→": "->", "…": "..."}


def set_up() -> None:
    """Replace characters that cannot be encoded, and redirect output on Windows as elsewhere.

    There, files and pipes would get a local encoding and other line ends, which other programs
    cannot read. PYTHONIOENCODING takes precedence.
    """
    codecs.register_error("idlc", _readable)
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115, PTH123
    sys.stderr = sys.stderr or sys.stdout  # a shell can close them with `>&-`
    for stream in (sys.stdout, sys.stderr):
        if not isinstance(stream, io.TextIOWrapper):
            continue
        with contextlib.suppress(ValueError):  # it is closed
            stream.reconfigure(errors="idlc")
            if sys.platform == "win32" and not stream.isatty():
                stream.reconfigure(newline="\n")
                if not os.environ.get("PYTHONIOENCODING"):
                    stream.reconfigure(encoding="utf-8", errors="idlc")


def _readable(error: UnicodeError) -> tuple[str | bytes, int]:
    """Return the replacement of the first character that cannot be encoded, and its end."""
    if isinstance(error, UnicodeEncodeError) and (plain := _PLAIN.get(error.object[error.start])):
        return plain, error.start + 1
    if isinstance(error, UnicodeEncodeError):
        error.end = error.start + 1
    return codecs.backslashreplace_errors(error)


def colours(stream: TextIO) -> bool:
    """Return whether to colour a stream: if it is a terminal, unless the environment decides."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR") or os.environ.get("CLICOLOR_FORCE", "") not in ("", "0"):
        return True
    return stream.isatty() and os.environ.get("TERM") != "dumb"


@contextlib.contextmanager
def stop_signals() -> Iterator[Event]:
    """Yield an event that Ctrl-C and SIGTERM set instead of ending the program."""
    import signal
    from threading import Event

    stopped, numbers = Event(), (signal.SIGINT, signal.SIGTERM)
    handlers = [signal.signal(number, lambda *_: stopped.set()) for number in numbers]
    try:
        yield stopped
    finally:
        for number, handler in zip(numbers, handlers, strict=True):
            signal.signal(number, handler or signal.SIG_DFL)
