"""The content of a .db3 file of rosbag2, which is an SQLite database.

Such a file can come from anybody. It is opened for reading only, nothing that it defines besides
tables is accepted, and values are taken only of the types that a recorder writes.
"""

from __future__ import annotations

import shlex
import sqlite3
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from idlc.recordings.containers.source import START, RecordingError, first_bytes

MAGIC = b"SQLite format 3\0"
#: Hidden columns of these kinds are computed by the file.
COMPUTED = {2, 3}
#: Byte 18 of the header of a database that is written by way of a log, `-wal`.
WRITES_A_LOG = 2
#: Seconds to wait for a writer that has locked the file.
PATIENCE = 5.0


class Db3Topic(NamedTuple):
    """A row of `topics`, with the definition that goes with it."""

    id: int
    name: str
    type: str
    encoding: str
    hash: str
    schema_encoding: str
    text: str
    messages: int


class Rows(NamedTuple):
    """Messages from one row to another, which belongs to them."""

    first: int
    last: int


class Db3:
    """An open .db3 file."""

    def __init__(self, path: Path) -> None:
        self.name = str(path)
        self._path = path.resolve()
        self._log = self._path.with_name(self._path.name + "-wal")
        self.size = path.stat().st_size
        # SQLite makes files beside a database that has a log, even to read it
        log = first_bytes(path, 19)[18:] == bytes([WRITES_A_LOG])
        self._lone = log and not self._is_in_use()
        self._state = self._path.stat()
        with self.errors():
            location = f"file:{quote(str(self._path))}?mode=ro{'&immutable=1' * self._lone}"
            self._db = sqlite3.connect(location, PATIENCE, uri=True, check_same_thread=False)
            # truncating a mapped file would kill the process
            for pragma in (
                *("trusted_schema=OFF", "query_only=ON", "cell_size_check=ON", "mmap_size=0"),
            ):
                self._db.execute(f"PRAGMA {pragma}")
        try:
            self.columns = self._tables()
            self._check_size()
        except RecordingError:
            self._db.close()
            raise

    @property
    def notes(self) -> list[str]:
        """Notes about anomalies of the file."""
        if not self._lone:
            return []
        name, log = self._path.name, self._log.name
        why = f"it was written by way of `{log}`, which is not there"
        return [f"{name}: {why}: if that was left behind, the last messages are missing"]

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def _is_in_use(self) -> bool:
        """Return whether a journal or log has something that the file has not, or may have."""
        journal = self._path.with_name(self._path.name + "-journal")
        return _begins(self._log) or _begins(journal)

    @contextmanager
    def errors(self) -> Iterator[None]:
        """Turn errors of SQLite into errors about the recording."""
        try:
            yield
        except (sqlite3.Error, OSError, OverflowError, UnicodeError) as error:
            raise self._error(str(error)) from None

    def _error(self, what: str) -> RecordingError:
        """Return an error with a hint for a problem that SQLite reports."""
        repair = f"sqlite3 {shlex.quote(self.name)} .schema"
        if "readonly" in what:  # it would have to write to roll back
            why = "is not whole: its writer stopped in the middle of a transaction"
            return RecordingError(f"`{self.name}` {why}", f"SQLite undoes it: {repair}")
        if "locked" in what:
            why = "is locked by the program that writes it"
            return RecordingError(f"`{self.name}` {why}", "try again when that has ended")
        if "unable to open" in what and self._is_in_use():
            why = f"cannot be read with its `{self._log.name}`, which needs a file beside it"
            return RecordingError(f"`{self.name}` {why}", "copy both to a folder of your own")
        return RecordingError(f"`{self.name}` cannot be read: {what}")

    def rows(
        self, query: str, values: tuple[Any, ...] = ()
    ) -> Generator[tuple[Any, ...], None, None]:
        """Yield the rows of a query; the file is locked until it is exhausted or closed."""
        with self.errors(), closing(self._db.execute(query, values)) as cursor:
            yield from cursor
            if self._lone:
                self._check_unchanged()

    def _check_unchanged(self) -> None:
        """Raise RecordingError if a file that was read without a lock has changed."""
        now, then = self._path.stat(), self._state
        if self._is_in_use() or (now.st_mtime_ns, now.st_size) != (then.st_mtime_ns, then.st_size):
            raise RecordingError(f"`{self.name}` was changed while it was read", "read it again")

    def _check_size(self) -> None:
        """Raise RecordingError if the last page is cut off, which SQLite fills with zeros."""
        ((page,),) = self.rows("PRAGMA page_size")
        if rest := self._path.stat().st_size % page:
            raise RecordingError(f"`{self.name}` is cut off after {rest:,} bytes of a page")

    def _tables(self) -> dict[str, set[str]]:
        """Return each table's columns; raise RecordingError if there are others than plain ones."""
        tables: dict[str, set[str]] = {}
        for kind, name, text in self.rows("SELECT type, name, sql FROM sqlite_master"):
            if kind == "index":
                continue
            if kind != "table" or str(text).split()[1:2] != ["TABLE"]:
                kind = kind if kind != "table" else "virtual table"
                raise RecordingError(
                    f"`{self.name}` holds a {kind}, `{name}`, as no recording does"
                )
            quoted = '"' + str(name).replace('"', '""') + '"'
            columns = list(self.rows(f"PRAGMA table_xinfo({quoted})"))
            if any(column[6] in COMPUTED for column in columns):
                raise RecordingError(f"`{self.name}`: columns of `{name}` are computed")
            if "rowid" in {str(column[1]).lower() for column in columns}:
                # it hides the numbers of rows, which no two have in common
                raise RecordingError(f"`{self.name}`: a column of `{name}` is called rowid")
            tables[str(name)] = {str(column[1]) for column in columns}
        for table, needed in (
            ("topics", {"id", "name", "type"}),
            ("messages", {"topic_id", "data"}),
        ):
            if not needed <= tables.get(table, set()):
                raise RecordingError(f"`{self.name}` is no recording: it has no table of {table}")
        return tables

    def topics(self) -> list[Db3Topic]:
        """Return the topics, with their definitions where the file has any."""
        columns = self.columns["topics"]
        encoding = "serialization_format" if "serialization_format" in columns else "'cdr'"
        digest = "type_description_hash" if "type_description_hash" in columns else "''"
        query = f"SELECT id, name, type, {encoding}, {digest} FROM topics ORDER BY id"  # noqa: S608 # ours
        definitions, counts = self._definitions(), self._counts()
        topics = []
        for number, *texts in self.rows(query):
            if not isinstance(number, int) or not all(isinstance(text, str) for text in texts):
                raise RecordingError(f"`{self.name}`: a topic has values of other types")
            name, kind, encoding, digest = texts
            # the definition of a service is that of its events, too
            recorded = definitions.get(kind) or definitions.get(kind.removesuffix("_Event"))
            schema_encoding, text, other = recorded or ("", "", "")
            definition = (digest or other, schema_encoding, text, counts.get(number, 0))
            topics.append(Db3Topic(number, name, kind, encoding, *definition))
        return topics

    def first_messages(self) -> Iterator[tuple[Any, bytes]]:
        """Yield topics with the start of their first messages; few pages of large ones are read."""
        query = "SELECT topic_id, MIN(rowid) FROM messages NOT INDEXED GROUP BY topic_id"
        for topic, row in list(self.rows(query)):
            for (data,) in self.rows("SELECT data FROM messages WHERE rowid = ?", (row,)):
                if isinstance(data, bytes):
                    yield topic, data[:START]

    def rows_of_messages(self) -> list[Rows]:
        """Return all rows in one piece; empty if there are no messages."""
        # one query for both would go over all rows
        query = "SELECT {}(rowid) FROM messages NOT INDEXED"
        first, last = (next(self.rows(query.format(aggregate)))[0] for aggregate in ("MIN", "MAX"))
        whole = isinstance(first, int) and isinstance(last, int)
        return [Rows(first, last)] if whole else []

    def start(self) -> int | None:
        """Return the time of the first message."""
        ((time,),) = self.rows("SELECT MIN(timestamp) FROM messages NOT INDEXED")
        return time if isinstance(time, int) else None

    def _definitions(self) -> dict[str, tuple[str, str, str]]:
        """Return encoding, text and hash of each type."""
        columns = self.columns.get("message_definitions", set())
        if not {"topic_type", "encoding", "encoded_message_definition"} <= columns:
            return {}
        digest = "type_description_hash" if "type_description_hash" in columns else "''"
        # the text may be in any encoding, as comments are
        names = f"topic_type, encoding, CAST(encoded_message_definition AS BLOB), {digest}"
        definitions: dict[str, tuple[str, str, str]] = {}
        for kind, *texts in self.rows(f"SELECT {names} FROM message_definitions ORDER BY rowid"):  # noqa: S608 # ours
            encoding, text, other = (
                str(value, "utf-8", "replace") if isinstance(value, bytes) else str(value or "")
                for value in texts
            )
            if not definitions.get(kind, ("", "", ""))[1]:
                definitions[kind] = ("" if encoding == "unknown" else encoding, text, other)
        return definitions

    def _counts(self) -> dict[int, int]:
        return dict(
            self.rows("SELECT topic_id, COUNT(*) FROM messages NOT INDEXED GROUP BY topic_id")
        )


def _begins(path: Path) -> bool:
    """Return whether there is a journal or log that is not empty, or marked as done with zeros."""
    return path.is_file() and first_bytes(path, 1) not in (b"", b"\0")
