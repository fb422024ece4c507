"""The standard streams: their encoding, and whether they have colours; and signals to stop."""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import stat
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, TextIO

from idlc.diagnostics.ci import Form, silenced

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


#: Characters at the end of an unfinished line that can be a part of a prefix.
_TAIL = 20


class GuardedStream(io.TextIOBase):
    """A standard stream that a CI system may read: text of others never becomes its commands.

    All text is `TEXT`, unless a command says otherwise with `written_as`. Without a form, text is
    written as it is.
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        #: The end of the line so far, without the blanks before it.
        self._tail = ""
        self.form: Form | None = Form.TEXT

    def write(self, text: str) -> int:
        """Write text; raise SpeakingError for exact text that a CI system would obey."""
        self._stream.write(self._silenced(text))
        return len(text)

    def write_bytes(self, data: bytes) -> None:
        """Write exact text as bytes."""
        self._silenced(data.decode("utf-8", "replace"))
        self._stream.buffer.write(data)

    def _silenced(self, text: str) -> str:
        if self.form is None or not text:
            return text
        whole = silenced(self._tail + text, self.form)
        line = f"{self._tail}{text}".rpartition("\n")[2].lstrip()
        if whole.startswith(self._tail):
            text = whole[len(self._tail) :]
        else:  # a prefix begins in what is written already
            text = silenced(f" {text}", self.form)
        self._tail = line if len(line) < _TAIL else f"x{line[1 - _TAIL :]}"
        return text

    @property
    def buffer(self) -> Any:
        """The stream of bytes; exact text is checked there, too."""
        return _GuardedBytes(self) if self.form is Form.EXACT else self._stream.buffer

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """The encoding of the stream."""
        return str(self._stream.encoding)

    @property
    def errors(self) -> str:  # type: ignore[override]
        """The name of the replacement of characters that cannot be encoded."""
        return str(self._stream.errors)

    def flush(self) -> None:
        """Flush the stream."""
        self._stream.flush()

    def writable(self) -> bool:
        """Return True."""
        return True

    def fileno(self) -> int:
        """Return the file descriptor."""
        return int(self._stream.fileno())


class _GuardedBytes(io.RawIOBase):
    """The bytes of exact text."""

    def __init__(self, stream: GuardedStream) -> None:
        self._stream = stream

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, data: Any) -> int:
        """Write bytes of UTF-8."""
        piece = bytes(data)
        self._stream.write_bytes(piece)
        return len(piece)


@contextlib.contextmanager
def guarded() -> Iterator[None]:
    """Guard the standard streams while a command runs."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (
        stream if stream.isatty() else GuardedStream(stream) for stream in before
    )
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


@contextlib.contextmanager
def written_as(form: Form, stream: TextIO) -> Iterator[None]:
    """Say which form all text has that is written to a stream meanwhile.

    No CI system reads a file, so exact text is written to it as it is.
    """
    if not isinstance(stream, GuardedStream):
        yield
        return
    before = stream.form
    stream.form = None if form is Form.EXACT and _is_file(stream) else form
    try:
        yield
    finally:
        stream.form = before


def _is_file(stream: GuardedStream) -> bool:
    try:
        return stat.S_ISREG(os.fstat(stream.fileno()).st_mode)
    except (OSError, ValueError):
        return False
