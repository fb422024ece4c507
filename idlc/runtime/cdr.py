"""Building blocks of the generated codecs: plain CDR, version 1.

Positions count from the start of the buffer, whose first four bytes are the encapsulation
header. Values align relative to the byte after the header, so a value of eight bytes may stand
at 4, 12, 20 and so on.

A *layout* says what follows what: one character per number (as in `struct`), `36d` for an array
of 36 doubles that is passed as bytes, `x` for a zero byte, `4s` for the encapsulation header and
`*` for a text with its terminating zero. The padding between them follows from the position.
"""

from __future__ import annotations

from struct import Struct, calcsize
from sys import byteorder

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from typing import Any, TypeAlias

    BySize: TypeAlias = dict[int, Callable[..., bytes]]
else:
    BySize = dict

NATIVE = "<" if byteorder == "little" else ">"

#: The encapsulation header of each byte order.
HEADERS = {"<": b"\x00\x01\x00\x00", ">": b"\x00\x00\x00\x00"}

#: The zeros that bring a position to a multiple of 2, 4 or 8, by the position modulo 8.
PAD2 = tuple(bytes(at % 2) for at in range(8))
PAD4 = tuple(bytes(-at % 4) for at in range(8))
PAD8 = tuple(bytes((4 - at) % 8) for at in range(8))

#: From this size on, the Struct for a text is not kept.
LONG_TEXT = 1024


def layout(
    order: str, fields: str, start: int = 0, text: int = 0, align: int = 1
) -> Struct:
    """Return the Struct of `fields` beginning at `start`, for a text of `text` bytes.

    It ends with the padding that a following value of `align` bytes needs.
    """
    parts = [order]
    at = start
    for count, code in _tokens(fields):
        if code == "*":
            code, size, padding = f"{text}sx", text + 1, 0
        elif code in "sx":
            code, size, padding = count + code, int(count or 1), 0
        else:
            unit = calcsize("<" + code)
            padding = (4 - at) % unit
            size = unit * int(count or 1)
            code = f"{size}s" if count else code
        parts.append("x" * padding + code)
        at += padding + size
    parts.append("x" * ((4 - at) % align))
    return Struct("".join(parts))


def _tokens(fields: str) -> Iterator[tuple[str, str]]:
    """Yield the count, perhaps empty, and the character of each part of a layout."""
    count = ""
    for character in fields:
        if character.isdigit():
            count += character
        else:
            yield count, character
            count = ""


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


def text_block(order: str) -> Callable[[Iterable[str]], bytes]:
    """Return a function that writes the strings of an array, from a multiple of four on.

    Short ASCII strings, as most are, are put together as text and encoded once. The last block is
    kept: what a node publishes has the same names in each message.
    """
    sized = [layout(order, "I").pack(size + 1).decode("latin-1") for size in range(127)]
    ended = [bytes(1 + (-size - 1) % 4).decode() for size in range(127)]
    padded = Texts(order, "I*", align=4)
    last: tuple[list[str], bytes] = ([], b"")

    def write(values: Iterable[str]) -> bytes:
        nonlocal last
        known, block = last
        if type(values) is list and values == known:
            return block
        block = encoded(values)
        if type(values) is list and len(block) <= LONG_TEXT:
            last = values[:], block
        return block

    def encoded(values: Iterable[str]) -> bytes:
        try:
            text = "".join([sized[len(v)] + v + ended[len(v)] for v in values])
            if text.isascii():
                return trimmed(text.encode(), values)
        except IndexError:
            pass
        raw = [value.encode() for value in values]
        return trimmed(b"".join([padded[len(r)](len(r) + 1, r) for r in raw]), raw)

    def trimmed(block: bytes, values: Any) -> bytes:
        """Cut the padding after the last string."""
        excess = (-len(values[-1]) - 1) % 4 if values else 0
        return block[:-excess] if excess else block

    return write


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


def wide_block(order: str) -> Callable[[Iterable[str]], bytes]:
    """Return a function that writes the wstrings of an array, from a multiple of four on."""
    write_one = wide_text(order)
    count = Struct(order + "I").pack

    def write(values: Iterable[str]) -> bytes:
        raw = [write_one(value) for value in values]
        return b"".join(
            [part for text in raw for part in (count(len(text) // 4), text)]
        )

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


def flags(values: Iterable[object]) -> bytes:
    """Return one byte per bool."""
    return bytes(map(bool, values))


def octets(values: Iterable[bytes]) -> bytes:
    """Return one byte per `bytes` of length 1."""
    return bytes(map(ord, values))


def read_flags(raw: bytes | memoryview) -> list[bool]:
    """Return the bools of an array; every byte but zero is true."""
    values: list[Any] = memoryview(raw).cast("?").tolist()
    return values


def read_octets(raw: bytes | memoryview) -> list[bytes]:
    """Return the bytes of an array as `bytes` of length 1."""
    values: list[Any] = memoryview(raw).cast("c").tolist()
    return values


def flags_writer(size: int) -> Callable[[Iterable[object]], bytes]:
    """Return a function that writes exactly `size` bools."""
    return _exactly(size, flags)


def octets_writer(size: int) -> Callable[[Iterable[bytes]], bytes]:
    """Return a function that writes exactly `size` bytes."""
    return _exactly(size, octets)


def _exactly(size: int, write: Callable[[Any], bytes]) -> Callable[[Any], bytes]:
    def checked(values: Any) -> bytes:
        raw = write(values)
        if len(raw) != size:
            raise ValueError("wrong number of elements")
        return raw

    return checked
