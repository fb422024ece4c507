"""How a class gets its codec: made for one byte order, on first use."""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from .cdr import HEADERS, NATIVE, LenientBytes
from .errors import DecodeError, ValidationError

if TYPE_CHECKING:
    from .message import Message

ORDERS = {"little": "<", "big": ">"}


class Codec(NamedTuple):
    """The two functions of one class and byte order.

    `encode(message)` returns the parts of the message in order: buffers, of which the first
    begins with the encapsulation header. Numeric arrays are parts of their own, not copied.
    `decode(data)` returns a message from a buffer that begins with the encapsulation header;
    `bulk` says that `data` may be a memoryview, otherwise it must be `bytes`.
    """

    encode: Callable[[Any], list[Any]]
    decode: Callable[[Any], Any]
    bulk: bool = False


Kind = TypeVar("Kind", bound="type[Message]")


def codec_for(
    kind: type[Message],
) -> Callable[[Callable[[str], Codec]], Callable[[str], Codec]]:
    """Return a decorator that gives a message class the function that makes its codecs."""

    def give(make: Callable[[str], Codec]) -> Callable[[str], Codec]:
        made: dict[str, Codec] = {}

        def codec(order: str) -> Codec:
            found = made.get(order)
            if found is None:
                found = made[order] = make(order)
            return found

        kind._codec_ = staticmethod(codec)
        return make

    return give


def maker(kind: type) -> Callable[[], Any]:
    """Return a function that makes an empty instance, of an idlc-made or rosidl-made class."""
    if "_check_fields" not in getattr(kind, "__slots__", ()) or hasattr(
        kind, "_codec_"
    ):
        return partial(object.__new__, kind)

    def make() -> Any:
        made = object.__new__(kind)
        made._check_fields = False  # type: ignore[attr-defined]
        return made

    return make


def install(kind: type[Message]) -> None:
    """Replace `serialize` and `deserialize` of the class that owns the codec by direct ones."""
    owner = next(base for base in kind.__mro__ if "_codec_" in base.__dict__)
    make = owner._codec_  # type: ignore[attr-defined]
    encode, decode, bulk = make("<")
    join = b"".join

    def serialize(self: Any, *, byteorder: str = "little") -> bytes:
        try:
            if byteorder == "little":
                return join(encode(self))
            return join(make(ORDERS[byteorder]).encode(self))
        except Exception as error:
            raise encode_error(self, byteorder, error) from error

    def deserialize(cls: Any, buffer: Any) -> Any:
        data = buffer if type(buffer) is bytes else memoryview(buffer).cast("B")
        try:
            if data[1] == 1 and not data[0]:
                result = decode(data if bulk else bytes(data))
            else:
                result = make(order_of(data)).decode(data if bulk else bytes(data))
        except (struct.error, ValueError, IndexError, OverflowError) as error:
            result = recover(owner, data, error)
        return result if cls is owner else as_subclass(cls, result)

    serialize.__doc__ = owner.serialize.__doc__
    deserialize.__doc__ = owner.deserialize.__doc__
    owner.serialize = serialize  # type: ignore[method-assign, assignment]
    owner.deserialize = classmethod(deserialize)  # type: ignore[method-assign, assignment]


def as_subclass(kind: type[Any], message: Any) -> Any:
    """Return a message of a user's subclass with the fields of `message`."""
    result = kind.__new__(kind)
    for slot in type(message).__slots__:
        setattr(result, slot, getattr(message, slot))
    return result


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


def recover(kind: type[Message], data: Any, error: Exception) -> Any:
    """Return the message if only its UTF-8 is invalid; raise DecodeError otherwise."""
    if isinstance(error, DecodeError):
        raise error
    order = order_of(data)
    lenient = LenientBytes(data)
    if isinstance(error, UnicodeDecodeError):
        try:
            return kind._codec_(order).decode(lenient)
        except (struct.error, ValueError, IndexError, OverflowError):
            pass
    from .explain import explain

    raise explain(kind, lenient, order) from None


def encode_error(message: Message, byteorder: str, error: Exception) -> Exception:
    """Return the exception that says which field was wrong."""
    if byteorder not in ORDERS:
        return ValueError(f"byteorder must be 'little' or 'big', not {byteorder!r}")
    from .validation import validate

    try:
        validate(message, wire_only=True)
    except ValidationError as found:
        return found
    return error


__all__ = ["NATIVE", "Codec", "codec_for", "install", "maker"]
