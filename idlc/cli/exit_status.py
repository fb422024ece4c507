"""The exit status of a command, also after exceptions."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Callable

from idlc.cli.streams import guarded, set_up
from idlc.diagnostics.ci import SpeakingError
from idlc.diagnostics.text import Audience, addressed_to

#: The statuses that shells give to a process ended by SIGINT or SIGPIPE.
INTERRUPTED = 130
PIPE_CLOSED = 141
INTERNAL = 3
#: The errors of a standard stream whose disk is full.
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class PipeClosedError(Exception):
    """The reader of the output is gone; click would end the process itself."""


def status_of(command: Callable[[], object]) -> int:
    """Carry a command out and return the exit status; only a debugged run shows a traceback."""
    set_up()
    with guarded(), addressed_to(Audience.COMMAND):
        return _status_of(command)


def _status_of(command: Callable[[], object]) -> int:
    try:
        os.stat(os.getcwd())  # noqa: PTH109, PTH116 - a server starts without pathlib
    except OSError as error:  # its path may be too long
        reason = f"cannot be opened: {(error.strerror or str(error)).lower()}"
        reason = "is gone" if isinstance(error, FileNotFoundError) else reason
        return _usage_error(f"the working folder {reason}", "change to another folder with `cd`")
    try:
        status = command()
        sys.stdout.flush()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return INTERRUPTED
    except (BrokenPipeError, PipeClosedError):
        _discard_output()
        return PIPE_CLOSED
    except SpeakingError:
        message = "the output contains a line that a CI system would obey as a command"
        return _usage_error(message, "write the output to a file, for example with `> FILE`")
    except OSError as error:
        if error.errno not in _FULL or error.filename:
            return _internal(error)
        _discard_output()
        message = f"cannot write the output: {os.strerror(error.errno).lower()}"
        return _usage_error(message, "free space on the disk, and run it again")
    except Exception as error:
        return _internal(error)
    return status if isinstance(status, int) else 0


def _usage_error(message: str, hint: str) -> int:
    from idlc.cli.output import usage_error

    usage_error(message, hint)
    return 2


def _discard_output() -> None:
    """Discard buffered output, which would fail again when Python closes the stream."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _internal(error: Exception) -> int:
    """Show an unexpected exception as IDL901."""
    from idlc.cli.output import show_internal_error

    if os.environ.get("IDLC_DEBUG") == "1":
        import traceback

        traceback.print_exception(type(error), error, error.__traceback__)
    show_internal_error(error)
    return INTERNAL
