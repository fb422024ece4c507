"""Strings of the generated codecs: many of them at once, and wide ones."""

from __future__ import annotations

from array import array
from struct import Struct

from .cdr import LONG_TEXT, NATIVE, Texts, layout, listed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any

#: Up to so many bytes, looking whether all are ASCII costs less than it saves.
MANY = 1 << 16
#: What follows a short string of each length, so that the next begins at a multiple of four.
ENDS = ["\0\0\0\0", "\0\0\0", "\0\0", "\0"] * 32


def sizes(order: str) -> list[str]:
    """Return what goes before a short string of each length."""
    size = layout(order, "I")
    return [size.pack(length + 1).decode() for length in range(127)]


def unsized(values: Iterable[str]) -> list[str]:
    """Return rows for `rows_writer` of strings of which some are long."""
    return [part for value in values for part in ("\x80", value, "")]


def rows_writer(order: str) -> Callable[[list[str]], bytes]:
    """Return a function that writes strings, from a multiple of four on.

    It takes rows of three: what goes before a string, the string, and what goes after it. ASCII,
    as most strings are, is put together as text and encoded once.
    """
    padded = Texts(order, "I*", align=4)

    def write(rows: list[str]) -> bytes:
        text = "".join(rows)
        if text.isascii():
            excess = len(rows[-1]) - 1 if rows else 0
            block = text.encode()
        else:
            raw = [value.encode() for value in rows[1::3]]
            excess = (-len(raw[-1]) - 1) % 4
            block = b"".join([padded[len(one)](len(one) + 1, one) for one in raw])
        return block[:-excess] if excess else block

    return write


def text_block(
    order: str, size: int | None = None, bound: int | None = None
) -> Callable[[Sequence[str]], bytes]:
    """Return a function that writes an array of `size` strings, or a sequence and its count.

    It writes from a multiple of four on. The last block is kept: what a node publishes has the
    same names in each message.
    """
    sized = sizes(order)
    ended = ENDS
    write_rows = rows_writer(order)
    head = counter(order, size, bound)
    last: tuple[list[str] | None, bytes] = (None, b"")

    def write(values: Sequence[str]) -> bytes:
        nonlocal last
        known, block = last
        if type(values) is list and values == known:
            return block
        values = listed(values)
        rows: list[str] = []
        try:
            for value in values:
                rows += sized[len(value)], value, ended[len(value)]
        except IndexError:
            rows = unsized(values)
        block = head(len(values)) + write_rows(rows)
        if len(block) <= LONG_TEXT:
            last = values, block
        return block

    return write


def counter(order: str, size: int | None, bound: int | None) -> Callable[[int], bytes]:
    """Return a function that checks the number of elements; it returns what goes before them."""
    pack = layout(order, "I").pack

    def count(number: int) -> bytes:
        if number != size if size is not None else bound is not None and number > bound:
            raise ValueError("wrong number of elements")
        return pack(number) if size is None else b""

    return count


def wide_text(order: str) -> Callable[[str], bytes]:
    """Return a function that writes a wstring's UTF-16 units, four bytes each."""
    utf16, utf32 = (
        ("utf-16-le", "utf-32-le") if order == "<" else ("utf-16-be", "utf-32-be")
    )
    gap = b"\x00\x00"

    def write(value: str) -> bytes:
        if not value or max(value) <= "\uffff":
            return value.encode(utf32)
        raw = value.encode(utf16)
        units = [raw[at : at + 2] for at in range(0, len(raw), 2)]
        if order == "<":
            return gap.join(units) + gap
        return gap + gap.join(units)

    return write


def wide_block(
    order: str, size: int | None = None, bound: int | None = None
) -> Callable[[Sequence[str]], bytes]:
    """Return what `text_block` returns, for wstrings."""
    write_one = wide_text(order)
    count = Struct(order + "I").pack
    head = counter(order, size, bound)

    def write(values: Sequence[str]) -> bytes:
        raw = [write_one(value) for value in listed(values)]
        parts = [part for text in raw for part in (count(len(text) // 4), text)]
        return head(len(raw)) + b"".join(parts)

    return write


def read_wide_text(order: str) -> Callable[[bytes], str]:
    """Return a function that reads a wstring's units; lone surrogates become U+FFFD.

    A unit over 0xFFFF is an error, as in Fast DDS.
    """
    utf32 = "utf-32-le" if order == "<" else "utf-32-be"

    def read(raw: bytes) -> str:
        text = bytes(raw).decode(utf32, "surrogatepass")
        if text and max(text) > "\uffff":
            raise ValueError("a wstring holds a unit over 0xFFFF")
        return text.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "replace")

    return read


def texts_reader(order: str, text: Callable[[Any], str]) -> Callable[..., Any]:
    """Return a function that reads the strings of one field's arrays.

    It takes a buffer, the position of the first string and their number, and returns them and
    the position after them. What such arrays hold, names above all, is mostly the same in each
    message of a stream, so the last one is kept: equal bytes are equal strings.
    """
    size_at = Struct(order + "I").unpack_from
    last: tuple[int, bytes, list[str]] = (0, b"", [])

    def read(data: Any, start: int, count: int) -> tuple[list[str], int]:
        nonlocal last
        known, raw, values = last
        end = start + len(raw)
        if count == known and data[start:end] == raw:
            return values[:], end
        values = []
        zero = start - 1
        for _ in range(count):
            at = zero + 4 & -4
            (size,) = size_at(data, at)
            zero = at + 3 + size
            if data[zero]:
                raise ValueError("text without end")
            values.append(text(data[at + 4 : zero]))
        end = zero + 1
        if end - start <= LONG_TEXT:
            last = count, bytes(data[start:end]), values[:]
        return values, end

    return read


def strings_reader(order: str, text: Callable[[Any], str]) -> Callable[..., Any]:
    """Return a function that prepares for many strings from some position of a buffer on.

    It returns the words of the buffer, each under the index of the next, as that is where what it
    is the size of begins; what to cut strings from; and what makes a str of a cut. Where only
    ASCII follows, as it does in small messages of strings, all of it is decoded at once.
    """
    none = array("I")
    ahead = bytes(4)

    def prepare(data: Any, at: int) -> tuple[Any, Any, Callable[[Any], str]]:
        words = none[:]
        words.frombytes(ahead + data[: len(data) & -4])
        if order != NATIVE:
            words.byteswap()
        if type(data) is bytes and len(data) < MANY and data[at:].isascii():
            return words, data.decode("latin-1"), str
        return words, data, text

    return prepare


def wide_texts_reader(order: str) -> Callable[..., Any]:
    """Return the same for arrays of wstrings."""
    size_at = Struct(order + "I").unpack_from
    read_one = read_wide_text(order)

    def read(data: Any, at: int, count: int) -> tuple[list[str], int]:
        values = []
        for _ in range(count):
            (units,) = size_at(data, at)
            end = at + 4 + 4 * units
            if end > len(data):
                raise ValueError("too short")
            values.append(read_one(data[at + 4 : end]))
            at = end
        return values, at

    return read
