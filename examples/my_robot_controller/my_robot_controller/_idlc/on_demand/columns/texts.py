"""Columns of strings, as `deserialize` reads them: invalid UTF-8 and UTF-16 become U+FFFD."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from .gather import Source
from .values import Texts


def without_zeros(source: Source, starts: Any, sizes: Any) -> Any:
    """Return the sizes of strings without their terminating zeros, if they have any."""
    last = np.maximum(starts + sizes, 1) - 1
    return sizes - ((sizes > 0) & (source.items(last, "u1") == 0))


def narrow_texts(source: Source, starts: Any, sizes: Any) -> Texts:
    """Return the strings at some places, of so many bytes."""
    made = Texts(offsets_of(sizes), source.ranges(starts, sizes))
    return made if _is_utf8(made) else _encoded(map(_text, _parts(made)))


def wide_texts(source: Source, starts: Any, sizes: Any, order: str, big: Any) -> Texts:
    """Return the strings at some places, of so many UTF-16 units of four bytes."""
    units = utf16_units(source, starts, sizes, order)
    if big is not None:
        swapped = np.repeat(big, sizes)
        units[swapped] = units[swapped].byteswap()
    made = Texts(offsets_of(sizes * 2), units.astype("<u2").view(np.uint8))
    return _encoded(part.decode("utf-16-le", "replace") for part in _parts(made))


def utf16_units(source: Source, starts: Any, sizes: Any, order: str) -> Any:
    """Return the units of strings, one after the other, as numbers."""
    return source.ranges(starts, sizes * 4, 4).view(order + "u4").astype(np.uint32)


def offsets_of(sizes: Any) -> Any:
    """Return where each of some ranges begins, one after the other, and where all end."""
    result = np.zeros(len(sizes) + 1, np.int64)
    np.cumsum(sizes, out=result[1:])
    return result


def _is_utf8(texts: Texts) -> bool:
    """Return whether each text is; that all of them together are is not enough."""
    values = texts.values
    if not len(values) or values.max() < 0x80:
        return True
    begins = values[texts.offsets[:-1][texts.sizes > 0]]
    if ((begins & 0xC0) == 0x80).any():  # within a character
        return False
    try:
        values.tobytes().decode()
    except UnicodeDecodeError:
        return False
    return True


def _parts(texts: Texts) -> Any:
    raw = texts.values.tobytes()
    ends = texts.offsets.tolist()
    return (raw[a:b] for a, b in pairwise(ends))


def _text(raw: bytes) -> str:
    return raw.decode("utf-8", "replace")


def _encoded(texts: Any) -> Texts:
    parts = [text.encode() for text in texts]
    sizes = np.fromiter(map(len, parts), np.int64, len(parts))
    return Texts(offsets_of(sizes), np.frombuffer(b"".join(parts), np.uint8))
