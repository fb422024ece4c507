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

from .typing_stub import TypeVar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from typing import Any, TypeAlias

    BySize: TypeAlias = dict[int, Callable[..., bytes]]
else:
    BySize = dict

Value = TypeVar("Value")

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


def listed(values: Collection[Value]) -> list[Value]:
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


def flags_writer(size: int) -> Callable[[Collection[Any]], bytes]:
    """Return a function that writes exactly `size` bools."""
    return _exactly(size, flags)


def octets_writer(size: int) -> Callable[[Collection[bytes]], bytes]:
    """Return a function that writes exactly `size` bytes."""
    return _exactly(size, octets)


def _exactly(size: int, write: Callable[[Any], bytes]) -> Callable[[Any], bytes]:
    def checked(values: Any) -> bytes:
        raw = write(values)
        if len(raw) != size:
            raise ValueError("wrong number of elements")
        return raw

    return checked
