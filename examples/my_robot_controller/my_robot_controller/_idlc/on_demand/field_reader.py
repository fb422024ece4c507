"""Reading field by field, slowly: what the fast codecs refuse.

It takes what middlewares take although it is not right (text that is not UTF-8, text without its
terminating zero), and says of everything else which field cannot be read, and where.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from functools import cache
from struct import Struct
from types import SimpleNamespace
from typing import Any

from ..cdr import NATIVE
from ..codec import maker, order_of
from ..errors import DecodeError
from .typeinfo import FieldInfo, class_of, fields_of, type_name


def read_carefully(kind: type, data: bytes, order: str) -> Any:
    """Return the message in `data`; raise DecodeError naming the field and the byte."""
    name = type_name(kind)

    def make(other: str) -> Any:
        # what a constructor makes may be larger than the buffer
        return maker(kind if other == name else class_of(other))()

    return _Reader(data, order, make).message(name, "")


def check(name: str, data: bytes) -> None:
    """Raise DecodeError, as `deserialize` does, unless `data` is a message of a type.

    No class is needed, so that those of other packages need not be installed.
    """
    _Reader(data, order_of(data), lambda _: SimpleNamespace()).message(name, "")


@cache
def least(name: str) -> int:
    """Return the fewest bytes that a structure can take."""
    fields = fields_of(name)
    sizes = (
        4 if one.is_sequence else (one.size or 1) * least_element(one) for one in fields
    )
    return sum(sizes) if fields else 1


def least_element(field: FieldInfo) -> int:
    """Return the fewest bytes that a value of a field, or an element of it, can take."""
    if field.nested:
        return least(field.nested)
    return 4 if field.primitive is None else field.primitive.size


class _Reader:
    """Goes over a buffer and never further than it has bytes for.

    `make` returns what takes the values of a structure, by its name.
    """

    def __init__(self, data: bytes, order: str, make: Callable[[str], Any]) -> None:
        self.data = data
        self.order = order
        self.make = make
        self.at = 4

    def message(self, name: str, path: str) -> Any:
        """Read a structure."""
        message = self.make(name)
        fields = fields_of(name)
        if not fields:
            self.take(1, 1, path or name)
        for field in fields:
            place = f"{path}.{field.public}" if path else field.public
            setattr(message, field.slot, self.field(field, place))
        return message

    def field(self, field: FieldInfo, path: str) -> Any:
        """Read a field."""
        if not field.is_list:
            return self.element(field, path)
        count = field.size
        if count is None:
            count = self.count(path, "elements")
            if field.bound is not None and count > field.bound:
                problem = f"{count} elements where at most {field.bound} are allowed"
                raise DecodeError(problem, path, self.at - 4)
        self.enough(count * least_element(field), path, f"{count} elements")
        if field.is_numeric and field.primitive is not None:
            return self.numbers(field, count, path)
        return [self.element(field, f"{path}[{index}]") for index in range(count)]

    def numbers(self, field: FieldInfo, count: int, path: str) -> Any:
        """Read an array of numbers."""
        assert field.primitive is not None
        size = field.primitive.size
        result = array(field.primitive.code)
        if count:
            result.frombytes(self.take(count * size, size, path))
        if self.order != NATIVE:
            result.byteswap()
        if field.is_sequence:
            return result
        import numpy as np

        return np.array(result, field.primitive.name)

    def element(self, field: FieldInfo, path: str) -> Any:
        """Read one value."""
        if field.nested:
            return self.message(field.nested, path)
        if field.primitive is not None:
            size = field.primitive.size
            raw = self.take(size, size, path)
            return Struct(self.order + field.primitive.code).unpack(raw)[0]
        if field.wide:
            return self.wide(self.count(path, "units"), path)
        size = self.count(path, "bytes of text")
        raw = self.take(size, 1, path, f"{size} bytes of text")
        return raw.removesuffix(b"\0").decode("utf-8", "replace")

    def wide(self, count: int, path: str) -> str:
        """Read a wstring, whose units must be UTF-16."""
        at = self.at
        units = array("I", self.take(4 * count, 4, path, f"{count} units of text"))
        if self.order != NATIVE:
            units.byteswap()
        for index, unit in enumerate(units):
            if unit > 0xFFFF:
                problem = f"{unit:#x} is not a UTF-16 unit"
                raise DecodeError(problem, path, at + 4 * index)
        raw = b"".join(unit.to_bytes(2, "little") for unit in units)
        return raw.decode("utf-16-le", "replace")

    def count(self, path: str, what: str) -> int:
        """Read a count or size."""
        raw = self.take(4, 4, path, f"the number of {what}")
        return int.from_bytes(raw, "little" if self.order == "<" else "big")

    def take(self, size: int, align: int, path: str, what: str = "") -> bytes:
        """Return the bytes of the next value."""
        self.at += (4 - self.at) % align
        self.enough(size, path, what or f"{size} byte{'s' * (size != 1)}")
        self.at += size
        return self.data[self.at - size : self.at]

    def enough(self, size: int, path: str, what: str) -> None:
        """Check that `size` bytes are left."""
        left = max(0, len(self.data) - self.at)
        if size > left:
            raise DecodeError(f"{what} expected, {left} bytes left", path, self.at)
