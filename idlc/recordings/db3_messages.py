"""The messages of a .db3 file, so many rows at a time."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

import numpy as np

from idlc.recordings.compression import ZSTD_MAGIC, zstd_frame
from idlc.recordings.db3 import Db3, Rows
from idlc.recordings.errors import RecordingError, of_file
from idlc.recordings.messages import Messages, Raw, Separate, Window

#: Rows are handed on together until they have so many bytes.
GROUP = 1 << 25
#: SQLite has no larger integers.
LARGEST = (1 << 63) - 1


def messages(
    database: Db3, pieces: Iterable[Rows], topics: Collection[int], window: Window
) -> Iterator[Messages]:
    """Yield the messages of some topics in some rows."""
    for piece in pieces:
        with of_file(database.name):
            times: list[int] = []
            raws: list[Raw] = []
            size = 0
            for time, data in _rows(database, piece, topics, window):
                times.append(time)
                raws.append(data)
                size += len(data)
                if size >= GROUP:
                    yield Separate(np.array(times, np.int64), None, raws)
                    times, raws, size = [], [], 0
            if raws:
                yield Separate(np.array(times, np.int64), None, raws)


def _rows(
    database: Db3, piece: Rows, topics: Collection[int], window: Window
) -> Iterator[tuple[int, bytes]]:
    """Yield time and content of each message."""
    marks = ", ".join("?" * len(topics))
    start = max(window.start or 0, 0)
    end = LARGEST if window.end is None else min(window.end - 1, LARGEST)
    query = (
        "SELECT timestamp, data FROM messages NOT INDEXED WHERE rowid BETWEEN ? AND ? "  # noqa: S608
        f"AND topic_id IN ({marks}) AND timestamp BETWEEN ? AND ? ORDER BY rowid"
    )
    if start > LARGEST:
        return
    for time, data in database.rows(query, (*piece, *topics, start, max(end, -1))):
        if not isinstance(time, int) or not isinstance(data, bytes):
            raise RecordingError("a message has values of other types")
        yield time, _plain(data)


def _plain(data: bytes) -> bytes:
    """Return a message that may be compressed by itself; none begins like a zstd frame."""
    return zstd_frame(data) if data.startswith(ZSTD_MAGIC) else data
