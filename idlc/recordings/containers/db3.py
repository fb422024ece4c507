"""The .db3 files of rosbag2, which are SQLite databases.

Such a file can come from anybody. It is opened for reading only, nothing that it defines besides
tables is accepted, and values are taken only of the types that a recorder writes.
"""

from __future__ import annotations

import shlex
import sqlite3
from collections import deque
from collections.abc import Callable, Collection, Generator, Iterable, Iterator
from contextlib import closing, contextmanager
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar
from urllib.parse import quote

import msgspec

from idlc.recordings.containers.compression import ZSTD_MAGIC, DecompressionBudget, zstd_frame
from idlc.recordings.containers.file import START, Schema, Topic, full_name, recorded_schema
from idlc.recordings.containers.source import (
    DamageError,
    FileSource,
    RecordingError,
    first_bytes,
    of_file,
)
from idlc.recordings.damage import DamageList
from idlc.recordings.sqlite_pages import LARGEST, SMALLEST, Cell, Pages, RowSpan

if TYPE_CHECKING:
    from idlc.recordings.containers.messages import TopicMessages, Window

MAGIC = b"SQLite format 3\0"
#: Hidden columns of these kinds are computed by the file.
COMPUTED = {2, 3}
#: Byte 18 of the header of a database that is written by way of a log, `-wal`.
WRITES_A_LOG = 2
#: Seconds to wait for a writer that has locked the file.
PATIENCE = 5.0
#: Messages are yielded together until they have so many bytes.
GROUP = 1 << 25
#: Those that are converted, until they have so many.
BATCH = 1 << 22
GroupT = TypeVar("GroupT")


class Rows(NamedTuple):
    """Messages from one row to another, which belongs to them."""

    first: int
    last: int


class Counted(msgspec.Struct):
    """The messages of a topic: how many, their first and last time, and the start of the first."""

    count: int = 0
    first: int | None = None
    last: int | None = None
    start: bytes = b""


class Survey(NamedTuple):
    """The rows of a damaged file that can be read, and their messages by topic."""

    rows: list[Rows]
    topics: dict[int, Counted]


class Db3File:
    """An open .db3 file; without `read`, nothing is read of its topics.

    A `strict` file raises RecordingError for damage.
    """

    def __init__(self, path: Path, read: bool = True, strict: bool = False) -> None:
        self.name = self.place = str(path)
        self.damage = DamageList(self.name, strict)
        self.damage.is_unproven = True
        self._path = path.resolve()
        self._log = self._path.with_name(self._path.name + "-wal")
        # SQLite makes files beside a database that has a log, even to read it
        log = first_bytes(path, 19)[18:] == bytes([WRITES_A_LOG])
        self.is_lone = log and not self._is_in_use()
        self.log = self._log.name
        self._state = self._path.stat()
        self.size = self._state.st_size
        self.notes: list[str] = []
        self._survey: Survey | None = None
        self._db, self.columns = self._opened()
        try:
            ((page,),) = self._rows("PRAGMA page_size")
            size = self._path.stat().st_size
            if rest := size % page:  # which SQLite fills with zeros
                self.damage.add(f"it is cut off after {rest:,} bytes of a page", size - rest, size)
                self._survey = self._surveyed()
            self._counted = self._statistics() if read else {}
            self.topics = list(self._topics(self.columns)) if read else []
        except RecordingError:
            self._db.close()
            raise

    def _opened(self) -> tuple[sqlite3.Connection, dict[str, set[str]]]:
        """Return the database and the columns of its tables.

        SQLite accepts a database that has lost its end only if its schema may be damaged.
        """
        pragmas = "trusted_schema=OFF query_only=ON cell_size_check=ON mmap_size=0".split()
        try:
            return self._connected(pragmas)
        except DamageError as error:
            if self.damage.is_strict:
                raise
            try:
                opened = self._connected([*pragmas, "writable_schema=ON"])
            except DamageError:
                hint = f"sqlite3 {shlex.quote(self.name)} .recover"
                raise DamageError(error.message, f"`{hint}` may find more") from None
            return opened

    def _connected(self, pragmas: Iterable[str]) -> tuple[sqlite3.Connection, dict[str, set[str]]]:
        with self._errors():
            location = f"file:{quote(str(self._path))}?mode=ro{'&immutable=1' * self.is_lone}"
            self._db = sqlite3.connect(location, PATIENCE, uri=True, check_same_thread=False)
            # truncating a mapped file would kill the process
            for pragma in pragmas:
                self._db.execute(f"PRAGMA {pragma}")
        try:
            return self._db, self._tables()
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
            what, hint, kind = str(error), None, RecordingError
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
                why, kind = f"cannot be read: {what}", DamageError
            raise kind(f"`{self.name}` {why}", hint) from None

    def _rows(
        self, query: str, values: tuple[Any, ...] = ()
    ) -> Generator[tuple[Any, ...], None, None]:
        """Yield the rows of a query; the file is locked until it is exhausted or closed."""
        with self._errors(), closing(self._db.execute(query, values)) as cursor:
            yield from cursor
            if self.is_lone:
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
        messages = {"topic_id", "timestamp", "data"}
        required = {"topics": {"id", "name", "type"}, "messages": messages}
        for table, needed in required.items():
            if not needed <= tables.get(table, set()):
                raise DamageError(f"`{self.name}` is not a recording: it has no table of {table}")
        return tables

    def _topics(self, columns: dict[str, set[str]]) -> Iterator[tuple[Topic, int]]:
        """Yield the topics, with their definitions where the file has any."""
        own = columns["topics"]
        encoding = "serialization_format" if "serialization_format" in own else "'cdr'"
        digest = "type_description_hash" if "type_description_hash" in own else "''"
        qos = "offered_qos_profiles" if "offered_qos_profiles" in own else "''"
        query = f"SELECT id, name, type, {encoding}, {digest}, {qos} FROM topics ORDER BY id"  # noqa: S608 # ours
        definitions = self._definitions(columns.get("message_definitions", set()))
        for number, *texts in self._rows(query):
            if not isinstance(number, int) or not all(isinstance(text, str) for text in texts):
                raise RecordingError(f"`{self.name}`: a topic has values of other types")
            name, kind, encoding, digest, profiles = texts
            # the definition of a service is that of its events, too
            recorded = definitions.get(kind) or definitions.get(kind.removesuffix("_Event"))
            schema_encoding, text, other = recorded or ("", "", "")
            kind, count = full_name(kind), self._counted.get(number, Counted()).count
            schema = recorded_schema(Schema(kind, schema_encoding, text))
            hash_ = digest or other or None
            yield Topic(name, kind, count, hash_, encoding, schema, profiles), number

    def _definitions(self, columns: set[str]) -> dict[str, tuple[str, str, str]]:
        """Return encoding, text and hash of each type."""
        if not {"topic_type", "encoding", "encoded_message_definition"} <= columns:
            return {}
        digest = "type_description_hash" if "type_description_hash" in columns else "''"
        # the text may be in any encoding, as comments are
        names = f"topic_type, encoding, CAST(encoded_message_definition AS BLOB), {digest}"
        definitions: dict[str, tuple[str, str, str]] = {}
        rows = self._rows(f"SELECT {names} FROM message_definitions ORDER BY rowid")  # noqa: S608 # ours
        for kind, *texts in self._until_damage(rows, "the definitions cannot be read"):
            encoding, text, other = (
                str(value, "utf-8", "replace") if isinstance(value, bytes) else str(value or "")
                for value in texts
            )
            if not definitions.get(kind, ("", "", ""))[1]:
                definitions[kind] = ("" if encoding == "unknown" else encoding, text, other)
        return definitions

    def _until_damage(
        self, rows: Iterable[tuple[Any, ...]], problem: str
    ) -> Iterator[tuple[Any, ...]]:
        try:
            yield from rows
        except DamageError:
            self.damage.add(problem)

    @property
    def start(self) -> int | None:
        """The time of the first message."""
        return self._span[0]

    @property
    def end(self) -> int | None:
        """The time of the last message."""
        return self._span[1]

    @cached_property
    def _span(self) -> tuple[int | None, int | None]:
        """The times of the first and the last message."""
        if self._survey is None:
            query = "SELECT MIN(timestamp), MAX(timestamp) FROM messages NOT INDEXED"
            ((first, last),) = self._rows(query)
            is_known = isinstance(first, int) and isinstance(last, int)
            return (first, last) if is_known else (None, None)
        topics = self._survey.topics.values()
        firsts = [own.first for own in topics if own.first is not None]
        lasts = [own.last for own in topics if own.last is not None]
        return min(firsts, default=None), max(lasts, default=None)

    def _statistics(self) -> dict[int, Counted]:
        """Return the messages of each topic."""
        if self._survey is None:
            query = (
                "SELECT topic_id, COUNT(*), MAX(rowid) FROM messages NOT INDEXED GROUP BY topic_id"
            )
            try:
                every = list(self._rows(query))
                ((last,),) = self._rows("SELECT MAX(rowid) FROM messages NOT INDEXED")
                if any(number > last for *_, number in every):
                    raise DamageError("its rows are not in order")
                return {topic: Counted(count) for topic, count, _ in every}
            except DamageError as error:
                self._salvage(error)
        assert self._survey is not None
        return self._survey.topics

    def sizes(self) -> dict[int, int] | None:
        """Return the bytes of the messages of each topic; None if the file is damaged."""
        if self._survey is not None:
            return None
        query = "SELECT topic_id, SUM(LENGTH(data)) FROM messages NOT INDEXED GROUP BY topic_id"
        return {topic: size for topic, size in self._rows(query) if isinstance(size, int)}

    def metadata(self) -> str:
        """Return the bag's metadata that rosbag2 keeps in the file, empty if there is none."""
        if "metadata" not in self.columns.get("metadata", set()):
            return ""
        rows = self._rows("SELECT metadata FROM metadata ORDER BY rowid")
        texts = [text for (text,) in self._until_damage(rows, "the metadata cannot be read")]
        return texts[-1] if texts and isinstance(texts[-1], str) else ""

    def rows(self) -> Iterator[list[tuple[int, int, bytes]]]:
        """Yield topic, time and content of all messages, many at a time, in their order."""
        from idlc.recordings.containers.messages import ALWAYS

        ((version,),) = self._rows("PRAGMA data_version")
        numbers, room = (
            {number for _, number in self.topics},
            DecompressionBudget(self._state.st_size),
        )
        pieces = self.pieces(numbers, ALWAYS)
        yield from self._read_around_damage(pieces, lambda part: self._rows_of(part, numbers, room))
        if ((version,),) != tuple(self._rows("PRAGMA data_version")):
            raise RecordingError(f"`{self.name}` was changed while it was read", "read it again")

    def _rows_of(
        self, part: Rows, topics: Collection[int], room: DecompressionBudget
    ) -> tuple[list[tuple[int, int, bytes]], int]:
        """Return the first messages of rows, and the row that is next."""
        group: list[tuple[int, int, bytes]] = []
        size = 0
        with closing(self.survey_rows(*part)) as messages:
            for row, topic, time, data in messages:
                raw = self._raw(row, time, data, room) if topic in topics else None
                if raw is None:
                    continue
                group.append((topic, time, raw))
                size += len(raw)
                if size >= BATCH:
                    return group, row + 1
        return group, part.last + 1

    def first_messages(self) -> Iterator[tuple[int, bytes]]:
        """Yield topics with the start of their first messages; few pages of large ones are read."""
        if self._survey is not None:
            yield from ((topic, own.start) for topic, own in self._survey.topics.items())
            return
        query = "SELECT topic_id, MIN(rowid) FROM messages NOT INDEXED GROUP BY topic_id"
        for topic, row in list(self._rows(query)):
            for (data,) in self._rows("SELECT data FROM messages WHERE rowid = ?", (row,)):
                if isinstance(data, bytes):
                    yield topic, data[:START]

    def pieces(self, topics: Collection[int], window: Window) -> list[Rows]:  # noqa: ARG002
        """Return all rows in one piece, or in pieces between damage; empty without messages."""
        if self._survey is None:
            # one query for both would go over all rows
            query = "SELECT {}(rowid) FROM messages NOT INDEXED"
            try:
                first, last = (next(self._rows(query.format(name)))[0] for name in ("MIN", "MAX"))
            except DamageError as error:
                self._salvage(error)
            else:
                whole = isinstance(first, int) and isinstance(last, int)
                return [Rows(first, last)] if whole else []
        assert self._survey is not None
        return self._survey.rows

    def _salvage(self, error: DamageError) -> None:
        """Find the rows that can be read; raise the error if the file is strict."""
        if self.damage.is_strict:
            raise error
        self._survey = self._surveyed()

    def _surveyed(self) -> Survey:
        """Return the rows that can be read, and add the others to the damage."""
        ((page,),) = self._rows("PRAGMA page_size")
        query = "SELECT rootpage FROM sqlite_master WHERE type = 'table' AND name = 'messages'"
        ((root,),) = self._rows(query)
        pages = Pages(FileSource(self._path), page, first_bytes(self._path, 21)[20])
        surveyor = _Surveyor(self, pages)
        with pages.source.opened():
            for leaf in pages.leaves(root):
                surveyor.leaf(leaf)
        surveyor.end_of_gap(None, None)
        # a step after the last row may be into damage
        rows = [
            part
            for first, last in surveyor.runs
            for part in (Rows(first, last - 1), Rows(last, last))
            if part.first <= part.last
        ]
        return Survey(rows, surveyor.topics)

    def parts(self, topics: Collection[int], window: Window, size: int) -> Iterator[tuple[Rows]]:
        """Yield rows that take about `size` bytes, as if all were of the same size."""
        for first, last in self.pieces(topics, window):
            step = max(1, (last - first + 1) * size // max(self._state.st_size, 1))
            for start in range(first, last + 1, step):
                yield (Rows(start, min(start + step - 1, last)),)

    def messages(
        self, topics: Collection[int], pieces: Iterable[Any], window: Window
    ) -> Iterator[TopicMessages]:
        """Yield the messages of some topics in some rows."""
        import numpy as np

        from idlc.recordings.containers.messages import Separate

        room = DecompressionBudget(self._state.st_size)
        groups = self._read_around_damage(
            pieces, lambda part: self._group(part, topics, window, room)
        )
        for times, raws in groups:
            if raws:
                yield Separate(np.array(times, np.int64), None, raws)

    def _read_around_damage(
        self, pieces: Iterable[Any], read: Callable[[Rows], tuple[GroupT, int]]
    ) -> Iterator[GroupT]:
        """Yield what is read of rows; `read` returns a group and the row that is next."""
        for first, last in pieces:
            parts = deque([Rows(first, last)])
            while parts:
                part = parts.popleft()
                try:
                    with of_file(self.name):
                        group, following = read(part)
                except DamageError as error:
                    parts.extendleft(reversed(self._around(part, error)))
                    continue
                if following <= part.last:
                    parts.appendleft(Rows(following, part.last))
                yield group

    def survey_rows(self, first: int, last: int) -> Generator[tuple[Any, ...], None, None]:
        """Return number, topic, time and data of rows."""
        numbers, condition = _condition(Rows(first, last))
        query = (
            f"SELECT rowid, topic_id, timestamp, data FROM messages NOT INDEXED WHERE {condition}"  # noqa: S608
        )
        return self._rows(f"{query} ORDER BY rowid", numbers)

    def _around(self, part: Rows, error: DamageError) -> list[Rows]:
        """Return the rows of a part with damage that may be read; the halves if none is known."""
        if self._survey is None:
            self._salvage(error)
            return list(self._sound(part))
        if part.first == part.last:
            self.damage.add(f"row {part.first:,} cannot be read")
            return []
        middle = (part.first + part.last) // 2
        return [Rows(part.first, middle), Rows(middle + 1, part.last)]

    def _sound(self, part: Rows) -> Iterator[Rows]:
        """Yield the rows of a part that can be read."""
        for rows in self._survey.rows if self._survey else ():
            if rows.first <= part.last and rows.last >= part.first:
                yield Rows(max(rows.first, part.first), min(rows.last, part.last))

    def _group(
        self, rows: Rows, topics: Collection[int], window: Window, room: DecompressionBudget
    ) -> tuple[tuple[list[int], list[Any]], int]:
        """Return times and contents of the first messages, and the row that is next.

        The file is locked only meanwhile, so that a recorder can go on writing.
        """
        marks = ", ".join("?" * len(topics))
        start = SMALLEST if window.start is None else max(window.start, SMALLEST)
        end = LARGEST if window.end is None else min(window.end - 1, LARGEST)
        numbers, condition = _condition(rows)
        query = (
            f"SELECT rowid, timestamp, data FROM messages NOT INDEXED WHERE {condition} "  # noqa: S608
            f"AND topic_id IN ({marks}) AND (timestamp BETWEEN ? AND ? "
            "OR typeof(timestamp) <> 'integer') ORDER BY rowid"
        )
        times: list[int] = []
        raws: list[bytes] = []
        size = 0
        if start <= end:
            with closing(self._rows(query, (*numbers, *topics, start, end))) as messages:
                for row, time, data in messages:
                    raw = data
                    # a call for each row would be a twentieth of the time
                    if type(time) is not int or type(data) is not bytes or data[:4] == ZSTD_MAGIC:
                        raw = self._raw(row, time, data, room)
                        if raw is None:
                            continue
                    times.append(time)
                    raws.append(raw)
                    size += len(raw)
                    if size >= GROUP:
                        return (times, raws), row + 1
        return (times, raws), rows.last + 1

    def _raw(self, row: int, time: Any, data: Any, room: DecompressionBudget) -> bytes | None:
        """Return the message in a row, or None if the row is damaged."""
        times = (time, time) if isinstance(time, int) else (None, None)
        if not isinstance(time, int) or not isinstance(data, bytes):
            self.damage.add(f"row {row:,} has values of other types", messages=1, times=times)
            return None
        if data[:4] != ZSTD_MAGIC:
            return data
        try:
            return zstd_frame(data, room)
        except DamageError as error:
            self.damage.add(f"row {row:,}: {error.message}", messages=1, times=times)
            return None


def _condition(rows: Rows) -> tuple[tuple[int, ...], str]:
    """Return values and a condition of SQL; that of one row makes SQLite read no other."""
    if rows.first == rows.last:
        return (rows.first,), "rowid = ?"
    return (rows.first, rows.last), "rowid BETWEEN ? AND ?"


class _Surveyor:
    """Reads every row of a damaged file, page by page.

    `runs` are the rows without damage between them; `time` is that of the last row.
    """

    def __init__(self, file: Db3File, pages: Pages) -> None:
        self.file = file
        self.pages = pages
        self.is_cut = pages.source.size % pages.size > 0
        self.runs: list[Rows] = []
        self.topics: dict[int, Counted] = {}
        self.time: int | None = None
        self.gap: list[RowSpan] = []
        #: So many numbers are tried where no page says which rows there are.
        self.trials = 10_000 + pages.source.size // 64

    def leaf(self, leaf: RowSpan) -> None:
        """Read the rows of a page."""
        cells = list(self.pages.rows(leaf.page))
        broken = {cell for cell in cells if self.is_cut and not self.pages.is_whole(cell)}
        is_missing = self.is_cut and len(self.pages.page(leaf.page)) < self.pages.size
        done = leaf.first - 1
        numbers = [done, *(cell.row for cell in cells), leaf.last + 1]
        is_ordered = all(row < following for row, following in pairwise(numbers))
        if is_ordered and not (broken or is_missing):
            done, is_whole = self.all_rows(leaf)
            if is_whole:
                return
        # where all rows were read, it is the next page that is damaged
        if not cells:
            self.gap.append(leaf)
        for cell in cells:
            if cell in broken or not leaf.first <= cell.row <= leaf.last:
                self.gap.append(leaf)
            elif cell.row > done:
                self.single(cell, leaf)
        if is_missing:
            self.gap.append(leaf)

    def all_rows(self, leaf: RowSpan) -> tuple[int, bool]:
        """Read the rows of a page; return the last that was read, and whether all were."""
        done = leaf.first - 1
        try:
            for row in self.file.survey_rows(leaf.first, leaf.last):
                if not done < row[0] <= leaf.last:
                    raise DamageError("its rows are not in order")
                done = self.add(*row)
        except DamageError:
            return done, False
        # only a table without rows has a page without rows
        return done, done >= leaf.first or (leaf.first, leaf.last) == (SMALLEST, LARGEST)

    def single(self, cell: Cell, leaf: RowSpan) -> None:
        """Read one row."""
        rows = self.row(cell.row)
        for row in rows:
            self.add(*row)
        if not rows:
            self.gap.append(leaf)

    def row(self, number: int) -> list[tuple[Any, ...]]:
        """Return the row of a number, if there is one that can be read."""
        try:
            return list(self.file.survey_rows(number, number))
        except DamageError:
            return []

    def add(self, row: int, topic: Any, time: Any, data: Any) -> int:
        """Add a row that was read; return its number."""
        is_new = bool(self.gap)
        self.end_of_gap(row, time)
        self.extend((row, topic, time, data), is_new)
        return row

    def extend(self, values: tuple[Any, ...], is_new: bool) -> None:
        """Count a row, and make it a part of the run before unless a new one begins."""
        row, topic, time, data = values
        if self.runs and not is_new and row > self.runs[-1].last:
            self.runs[-1] = self.runs[-1]._replace(last=row)
        else:
            self.runs.append(Rows(row, row))
        if isinstance(time, int):
            self.time = time
            counted = self.topics.setdefault(topic, Counted(start=bytes(data or b"")[:START]))
            counted.count += 1
            counted.first = time if counted.first is None else min(time, counted.first)
            counted.last = time if counted.last is None else max(time, counted.last)

    def end_of_gap(self, row: int | None, time: int | None) -> None:
        """Add the pages that could not be read to the damage; `row` is the next that can be."""
        if not self.gap:
            return
        first = self.runs[-1].last + 1 if self.runs else 1
        before, size = self.time, self.pages.size
        # where a page is damaged that leads to others, SQLite may find their rows
        found, previous = 0, 0
        for number in range(first, first if row is None else row):
            if not self.trials:
                break
            self.trials -= 1
            for each in self.row(number):
                self.extend(each, number != previous + 1)
                found, previous = found + 1, number
        what = f"rows from {first:,} on" if row is None else f"rows {first:,} to {row - 1:,}"
        rest = f", except {found:,} of them" if found else ""
        pages = [leaf.page for leaf in self.gap if leaf.page <= self.pages.count]
        start = (min(pages) - 1) * size if pages else None
        stop = min(max(pages) * size, self.pages.source.size) if pages else None
        self.gap = []
        if row is None or found < row - first:
            problem = f"{what} cannot be read{rest}"
            self.file.damage.add(problem, start, stop, times=(before, time))
