"""Pieces of a topic that any engine can hand to its workers.

A part says which bytes of which file to read, and what they mean. So a worker reads these and no
more: no summary, and of an object store only the chunks that it works on.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from idlc.driver.recordings.selection import Selection
from idlc.recordings.container import Container, Db3File, McapFile, Topic, open_pieces
from idlc.recordings.db3 import Rows
from idlc.recordings.mcap_records import Chunk
from idlc.recordings.messages import Messages, Window


class Part(Selection):
    """Some of the messages of a topic, to be read wherever the file can be opened.

    A part can be pickled. `pieces` are chunks of an MCAP file, or rows of a .db3 file.
    """

    def __init__(
        self,
        topic: Topic,
        place: Any,
        ids: tuple[int, ...],
        pieces: tuple[Any, ...],
        window: Window,
        include: tuple[str, ...] = (),
    ) -> None:
        super().__init__(topic, include)
        self.place = place
        self.ids = ids
        self.pieces = pieces
        self.window = window

    def __reduce__(self) -> tuple[Any, ...]:
        return Part, (self.topic, self.place, self.ids, self.pieces, self.window, self.include)

    def __repr__(self) -> str:
        return f"<Part of {self.topic.name} in {self.place}, {len(self.pieces)} pieces>"

    def batches(self) -> Iterator[Messages]:
        """Yield the messages as they are recorded, many at a time."""
        with open_pieces(self.place) as file:
            yield from file.messages(self.ids, self.pieces, self.window)


def divided(
    container: Container, topic: Topic, window: Window, size: int, include: tuple[str, ...] = ()
) -> Iterator[Part]:
    """Yield the parts of a topic, each of about `size` bytes of a file."""
    for file, ids, _ in container.ids_of(topic):
        if isinstance(file, McapFile):
            found: Iterator[tuple[Any, ...]] = _chunks(file, ids, window, size)
        else:
            found = _rows(file, size)
        for pieces in found:
            yield Part(topic, file.place, tuple(ids), pieces, window, include)


def _chunks(file: McapFile, ids: list[int], window: Window, size: int) -> Iterator[tuple[Any, ...]]:
    """Yield neighbours of about `size` bytes."""
    pieces: list[Chunk] = []
    total = 0
    for chunk in file.pieces(ids, window):
        if pieces and total + chunk.size > size:
            yield tuple(pieces)
            pieces, total = [], 0
        pieces.append(chunk)
        total += chunk.size
    if pieces:
        yield tuple(pieces)


def _rows(file: Db3File, size: int) -> Iterator[tuple[Any, ...]]:
    """Yield rows that take about `size` bytes of the file, as if all were of the same size."""
    for first, last in file.database.rows_of_messages():
        count = last - first + 1
        step = max(1, count * size // max(file.database.size, 1))
        for start in range(first, last + 1, step):
            yield (Rows(start, min(start + step - 1, last)),)
