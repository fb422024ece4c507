"""The .db3 files of rosbag2, which are SQLite databases.

Such a file can come from anybody. It is opened for reading only, nothing that it defines besides
tables is accepted, and values are taken only of the types that a recorder writes.
"""

from __future__ import annotations

import shlex
import sqlite3
from collections.abc import Collection, Generator, Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import quote

from idlc.recordings.containers.compression import ZSTD_MAGIC, Room, zstd_frame
from idlc.recordings.containers.file import START, Schema, Topic, full_name, recorded_schema
from idlc.recordings.containers.source import RecordingError, first_bytes, of_file

if TYPE_CHECKING:
    from idlc.recordings.containers.messages import Messages, Window

MAGIC = b"SQLite format 3\0"
#: Hidden columns of these kinds are computed by the file.
COMPUTED = {2, 3}
#: Byte 18 of the header of a database that is written by way of a log, `-wal`.
WRITES_A_LOG = 2
#: Seconds to wait for a writer that has locked the file.
PATIENCE = 5.0
#: Messages are yielded together until they have so many bytes.
GROUP = 1 << 25
#: SQLite has no other integers.
SMALLEST, LARGEST = -(1 << 63), (1 << 63) - 1


class Rows(NamedTuple):
    """Messages from one row to another, which belongs to them."""

    first: int
    last: int


class Db3File:
    """An open .db3 file; without `read`, nothing is read of its topics."""

    def __init__(self, path: Path, read: bool = True) -> None:
        self.name = self.place = str(path)
        self._path = path.resolve()
        self._log = self._path.with_name(self._path.name + "-wal")
        # SQLite makes files beside a database that has a log, even to read it
        log = first_bytes(path, 19)[18:] == bytes([WRITES_A_LOG])
        self._lone = log and not self._is_in_use()
        self._state = self._path.stat()
        self.notes: list[str] = []
        if self._lone:
            why = f"it was written with `{self._log.name}`, which is missing"
            missing = f"{why}: without that file, the last messages are missing"
            self.notes.append(f"{self._path.name}: {missing}")
        with self._errors():
            location = f"file:{quote(str(self._path))}?mode=ro{'&immutable=1' * self._lone}"
            self._db = sqlite3.connect(location, PATIENCE, uri=True, check_same_thread=False)
            # truncating a mapped file would kill the process
            for pragma in "trusted_schema=OFF query_only=ON cell_size_check=ON mmap_size=0".split():
                self._db.execute(f"PRAGMA {pragma}")
        try:
            self.columns = self._tables()
            ((page,),) = self._rows("PRAGMA page_size")
            if rest := self._path.stat().st_size % page:  # which SQLite fills with zeros
                raise RecordingError(f"`{self.name}` is cut off after {rest:,} bytes of a page")
            self.topics = list(self._topics(self.columns)) if read else []
        except RecordingError:
            self._db.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def _is_in_use(self) -> bool:
        """Return whether a journal or log has something that the file has not, or may have."""
        logs = (self._log, self._path.with_name(self._path.name + "-journal"))
        # an empty one has nothing, and one that is done may be marked with zeros
        return any(path.is_file() and first_bytes(path, 1) not in (b"", b"\0") for path in logs)

    @contextmanager
    def _errors(self) -> Iterator[None]:
        """Turn errors of SQLite into errors about the recording."""
        try:
            yield
        except (sqlite3.Error, OSError, OverflowError, UnicodeError) as error:
            what, hint = str(error), None
            if "readonly" in what:  # it would have to write to roll back
                why = "is incomplete: its writer stopped within a transaction"
                hint = f"SQLite undoes it: sqlite3 {shlex.quote(self.name)} .schema"
            elif "locked" in what:
                why = "is locked by the program that is writing it"
                hint = "try again after the program exits"
            elif "unable to open" in what and self._is_in_use():
                why = f"cannot be read with its `{self._log.name}`, which needs a file beside it"
                hint = "copy both to a folder of your own"
            else:
                why = f"cannot be read: {what}"
            raise RecordingError(f"`{self.name}` {why}", hint) from None

    def _rows(
        self, query: str, values: tuple[Any, ...] = ()
    ) -> Generator[tuple[Any, ...], None, None]:
        """Yield the rows of a query; the file is locked until it is exhausted or closed."""
        with self._errors(), closing(self._db.execute(query, values)) as cursor:
            yield from cursor
            if self._lone:
                self._check_unchanged()

    def _check_unchanged(self) -> None:
        """Raise RecordingError if a file that was read without a lock has changed."""
        now, then = self._path.stat(), self._state
        if self._is_in_use() or (now.st_mtime_ns, now.st_size) != (then.st_mtime_ns, then.st_size):
            raise RecordingError(f"`{self.name}` was changed while it was read", "read it again")

    def _tables(self) -> dict[str, set[str]]:
        """Return each table's columns; raise RecordingError if there are others than plain ones."""
        tables: dict[str, set[str]] = {}
        for kind, name, text in self._rows("SELECT type, name, sql FROM sqlite_master"):
            if kind == "index":
                continue
            if kind != "table" or str(text).split()[1:2] != ["TABLE"]:
                what = f"a {kind if kind != 'table' else 'virtual table'}, `{name}`"
                raise RecordingError(
                    f"`{self.name}` contains {what}, which recordings never contain"
                )
            quoted = '"' + str(name).replace('"', '""') + '"'
            columns = list(self._rows(f"PRAGMA table_xinfo({quoted})"))
            if any(column[6] in COMPUTED for column in columns):
                raise RecordingError(f"`{self.name}`: columns of `{name}` are computed")
            if "rowid" in {str(column[1]).lower() for column in columns}:
                # it hides the numbers of rows, which no two have in common
                raise RecordingError(f"`{self.name}`: a column of `{name}` is called rowid")
            tables[str(name)] = {str(column[1]) for column in columns}
        required = {"topics": {"id", "name", "type"}, "messages": {"topic_id", "data"}}
        for table, needed in required.items():
            if not needed <= tables.get(table, set()):
                raise RecordingError(
                    f"`{self.name}` is not a recording: it has no table of {table}"
                )
        return tables

    def _topics(self, columns: dict[str, set[str]]) -> Iterator[tuple[Topic, int]]:
        """Yield the topics, with their definitions where the file has any."""
        own = columns["topics"]
        encoding = "serialization_format" if "serialization_format" in own else "'cdr'"
        digest = "type_description_hash" if "type_description_hash" in own else "''"
        query = f"SELECT id, name, type, {encoding}, {digest} FROM topics ORDER BY id"  # noqa: S608 # ours
        definitions = self._definitions(columns.get("message_definitions", set()))
        counting = "SELECT topic_id, COUNT(*) FROM messages NOT INDEXED GROUP BY topic_id"
        counts = dict(self._rows(counting))
        for number, *texts in self._rows(query):
            if not isinstance(number, int) or not all(isinstance(text, str) for text in texts):
                raise RecordingError(f"`{self.name}`: a topic has values of other types")
            name, kind, encoding, digest = texts
            # the definition of a service is that of its events, too
            recorded = definitions.get(kind) or definitions.get(kind.removesuffix("_Event"))
            schema_encoding, text, other = recorded or ("", "", "")
            kind, count = full_name(kind), counts.get(number, 0)
            schema = recorded_schema(Schema(kind, schema_encoding, text))
            yield Topic(name, kind, count, digest or other or None, encoding, schema), number

    def _definitions(self, columns: set[str]) -> dict[str, tuple[str, str, str]]:
        """Return encoding, text and hash of each type."""
        if not {"topic_type", "encoding", "encoded_message_definition"} <= columns:
            return {}
        digest = "type_description_hash" if "type_description_hash" in columns else "''"
        # the text may be in any encoding, as comments are
        names = f"topic_type, encoding, CAST(encoded_message_definition AS BLOB), {digest}"
        definitions: dict[str, tuple[str, str, str]] = {}
        for kind, *texts in self._rows(f"SELECT {names} FROM message_definitions ORDER BY rowid"):  # noqa: S608 # ours
            encoding, text, other = (
                str(value, "utf-8", "replace") if isinstance(value, bytes) else str(value or "")
                for value in texts
            )
            if not definitions.get(kind, ("", "", ""))[1]:
                definitions[kind] = ("" if encoding == "unknown" else encoding, text, other)
        return definitions

    @property
    def start(self) -> int | None:
        """The time of the first message."""
        ((time,),) = self._rows("SELECT MIN(timestamp) FROM messages NOT INDEXED")
        return time if isinstance(time, int) else None

    def profiles(self) -> dict[int, str]:
        """Return the quality of service that was offered, as rosbag2 writes it, by topic."""
        if "offered_qos_profiles" not in self.columns["topics"]:
            return {}
        rows = self._rows("SELECT id, offered_qos_profiles FROM topics")
        return {number: text for number, text in rows if isinstance(text, str)}

    def metadata(self) -> str:
        """Return the bag's metadata that rosbag2 keeps in the file, empty if there is none."""
        if "metadata" not in self.columns.get("metadata", set()):
            return ""
        texts = [text for (text,) in self._rows("SELECT metadata FROM metadata ORDER BY rowid")]
        return texts[-1] if texts and isinstance(texts[-1], str) else ""

    def rows(self) -> Iterator[list[tuple[int, int, bytes]]]:
        """Yield topic, time and content of all messages, many at a time, in their order."""
        from idlc.recordings.containers.messages import ALWAYS

        ((version,),) = self._rows("PRAGMA data_version")
        numbers = {number for _, number in self.topics}
        query = (
            "SELECT rowid, topic_id, timestamp, data FROM messages NOT INDEXED "
            "WHERE rowid BETWEEN ? AND ? ORDER BY rowid"
        )
        for first, last in self.pieces(numbers, ALWAYS):
            row = first
            while row <= last:
                group: list[tuple[int, int, bytes]] = []
                size, start, row = 0, row, last + 1
                with closing(self._rows(query, (start, last))) as messages:
                    for number, topic, time, data in messages:
                        if topic not in numbers:
                            continue
                        if not isinstance(time, int) or not isinstance(data, bytes):
                            raise RecordingError("a message has values of other types")
                        group.append((topic, time, data))
                        size += len(data)
                        if size >= GROUP:
                            row = number + 1
                            break
                yield group
        if ((version,),) != tuple(self._rows("PRAGMA data_version")):
            raise RecordingError(f"`{self.name}` was changed while it was read", "read it again")

    def first_messages(self) -> Iterator[tuple[int, bytes]]:
        """Yield topics with the start of their first messages; few pages of large ones are read."""
        query = "SELECT topic_id, MIN(rowid) FROM messages NOT INDEXED GROUP BY topic_id"
        for topic, row in list(self._rows(query)):
            for (data,) in self._rows("SELECT data FROM messages WHERE rowid = ?", (row,)):
                if isinstance(data, bytes):
                    yield topic, data[:START]

    def pieces(self, topics: Collection[int], window: Window) -> list[Rows]:  # noqa: ARG002
        """Return all rows in one piece; empty if there are no messages."""
        # one query for both would go over all rows
        query = "SELECT {}(rowid) FROM messages NOT INDEXED"
        first, last = (next(self._rows(query.format(name)))[0] for name in ("MIN", "MAX"))
        whole = isinstance(first, int) and isinstance(last, int)
        return [Rows(first, last)] if whole else []

    def parts(self, topics: Collection[int], window: Window, size: int) -> Iterator[tuple[Rows]]:
        """Yield rows that take about `size` bytes, as if all were of the same size."""
        for first, last in self.pieces(topics, window):
            step = max(1, (last - first + 1) * size // max(self._state.st_size, 1))
            for start in range(first, last + 1, step):
                yield (Rows(start, min(start + step - 1, last)),)

    def messages(
        self, topics: Collection[int], pieces: Iterable[Any], window: Window
    ) -> Iterator[Messages]:
        """Yield the messages of some topics in some rows."""
        import numpy as np

        from idlc.recordings.containers.messages import Separate

        room = Room(self._state.st_size)
        for row, last in pieces:
            while row <= last:
                with of_file(self.name):
                    times, raws, row = self._group(Rows(row, last), topics, window, room)
                if raws:
                    yield Separate(np.array(times, np.int64), None, raws)

    def _group(
        self, rows: Rows, topics: Collection[int], window: Window, room: Room
    ) -> tuple[list[int], list[Any], int]:
        """Return times and contents of the first messages, and the row that is next.

        The file is locked only meanwhile, so that a recorder can go on writing.
        """
        marks = ", ".join("?" * len(topics))
        start = SMALLEST if window.start is None else max(window.start, SMALLEST)
        end = LARGEST if window.end is None else min(window.end - 1, LARGEST)
        query = (
            "SELECT rowid, timestamp, data FROM messages NOT INDEXED WHERE rowid BETWEEN ? AND ? "  # noqa: S608
            f"AND topic_id IN ({marks}) AND (timestamp BETWEEN ? AND ? "
            "OR typeof(timestamp) <> 'integer') ORDER BY rowid"
        )
        times: list[int] = []
        raws: list[bytes] = []
        size = 0
        if start <= end:
            with closing(self._rows(query, (*rows, *topics, start, end))) as messages:
                for row, time, data in messages:
                    if not isinstance(time, int) or not isinstance(data, bytes):
                        raise RecordingError("a message has values of other types")
                    times.append(time)
                    raws.append(data if data[:4] != ZSTD_MAGIC else zstd_frame(data, room))
                    size += len(raws[-1])
                    if size >= GROUP:
                        return times, raws, row + 1
        return times, raws, rows.last + 1
