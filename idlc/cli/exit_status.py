"""How a command ends, whatever happens in it."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable

#: The statuses that shells give to a process ended by SIGINT or SIGPIPE.
INTERRUPTED = 130
PIPE_CLOSED = 141
INTERNAL = 3


class PipeClosedError(Exception):
    """Nobody reads what idlc writes any more; click would end the process itself."""


def ended(command: Callable[[], object]) -> int:
    """Carry a command out and return the exit status; only a debugged run shows a traceback."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    try:
        os.getcwd()  # noqa: PTH109 - a server starts without pathlib
    except OSError:
        sys.stderr.write("Error: the working folder is gone\n")
        return 2
    try:
        status = command()
        sys.stdout.flush()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return INTERRUPTED
    except (BrokenPipeError, PipeClosedError):
        # what is still buffered would fail again when Python closes the stream
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PIPE_CLOSED
    except Exception as error:
        return _internal(error)
    return status if isinstance(status, int) else 0


def _internal(error: Exception) -> int:
    """Show what must not happen as IDL901."""
    from idlc.cli import output
    from idlc.diagnostics import codes
    from idlc.diagnostics.report import Report
    from idlc.driver.stages import InternalError

    cause, where, subject = error, "", ""
    if isinstance(error, InternalError):
        where, subject = f" in stage `{error.stage}`", error.subject
        cause = error.__cause__ if isinstance(error.__cause__, Exception) else error
    if os.environ.get("IDLC_DEBUG") == "1":
        import traceback

        traceback.print_exception(type(error), error, error.__traceback__)
    report = Report()
    report.add(
        codes.INTERNAL_ERROR.of(
            subject,
            f"idlc failed{where}: {type(cause).__name__}: {cause}",
            hint="this is a bug in idlc, please report it; IDLC_DEBUG=1 shows where it happened",
        )
    )
    output.show(report, "text", sys.stderr)
    return INTERNAL
