"""The exit status of a command, also after exceptions."""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import sys
from collections.abc import Callable

#: Replacements of characters that an encoding does not have.
_PLAIN = {"→": "->", "…": "..."}


def set_up() -> None:
    """Replace characters that cannot be encoded, and redirect output on Windows as elsewhere.

    There, files and pipes would get a local encoding and other line ends, which other programs
    cannot read. PYTHONIOENCODING takes precedence.
    """
    codecs.register_error("idlc", _readable)
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


#: The statuses that shells give to a process ended by SIGINT or SIGPIPE.
INTERRUPTED = 130
PIPE_CLOSED = 141
INTERNAL = 3


class PipeClosedError(Exception):
    """The reader of the output is gone; click would end the process itself."""


def status_of(command: Callable[[], object]) -> int:
    """Carry a command out and return the exit status; only a debugged run shows a traceback."""
    set_up()
    try:
        os.stat(os.getcwd())  # noqa: PTH109, PTH116 - a server starts without pathlib
    except OSError as error:  # its path may be too long
        reason = f"cannot be opened: {(error.strerror or str(error)).lower()}"
        reason = "is gone" if isinstance(error, FileNotFoundError) else reason
        sys.stderr.write(f"Error: the working folder {reason}\n")
        return 2
    try:
        status = command()
        sys.stdout.flush()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return INTERRUPTED
    except (BrokenPipeError, PipeClosedError):
        # buffered output would fail again when Python closes the stream
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PIPE_CLOSED
    except Exception as error:
        return _internal(error)
    return status if isinstance(status, int) else 0


def _internal(error: Exception) -> int:
    """Show an unexpected exception as IDL901."""
    from idlc.check.compiler import internal_error
    from idlc.cli import output
    from idlc.diagnostics.report import Report

    if os.environ.get("IDLC_DEBUG") == "1":
        import traceback

        traceback.print_exception(type(error), error, error.__traceback__)
    report = Report()
    hint = "this is a bug in idlc, please report it; IDLC_DEBUG=1 shows where it happened"
    report.add(internal_error(error, "", hint))
    output.show(report, "text", sys.stderr)
    return INTERNAL
