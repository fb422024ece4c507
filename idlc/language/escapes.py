r"""The changes that ROS 2's pipeline makes to text (language 1.5).

rosidl writes each comment line, unit, string constant and string default into an .idl file and
reads it back. On the way escapes are interpreted twice or three times, and some text breaks the
build. `through_idl` does the same to text that idlc keeps, so that idlc accepts the same text
and arrives at the same value as rosidl.
"""

from __future__ import annotations

import re
import warnings

# compiled when a backslash is met, which few files have
_REFUSED = rb"(?s)\\(?:N\{([^}]+)\}|U[0-9a-fA-F]{8}|.?)"
_READ = r"""\\(?:([ntvbrfa\\'"])|(\?)|([0-7]{1,3})|x([0-9a-fA-F]{1,2}))"""
_CLOSING_QUOTE = r'(?<!\\)(?:\\\\)*"'
_SIMPLE = {"a": "\a", "b": "\b", "f": "\f", "n": "\n", "r": "\r", "t": "\t", "v": "\v"}


class EscapeError(ValueError):
    """Text that breaks ROS 2's pipeline: the reason, and the range of the characters at fault."""

    def __init__(self, message: str, start: int, end: int) -> None:
        super().__init__(message)
        self.start = start
        self.end = end


def through_idl(text: str) -> str:
    """Return `text` as rosidl's parser reads it after rosidl's adapter wrote it.

    Raises EscapeError for text that the pipeline refuses. Source: language 1.5, steps B to F.
    """
    if "\\" not in text and "\n" not in text:
        return text
    data = text.encode()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # unknown escapes, which stay
        try:
            interpreted = data.decode("unicode_escape")  # of UTF-8, byte by byte (step B)
            return read_back(interpreted.replace('"', '\\"'), text)
        except UnicodeDecodeError as error:
            refused = re.compile(_REFUSED).match(data, error.start)
    assert refused is not None, text
    start, end = (len(data[:at].decode("utf-8", "ignore")) for at in refused.span())
    escape, name = ((part or b"").decode("utf-8", "replace") for part in refused.group(0, 1))
    message = f"an unknown character name `{name}`" if name else f"an incomplete escape `{escape}`"
    raise EscapeError(message, start, end)


def read_back(literal: str, text: str) -> str:
    """Return the inside of a string literal as rosidl's parser reads it (steps D to F).

    `text` is the user's own, for the location of an error.
    """
    if "\n" in literal or "\r" in literal:
        place = _place(text, r"\\[nr]|\\0?1[25]|\\x0[ad]")
        raise EscapeError("a line break inside a string", *place)
    try:
        literal = literal.encode("latin-1").decode("utf-8")
    except UnicodeError:
        place = _place(text, r"\\[xuUN0-7]|[^\x00-\x7f]")
        raise EscapeError("an unsupported character", *place) from None
    quote = re.search(_CLOSING_QUOTE, literal + '"')
    if quote is None or quote.end() <= len(literal):
        raise EscapeError("a backslash that escapes the closing quote", *_place(text, r"\\+"))
    try:
        return inside_literal(literal)
    except ValueError:
        raise EscapeError(r"an incomplete `\x` escape", *_place(text, r"\\+x")) from None


def inside_literal(literal: str) -> str:
    """Return the inside of a literal in an .idl file as rosidl's parser reads it (step F).

    Raises ValueError for an incomplete escape.
    """
    return re.sub(r'\\(["\\])', r"\1", re.sub(_READ, _reread, literal))


def plain_meaning(text: str) -> str:
    """Return `text` as a reader would understand it: each escape interpreted once."""
    return re.sub(_READ, _reread, text)


def _reread(match: re.Match[str]) -> str:
    simple, question, octal, hexadecimal = match.groups()
    if simple:
        return _SIMPLE.get(simple, simple)
    if question:
        return match.group()
    if octal:
        return chr(int(octal, 8))
    if len(hexadecimal) != 2:
        raise ValueError("one digit")
    return chr(int(hexadecimal, 16))


def _place(text: str, pattern: str) -> tuple[int, int]:
    match = re.search(pattern, text)
    return match.span() if match else (0, len(text))
