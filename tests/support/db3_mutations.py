"""Databases that no recorder writes: by pages and cells of the file, or by statements of SQL."""

from __future__ import annotations

import random
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

from tests.support.mcap_mutations import number

TABLES = {
    "topics": ("id", "name", "type", "serialization_format", "type_description_hash"),
    "messages": ("id", "topic_id", "timestamp", "data"),
    "message_definitions": ("topic_type", "encoding", "encoded_message_definition"),
    "schema": ("schema_version", "ros_distro"),
}
VALUES = [
    *("NULL", "-1", "0", "1", "9223372036854775807", "-9223372036854775808", "1e999", "1.5"),
    *("''", "'x'", "x''", "x'ff'", "x'0001000000'", "zeroblob(100000)", "CAST(x'ff00' AS TEXT)"),
    *("x'28b52ffd'", "x'28b52ffda0ffffff7f'", "x'28b52ffd2004010000'", "'/imu'", "'a/b/c'"),
    *("x'00010000'", "'std_msgs/msg/Empty'", "char(0)", "'ros2idl'", "randomblob(40)"),
]
#: What is asked of SQLite.
STATEMENTS = [
    *["UPDATE {table} SET {column} = {value} WHERE rowid = 1 + (random() & 3)"] * 6,
    "UPDATE {table} SET {column} = {value}",
    "DELETE FROM {table} WHERE random() & 1",
    "DELETE FROM {table}",
    "DROP TABLE {table}",
    "ALTER TABLE {table} DROP COLUMN {column}",
    "ALTER TABLE {table} RENAME COLUMN {column} TO other",
    "ALTER TABLE {table} RENAME TO other",
    "ALTER TABLE {table} ADD COLUMN made GENERATED ALWAYS AS ({column}) VIRTUAL",
    "ALTER TABLE {table} ADD COLUMN log_time TEXT DEFAULT {value}",
    "ALTER TABLE {table} RENAME TO was; CREATE VIEW {table} AS SELECT * FROM was",
    (
        "CREATE VIEW v AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) "
        "SELECT x FROM c"
    ),
    "CREATE TRIGGER t AFTER INSERT ON {table} BEGIN DELETE FROM {table}; END",
    "CREATE VIRTUAL TABLE f USING fts5(a)",
    "CREATE INDEX i ON {table} ({column}) WHERE {column} > {value}",
    "CREATE INDEX i ON {table} (abs({column}))",
    "INSERT INTO {table} SELECT * FROM {table}",
    "INSERT INTO {table} DEFAULT VALUES",
    (
        "CREATE TABLE copy AS SELECT * FROM {table}; DROP TABLE {table}; "
        "ALTER TABLE copy RENAME TO {table}"
    ),
    'CREATE TABLE "a""; DROP TABLE x" (a)',
    "PRAGMA writable_schema=1; UPDATE sqlite_master SET sql = {value} WHERE name = '{table}'",
    "PRAGMA writable_schema=1; UPDATE sqlite_master SET rootpage = 1 WHERE name = '{table}'",
    "PRAGMA writable_schema=1; UPDATE sqlite_master SET type = {value} WHERE name = '{table}'",
    "PRAGMA writable_schema=1; UPDATE sqlite_master SET name = {value} WHERE name = '{table}'",
    "PRAGMA encoding='UTF-16'; VACUUM",
    "PRAGMA journal_mode=WAL",
    "PRAGMA page_size=512; VACUUM",
    "PRAGMA user_version=7",
]


def mutated(data: bytes, rng: random.Random, place: Path) -> bytes:
    """Return a database with few changes; `place` is a file to work with."""
    if rng.random() < 0.6:
        data = by_statements(data, rng, place)
    return data if rng.random() < 0.4 else by_pages(data, rng)


def by_statements(data: bytes, rng: random.Random, place: Path) -> bytes:
    """Return a database after statements that SQLite accepted."""
    place.write_bytes(data)
    with closing(sqlite3.connect(place, isolation_level=None)) as db:
        db.execute("PRAGMA synchronous=OFF")
        for _ in range(rng.choice([1, 1, 2, 3])):
            table = rng.choice([*TABLES, "topics", "messages", "messages"])
            words = {"column": rng.choice(TABLES[table]), "value": rng.choice(VALUES)}
            with suppress(sqlite3.Error):
                db.executescript(rng.choice(STATEMENTS).format(table=table, **words))
    made = place.read_bytes()
    for extra in ("", "-wal", "-shm", "-journal"):
        place.with_name(place.name + extra).unlink(missing_ok=True)
    return made


def by_pages(data: bytes, rng: random.Random) -> bytes:
    """Return a database with other numbers in its head, or in those of its pages and cells."""
    raw = bytearray(data)
    size = int.from_bytes(raw[16:18], "big")
    size = 65536 if size == 1 else max(size, 512)
    for _ in range(rng.choice([1, 1, 2, 4])):
        page = rng.randrange(max(1, len(raw) // size)) * size
        head = page + (100 if page == 0 else 0)
        count = int.from_bytes(raw[head + 3 : head + 5], "big") or 1
        cell = int.from_bytes(raw[head + 8 : head + 10], "big") or 1
        at, width = rng.choice(
            [
                (rng.choice([16, 18, 19, 20, 21, 22, 23]), 1),
                (rng.choice([24, 28, 32, 36, 40, 44, 52, 56, 60, 64, 96]), 4),
                (head, 1),
                (head + rng.choice([1, 3, 5]), 2),
                (head + 8 + 2 * rng.randrange(count), 2),
                *[(page + cell + rng.randrange(12), rng.choice([1, 1, 4]))] * 3,
                (page + rng.randrange(size), 1),
            ]
        )
        raw[at : at + width] = number(rng, width, len(raw)).to_bytes(width, "big")
    if rng.random() < 0.1:
        del raw[rng.randrange(len(raw)) :]
    return bytes(raw)
