"""A .db3 file with topics of other types: a copy, of which only their rows change."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from idlc.recordings.containers.compression import Room
from idlc.recordings.containers.conversion import (
    Conversion,
    Recorded,
    RewrittenTopic,
    check,
    converted,
)
from idlc.recordings.containers.db3 import GROUP, Db3File
from idlc.recordings.containers.file import Schema, full_name
from idlc.recordings.containers.source import RecordingError, of_file
from idlc.recordings.sqlite_pages import LARGEST, SMALLEST

#: The draft is not kept if anything fails, so nothing of it is logged or synchronized meanwhile,
#: and nothing is computed by what a file defines.
PRAGMAS = (
    *("trusted_schema=OFF", "cell_size_check=ON", "mmap_size=0", "ignore_check_constraints=ON"),
    *("journal_mode=DELETE", "journal_mode=OFF", "synchronous=OFF"),
)
#: Finds indexes that are computed.
COMPUTED = """
SELECT name FROM (
    SELECT list.name AS name, list.partial OR info.cid = -2 AS computed
    FROM sqlite_master, pragma_index_list(sqlite_master.name) AS list
    LEFT JOIN pragma_index_xinfo(list.name) AS info WHERE sqlite_master.type = 'table'
) WHERE computed
"""
DEFINITIONS = "message_definitions"


def rewrite_db3(
    path: Path,
    draft: Path,
    conversions: Mapping[str, Conversion],
    recorded: dict[str, Recorded],
    progress: Callable[[int, int], object],
) -> dict[str, RewrittenTopic]:
    """Write a .db3 file with conversions of topics to a path that is free.

    `recorded` has what other files of the recording have of a topic, and is added to.
    """
    with closing(Db3File(path, strict=True)) as file, of_file(file.name):
        for own, _ in file.topics:
            if own.name in conversions:
                definition = own.type, own.schema
                check(own.name, own.encoding, definition, conversions[own.name], recorded)
        has_definitions = {"topic_type", "encoding", "encoded_message_definition"} <= (
            file.columns.get(DEFINITIONS, set())
        )
        if has_definitions:
            _check_definitions(file, conversions)
        with closing(sqlite3.connect(draft, isolation_level=None)) as database:
            file.copy_to(database, str(draft.name), progress)
            with _errors(draft.name):
                for pragma in PRAGMAS:
                    database.execute(f"PRAGMA {pragma}").fetchall()
                for (name,) in database.execute(COMPUTED):
                    raise RecordingError(f"the index `{name}` is computed")
                database.execute("BEGIN")
                if has_definitions:
                    _define(database, file, conversions)
                _convert(database, file, conversions)
                _retype(database, file, conversions)
                database.execute("COMMIT")
                return _counts(database, file, conversions)


@contextmanager
def _errors(name: str) -> Iterator[None]:
    try:
        yield
    except sqlite3.Error as error:
        if "full" in str(error) or "I/O" in str(error):
            raise RecordingError(f"`{name}` cannot be written: {error}") from None
        raise RecordingError(f"it cannot be read: {error}") from None


def _check_definitions(file: Db3File, conversions: Mapping[str, Conversion]) -> None:
    """Raise RecordingError if a type would have two definitions, of which a file has one."""
    new: dict[str, Schema] = {}
    for own, _ in file.topics:
        if conversion := conversions.get(own.name):
            kind = full_name(conversion.type)
            schema = Schema(kind, conversion.encoding, conversion.definition)
            if new.setdefault(kind, schema) != schema:
                raise RecordingError(f"a .db3 file has one definition of `{kind}`, not two")
    for own, _ in file.topics:
        if own.name not in conversions and own.schema != new.get(own.type, own.schema):
            what = f"a .db3 file has one definition of `{own.type}`"
            raise RecordingError(f"{what}, but `{own.name}` keeps the old one", "convert it, too")


def _define(
    database: sqlite3.Connection, file: Db3File, conversions: Mapping[str, Conversion]
) -> None:
    """Write the new definitions, and remove those that no topic has anymore."""
    query = f"SELECT DISTINCT topic_type FROM {DEFINITIONS}"  # noqa: S608 # ours
    keys = {key for (key,) in database.execute(query)}

    def key_of(kind: str) -> str:
        # the definition of a service is that of its events, too
        short = kind.removesuffix("_Event")
        return short if kind not in keys and short in keys else kind

    old: set[str] = set()
    kept: set[str] = set()
    new: dict[str, Conversion] = {}
    for name, kind in database.execute("SELECT name, type FROM topics ORDER BY id"):
        conversion = conversions.get(name)
        (old if conversion else kept).add(key_of(kind))
        if conversion:
            is_short = key_of(kind) != kind
            own = conversion.type.removesuffix("_Event") if is_short else conversion.type
            new[own] = conversion
    for key in (*old - kept, *new.keys() - kept):
        database.execute(f"DELETE FROM {DEFINITIONS} WHERE topic_type = ?", (key,))  # noqa: S608 # ours
    # all columns are given: what a file has as a default is not computed
    columns = sorted(file.columns[DEFINITIONS])
    names = ", ".join('"' + column.replace('"', '""') + '"' for column in columns)
    marks = ", ".join("?" * len(columns))
    for key, conversion in new.items():
        if key in kept:
            continue
        values = {
            "topic_type": key,
            "encoding": conversion.encoding,
            "encoded_message_definition": conversion.definition,
            "type_description_hash": conversion.type_hash,
        }
        row = tuple(values.get(column) for column in columns)
        database.execute(f"INSERT INTO {DEFINITIONS} ({names}) VALUES ({marks})", row)  # noqa: S608 # ours


def _retype(
    database: sqlite3.Connection, file: Db3File, conversions: Mapping[str, Conversion]
) -> None:
    has_hash = "type_description_hash" in file.columns["topics"]
    digest = ", type_description_hash = ?" if has_hash else ""
    for name, conversion in conversions.items():
        values = (conversion.type, *[conversion.type_hash] * has_hash, name)
        query = f"UPDATE OR ABORT topics SET type = ?{digest} WHERE name = ?"  # noqa: S608 # ours
        database.execute(query, values)


def _convert(
    database: sqlite3.Connection, file: Db3File, conversions: Mapping[str, Conversion]
) -> None:
    """Give messages their new payloads, some of them at a time."""
    mine = {
        number: own.name
        for own, number in file.topics
        if own.name in conversions and conversions[own.name].convert
    }
    marks = ", ".join("?" * len(mine))
    query = (
        "SELECT rowid, topic_id, timestamp, data FROM messages NOT INDEXED "  # noqa: S608 # ours
        f"WHERE rowid BETWEEN ? AND {LARGEST} AND topic_id IN ({marks}) ORDER BY rowid"
    )
    update = "UPDATE OR ABORT messages SET data = ? WHERE rowid = ?"
    room = Room(Path(file.name).stat().st_size)
    first: int | None = SMALLEST if mine else None
    while first is not None and first <= LARGEST:
        rows: dict[str, list[tuple[int, int, Any]]] = {}
        size, start, first = 0, first, None
        with closing(database.execute(query, (start, *mine))) as messages:
            for row, topic, time, data in messages:
                if not isinstance(time, int) or not isinstance(data, bytes):
                    raise RecordingError("a message has values of other types")
                rows.setdefault(mine[topic], []).append((row, time, data))
                size += len(data)
                if size >= GROUP:
                    first = row + 1
                    break
        for name, own in rows.items():
            ids, times, raws = zip(*own, strict=True)
            payloads = converted(name, conversions[name], raws, times, room)
            database.executemany(update, zip(payloads, ids, strict=True))


def _counts(
    database: sqlite3.Connection, file: Db3File, conversions: Mapping[str, Conversion]
) -> dict[str, RewrittenTopic]:
    query = (
        "SELECT topic_id, COUNT(*), SUM(LENGTH(data)) FROM messages NOT INDEXED GROUP BY topic_id"
    )
    counts = {number: (count, size or 0) for number, count, size in database.execute(query)}
    topics: dict[str, RewrittenTopic] = {}
    for own, number in file.topics:
        count, size = counts.get(number, (0, 0))
        before = topics.get(own.name, RewrittenTopic(0, 0, False))
        done = own.name in conversions and conversions[own.name].convert is not None
        topics[own.name] = RewrittenTopic(before.messages + count, before.size + size, done)
    return topics
