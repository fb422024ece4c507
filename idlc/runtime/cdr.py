"""Building blocks of the generated codecs: plain CDR, version 1.

Positions count from the start of the buffer, whose first four bytes are the encapsulation
header. Values align relative to the byte after the header, so a value of eight bytes may stand
at 4, 12, 20 and so on.

A *layout* says what follows what: one character per number (as in `struct`), `36d` for an array
of 36 doubles that is passed as bytes, `x` for a zero byte, `4s` for the encapsulation header and
`*` for a text with its terminating zero. The padding between them follows from the position.
"""

from __future__ import annotations

from array import array
from struct import Struct, calcsize
from sys import byteorder

from .names import DecodeError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence
    from typing import Any, TypeAlias, TypeVar

    BySize: TypeAlias = dict[int, Callable[..., bytes]]
    _Value = TypeVar("_Value")
else:
    BySize = dict


NATIVE = "<" if byteorder == "little" else ">"

#: The encapsulation header of each byte order.
HEADERS = {"<": b"\x00\x01\x00\x00", ">": b"\x00\x00\x00\x00"}

#: The zeros that bring a position to a multiple of 2, 4 or 8, by the position modulo 8.
PAD2 = tuple(bytes(at % 2) for at in range(8))
PAD4 = tuple(bytes(-at % 4) for at in range(8))
PAD8 = tuple(bytes((4 - at) % 8) for at in range(8))

#: Up to this many bytes, testing for ASCII costs less than it saves.
ASCII_TESTED = 1 << 16

#: From this size on, the Struct for a text is not kept.
LONG_TEXT = 1024


def layout(
    order: str, fields: str, start: int = 0, text: int = 0, align: int = 1
) -> Struct:
    """Return the Struct of `fields` beginning at `start`, for a text of `text` bytes.

    It ends with the padding that a following value of `align` bytes needs.
    """
    parts, at, count = [order], start, ""
    for code in fields:
        if code.isdigit():
            count += code
            continue
        if code == "*":
            part, size, padding = f"{text}sx", text + 1, 0
        elif code in "sx":
            part, size, padding = count + code, int(count or 1), 0
        else:
            unit = calcsize("<" + code)
            padding = (4 - at) % unit
            size = unit * int(count or 1)
            part = f"{size}s" if count else code
        parts.append("x" * padding + part)
        at += padding + size
        count = ""
    parts.append("x" * ((4 - at) % align))
    return Struct("".join(parts))


def phases(order: str, fields: str, align: int = 1) -> tuple[Struct, ...]:
    """Return the Structs of `fields` by the position modulo 8 at which they begin."""
    return tuple(layout(order, fields, start, 0, align) for start in range(8))


class Texts(BySize):
    """The `pack` functions of a layout with one text, by the size of the text in bytes."""

    def __init__(self, order: str, fields: str, start: int = 0, align: int = 1) -> None:
        super().__init__()
        self._layout = order, fields, start
        self._align = align

    def __missing__(self, size: int) -> Callable[..., bytes]:
        pack = layout(*self._layout, size, self._align).pack
        if size < LONG_TEXT:
            self[size] = pack
        return pack


def text_phases(order: str, fields: str, align: int = 1) -> tuple[Texts, ...]:
    """Return the `Texts` of `fields` by the position modulo 8 at which they begin."""
    return tuple(Texts(order, fields, start, align) for start in range(8))


def listed(values: Collection[_Value]) -> list[_Value]:
    """Return what is in a sequence at this moment; an iterator, which ends, is none."""
    return [*values] if len(values) else []


#: What a bool may be: True, False, 1 and 0, also of numpy. Nothing else is looked at for its truth.
TRUTHS = {False: False, True: True}
_truth = TRUTHS.__getitem__


def flags(values: Any) -> bytes:
    """Return one byte per bool; of a buffer of bytes, whether each is not zero."""
    raw = None if type(values) is list else single_bytes(values)
    if raw is None:
        return bytes(map(_truth, values) if len(values) else b"")
    return bytes(map(bool, raw))


def octets(values: Any) -> bytes:
    """Return one byte per `bytes` of length 1, or the bytes of a buffer."""
    if type(values) is not list:
        raw = single_bytes(values)
        if raw is not None:
            return raw
    values = listed(values)
    raw = b"".join(values)
    if len(raw) != len(values) or set(map(len, values)) - {1}:
        raise ValueError("bytes of another length than 1")
    return raw


def single_bytes(values: Any) -> bytes | None:
    """Return the content of a buffer whose elements are bytes."""
    try:
        view = memoryview(values)
    except TypeError:
        return None
    return view.tobytes() if view.itemsize == 1 else None


def read_flags(raw: bytes | memoryview) -> list[bool]:
    """Return the bools of an array; every byte but zero is true."""
    values: list[Any] = memoryview(raw).cast("?").tolist()
    return values


def read_octets(raw: bytes | memoryview) -> list[bytes]:
    """Return the bytes of an array as `bytes` of length 1."""
    values: list[Any] = memoryview(raw).cast("c").tolist()
    return values


def octets_writer(size: int) -> Callable[[Collection[bytes]], bytes]:
    """Return a function that writes exactly `size` bytes."""
    return flags_writer(size, octets)


def flags_writer(size: int, write: Any = flags) -> Callable[[Collection[Any]], bytes]:
    """Return a function that writes exactly `size` bools."""

    def checked(values: Any) -> bytes:
        raw: bytes = write(values)
        if len(raw) != size:
            raise ValueError("wrong number of elements")
        return raw

    return checked


def order_of(data: Any) -> str:
    """Return the byte order that an encapsulation header names; raise DecodeError otherwise."""
    if len(data) < 4:
        raise DecodeError(
            f"the encapsulation header needs 4 bytes, there are {len(data)}"
        )
    for order, header in HEADERS.items():
        if bytes(data[:2]) == header[:2]:
            return order
    raise DecodeError(
        f"unknown encapsulation {bytes(data[:2]).hex()}, only plain CDR is read"
    )


# many strings at once, and wide ones

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
            block = b"".join([padded[len(data)](len(data) + 1, data) for data in raw])
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
        previous, block = last
        if type(values) is list and values == previous:
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
    end = "le" if order == "<" else "be"
    utf16, utf32 = f"utf-16-{end}", f"utf-32-{end}"
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
    write_text = wide_text(order)
    count = Struct(order + "I").pack
    head = counter(order, size, bound)

    def write(values: Sequence[str]) -> bytes:
        raw = [write_text(value) for value in listed(values)]
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
        previous_count, raw, values = last
        end = start + len(raw)
        if count == previous_count and data[start:end] == raw:
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
        if type(data) is bytes and len(data) < ASCII_TESTED and data[at:].isascii():
            return words, data.decode("latin-1"), str
        return words, data, text

    return prepare


def wide_texts_reader(order: str) -> Callable[..., Any]:
    """Return the same for arrays of wstrings."""
    size_at = Struct(order + "I").unpack_from
    read_text = read_wide_text(order)

    def read(data: Any, at: int, count: int) -> tuple[list[str], int]:
        values = []
        for _ in range(count):
            (units,) = size_at(data, at)
            end = at + 4 + 4 * units
            if end > len(data):
                raise ValueError("too short")
            values.append(read_text(data[at + 4 : end]))
            at = end
        return values, at

    return read
