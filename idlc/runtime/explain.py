"""Finding out why bytes could not be read: the slow way, field by field."""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING, Any

from .errors import DecodeError
from .typeinfo import FieldInfo, fields_of, type_name

if TYPE_CHECKING:
    from .message import Message


def explain(kind: type[Message], data: bytes, order: str) -> DecodeError:
    """Return the error that says which field of `kind` cannot be read from `data`, and where."""
    reader = _Reader(data, order)
    try:
        reader.message(type_name(kind), "")
    except DecodeError as error:
        return error
    return DecodeError("the message cannot be read", "", len(data))


class _Reader:
    """Walks over a buffer and raises DecodeError where it ends or says too much."""

    def __init__(self, data: bytes, order: str) -> None:
        self.data = data
        self.at = 4
        self.unpack = Struct(order + "I").unpack_from

    def message(self, name: str, path: str) -> None:
        """Skip a structure."""
        fields = fields_of(name)
        if not fields:
            self.skip(1, 1, path or name)
        for field in fields:
            self.field(field, f"{path}.{field.public}" if path else field.public)

    def field(self, field: FieldInfo, path: str) -> None:
        """Skip a field."""
        if not field.is_list:
            self.element(field, path)
            return
        count = field.size
        if count is None:
            count = self.count(path, "elements")
            if field.bound is not None and count > field.bound:
                raise DecodeError(
                    f"{count} elements where at most {field.bound} are allowed",
                    path,
                    self.at - 4,
                )
            self.enough(count * self.least(field), path, f"{count} elements")
        if field.primitive is not None:
            if count:
                self.skip(field.primitive.size * count, field.primitive.size, path)
            return
        for index in range(count):
            self.element(field, f"{path}[{index}]")

    def least(self, field: FieldInfo) -> int:
        """Return the fewest bytes that an element can take."""
        if field.primitive is not None:
            return field.primitive.size
        return 4 if field.text else 1

    def element(self, field: FieldInfo, path: str) -> None:
        """Skip one value."""
        if field.nested:
            self.message(field.nested, path)
        elif field.primitive is not None:
            self.skip(field.primitive.size, field.primitive.size, path)
        elif field.wide:
            self.wide(self.count(path, "units"), path)
        else:
            size = self.count(path, "bytes of text")
            self.enough(size, path, f"{size} bytes of text")
            self.at += size

    def wide(self, count: int, path: str) -> None:
        """Skip a wstring, whose units must be UTF-16."""
        self.enough(4 * count, path, f"{count} units of text")
        for _ in range(count):
            (unit,) = self.unpack(self.data, self.at)
            if unit > 0xFFFF:
                raise DecodeError(f"{unit:#x} is not a UTF-16 unit", path, self.at)
            self.at += 4

    def count(self, path: str, what: str) -> int:
        """Read a count or size."""
        self.skip(4, 4, path, f"the number of {what}")
        found: tuple[Any, ...] = self.unpack(self.data, self.at - 4)
        return int(found[0])

    def skip(self, size: int, align: int, path: str, what: str = "") -> None:
        """Skip a value of known size."""
        self.at += (4 - self.at) % align
        self.enough(size, path, what or f"{size} byte{'s' * (size != 1)}")
        self.at += size

    def enough(self, size: int, path: str, what: str) -> None:
        """Check that `size` bytes are left."""
        left = max(0, len(self.data) - self.at)
        if size > left:
            raise DecodeError(f"{what} expected, {left} bytes left", path, self.at)
