"""Many serialized messages in one buffer: at known positions, in a stream, in a chunk of MCAP."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from struct import Struct
from typing import Any

from idlc.recordings.containers.records import HEAD, MESSAGE_HEAD, MESSAGE_OP

#: What precedes each message in a length-delimited stream.
LENGTH = Struct("<I")


class Batch:
    """Serialized messages in one buffer, from `starts` to `stops`.

    The buffer is anything that has bytes: a memory-mapped file, for example, which is then
    read in place. A batch is also an iterable of views of the messages.
    """

    def __init__(self, buffer: Any, starts: Any, stops: Any) -> None:
        self.buffer = buffer
        self.starts = starts
        self.stops = stops

    def __len__(self) -> int:
        return len(self.starts)

    def __iter__(self) -> Iterator[memoryview]:
        view = memoryview(self.buffer).cast("B")
        for start, stop in zip(self.starts, self.stops, strict=True):
            yield view[int(start) : int(stop)]


def delimited(buffers: Iterable[Any]) -> bytes:
    """Return the buffers one after the other, each after its size: four bytes, little-endian."""
    pack = LENGTH.pack
    return b"".join([part for raw in buffers for part in (pack(len(raw)), raw)])


def split_delimited(data: Any) -> Iterator[memoryview]:
    """Yield the parts of what `delimited` returns, as views; raise ValueError if it is cut."""
    view = memoryview(data).cast("B")
    at = 0
    while at < len(view):
        start = at + LENGTH.size
        size = LENGTH.unpack_from(view, at)[0] if start <= len(view) else 0
        if start + size > len(view) or start > len(view):
            raise ValueError(f"the stream ends within a message at byte {at}")
        at = start + size
        yield view[start:at]


def split_mcap_chunk(records: Any, channel: int) -> Iterator[memoryview]:
    """Yield the messages of one channel in the (uncompressed) records of an MCAP chunk, as views.

    Raises ValueError if the chunk is cut.
    """
    view = memoryview(records).cast("B")
    at = 0
    while at < len(view):
        start = at + HEAD.size
        code, size = HEAD.unpack_from(view, at) if start <= len(view) else (0, 0)
        end = start + size
        data = start + MESSAGE_HEAD.size
        if start > len(view) or end > len(view) or (code == MESSAGE_OP and data > end):
            raise ValueError(f"the chunk ends within a record at byte {at}")
        if code == MESSAGE_OP and MESSAGE_HEAD.unpack_from(view, start)[0] == channel:
            yield view[data:end]
        at = end
