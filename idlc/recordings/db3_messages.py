"""The messages of a .db3 file, so many rows at a time."""

from __future__ import annotations

from collections.abc import Collection, Generator, Iterable, Iterator
from contextlib import closing

import numpy as np

from idlc.recordings.compression import ZSTD_MAGIC, Room, zstd_frame
from idlc.recordings.db3 import Db3, Rows
from idlc.recordings.errors import RecordingError, of_file
from idlc.recordings.messages import Messages, Raw, Separate, Window

#: Rows are handed on together until they have so many bytes.
GROUP = 1 << 25
#: SQLite has no other integers.
SMALLEST, LARGEST = -(1 << 63), (1 << 63) - 1


def messages(
    database: Db3, pieces: Iterable[Rows], topics: Collection[int], window: Window
) -> Iterator[Messages]:
    """Yield the messages of some topics in some rows."""
    room = Room(database.size)
    for piece in pieces:
        with of_file(database.name):
            first: int | None = piece.first
            while first is not None:
                times, raws, first = _group(database, Rows(first, piece.last), topics, window, room)
                if raws:
                    yield Separate(np.array(times, np.int64), None, raws)


def _group(
    database: Db3, piece: Rows, topics: Collection[int], window: Window, room: Room
) -> tuple[list[int], list[Raw], int | None]:
    """Return times and contents of the first messages, and the row that is next, if any.

    The file is locked meanwhile, and not when these are used: a recorder can go on writing.
    """
    times: list[int] = []
    raws: list[Raw] = []
    size = 0
    with closing(_rows(database, piece, topics, window, room)) as rows:
        for row, time, data in rows:
            times.append(time)
            raws.append(data)
            size += len(data)
            if size >= GROUP:
                return times, raws, row + 1 if row < piece.last else None
    return times, raws, None


def _rows(
    database: Db3, piece: Rows, topics: Collection[int], window: Window, room: Room
) -> Generator[tuple[int, int, bytes], None, None]:
    """Yield row, time and content of each message."""
    marks = ", ".join("?" * len(topics))
    start = SMALLEST if window.start is None else max(window.start, SMALLEST)
    end = LARGEST if window.end is None else min(window.end - 1, LARGEST)
    query = (
        "SELECT rowid, timestamp, data FROM messages NOT INDEXED WHERE rowid BETWEEN ? AND ? "  # noqa: S608
        f"AND topic_id IN ({marks}) AND (timestamp BETWEEN ? AND ? "
        "OR typeof(timestamp) <> 'integer') ORDER BY rowid"
    )
    if start > end:
        return
    found = database.rows(query, (*piece, *topics, start, end))
    with closing(found):
        for row, time, data in found:
            if not isinstance(time, int) or not isinstance(data, bytes):
                raise RecordingError("a message has values of other types")
            yield row, time, data if data[:4] != ZSTD_MAGIC else zstd_frame(data, room)
