"""Many messages of one type at once, for programs that process recorded data."""

from __future__ import annotations

from struct import Struct

from ..codec import FAILURES, ORDERS, READINGS, deserialize, encode_error, read
from ..errors import DecodeError, ValidationError
from ..objects import owner_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any, NoReturn

#: What precedes each message in a length-delimited stream.
LENGTH = Struct("<I")

#: What precedes each record of an MCAP chunk: opcode and length.
MCAP_RECORD = Struct("<BQ")
MCAP_MESSAGE = 5
#: What precedes the data of an MCAP message: channel, sequence, log and publish time.
MCAP_HEAD = Struct("<HIQQ")


def serialize_many(kind: Any, messages: Iterable[Any], byteorder: str) -> list[bytes]:
    """Return each message's bytes; raise ValidationError that names the message by its index."""
    if byteorder not in ORDERS:
        raise ValueError(f"byteorder must be 'little' or 'big', not {byteorder!r}")
    encode = kind._codec_(ORDERS[byteorder]).encode
    join = b"".join
    messages = list(messages)
    result: list[bytes] = []
    put = result.append
    try:
        for message in messages:
            put(encode(message, join))
    except Exception as error:
        index = len(result)
        failure = encode_error(messages[index], byteorder, error)
        if isinstance(failure, ValidationError):
            raise failure.at(f"[{index}].{failure.path}") from error
        raise failure from error
    return result


def deserialize_many(kind: Any, buffers: Iterable[Any], copy: bool) -> list[Any]:
    """Return the message of each buffer; raise DecodeError that names the buffer by its index."""
    owner = owner_of(kind)
    codecs = owner._codec_
    decode = codecs("<", READINGS[bytes.decode, copy]).decode
    result: list[Any] = []
    put = result.append
    rest = iter(buffers)
    if kind is owner:
        for buffer in rest:
            try:
                if type(buffer) is bytes and buffer[1] == 1 and not buffer[0]:
                    put(decode(buffer))
                else:
                    put(read(codecs, buffer, copy))
            except FAILURES:
                put(_one(kind, buffer, copy, len(result)))
    else:
        for buffer in rest:
            put(_one(kind, buffer, copy, len(result)))
    return result


def _one(kind: Any, buffer: Any, copy: bool, index: int) -> Any:
    """Return one message as `deserialize` would."""
    try:
        return deserialize(kind, buffer, copy=copy)
    except DecodeError as error:
        failed(error, index)


def failed(error: DecodeError, index: int) -> NoReturn:
    """Raise the error again, with the index of the buffer in its path."""
    path = f"[{index}].{error.path}" if error.path else f"[{index}]"
    raise DecodeError(error.problem, path, error.offset) from error


def delimited(buffers: Iterable[Any]) -> bytes:
    """Return the buffers one after the other, each after its size: four bytes, little-endian."""
    pack = LENGTH.pack
    return b"".join([part for raw in buffers for part in (pack(len(raw)), raw)])


def split_delimited(data: Any) -> Iterator[memoryview]:
    """Yield the parts of what `delimited` returns, as views; raise DecodeError if it is cut."""
    view = memoryview(data).cast("B")
    at = 0
    while at < len(view):
        start = at + LENGTH.size
        size = LENGTH.unpack_from(view, at)[0] if start <= len(view) else 0
        if start + size > len(view) or start > len(view):
            raise DecodeError("the stream ends within a message", offset=at)
        at = start + size
        yield view[start:at]


def split_mcap_chunk(records: Any, channel: int) -> Iterator[memoryview]:
    """Yield the messages of one channel in the (uncompressed) records of an MCAP chunk, as views.

    Raises DecodeError if the chunk is cut.
    """
    view = memoryview(records).cast("B")
    at = 0
    while at < len(view):
        start = at + MCAP_RECORD.size
        code, size = MCAP_RECORD.unpack_from(view, at) if start <= len(view) else (0, 0)
        end = start + size
        data = start + MCAP_HEAD.size
        if (
            start > len(view)
            or end > len(view)
            or (code == MCAP_MESSAGE and data > end)
        ):
            raise DecodeError("the chunk ends within a record", offset=at)
        if code == MCAP_MESSAGE and MCAP_HEAD.unpack_from(view, start)[0] == channel:
            yield view[data:end]
        at = end


__all__ = [
    "delimited",
    "deserialize_many",
    "serialize_many",
    "split_delimited",
    "split_mcap_chunk",
]
