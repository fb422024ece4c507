"""Messages in a stream of bytes: a header with the length, and JSON."""

from __future__ import annotations

import re
from typing import BinaryIO

PARSE_ERROR = -32700
INVALID_REQUEST = -32600
METHOD_NOT_FOUND = -32601
INVALID_PARAMS = -32602
INTERNAL_ERROR = -32603
NOT_INITIALIZED = -32002
CANCELLED = -32800
REQUEST_FAILED = -32803


class RequestError(Exception):
    """A request that cannot be answered: a code, and the reason in words for people."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.message = message


#: Bytes of the longest message that is read; a document has 16 MiB at most.
MAX_BODY = 128 << 20
#: Bytes of the longest line in a header.
MAX_LINE = 8192
_LENGTH = re.compile(rb"content-length\s*:\s*(\d{1,15})\s*", re.IGNORECASE)


class TooLongError(Exception):
    """A message was too long and was skipped."""


def read(stream: BinaryIO) -> bytes | None:
    """Return the next message, `None` at the end of the stream; raises TooLongError.

    Lines that are no header are skipped.
    """
    length = None
    while line := stream.readline(MAX_LINE):
        if match := _LENGTH.fullmatch(line):
            length = int(match[1])
        elif line in (b"\r\n", b"\n") and length is not None:
            return _body(stream, length)
    return None


def _body(stream: BinaryIO, length: int) -> bytes | None:
    if length <= MAX_BODY:
        body = stream.read(length)
        return body if len(body) == length else None
    while length > 0:
        passed = len(stream.read(min(length, 1 << 20)))
        if not passed:
            return None
        length -= passed
    raise TooLongError


def write(stream: BinaryIO, body: bytes) -> None:
    """Write a message and flush the stream."""
    stream.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
    stream.flush()
