"""What idlc prints as bytes: the same on every system, and readable where little can be shown."""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import sys

#: What stands for signs that an encoding does not have.
_PLAIN = {"→": "->", "…": "..."}


def set_up() -> None:
    """Let no text stop a command, and let what Windows redirects be what others redirect.

    There, files and pipes would get the encoding of the country and other line ends, so that no
    program could read them. PYTHONIOENCODING has the last word.
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
    """Return what stands for the first sign that cannot be encoded, and where to go on."""
    if isinstance(error, UnicodeEncodeError) and (plain := _PLAIN.get(error.object[error.start])):
        return plain, error.start + 1
    if isinstance(error, UnicodeEncodeError):
        error.end = error.start + 1
    return codecs.backslashreplace_errors(error)
