"""Databases in every state that SQLite itself can leave them in: what SQLite reads, or an error.

A state is what lies on the disk at some point of a writer's work: copied then, it is what is left
when the writer dies there. SQLite recovers one copy, idlc reads another.
"""

import os
import shutil
import sqlite3
import struct
from contextlib import closing, suppress

import numpy as np
import pytest

import idlc
from idlc.cli.main import main
from idlc.recordings.containers.source import RecordingError

#: Journals that a writer's death leaves something of, or nothing.
JOURNALS = ("DELETE", "TRUNCATE", "PERSIST", "WAL")
EXTRA = ("-journal", "-wal", "-shm")


def message(number, size=1200):
    """Return a Float64 in more bytes than it needs, so that not all pages stay in a cache."""
    return (b"\0\1\0\0" + struct.pack("<d", number)).ljust(size, b"\0")


def create(path, count=60, journal="DELETE", pragmas=("page_size=1024",)):
    """Return the connection of a writer of a recording."""
    database = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    for pragma in (*pragmas, f"journal_mode={journal}", "cache_size=3"):
        database.execute(f"PRAGMA {pragma}")
    database.executescript(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        " serialization_format TEXT NOT NULL, type_description_hash TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        "CREATE TABLE message_definitions(topic_type TEXT, encoding TEXT,"
        " encoded_message_definition TEXT);"
        "INSERT INTO message_definitions VALUES('std_msgs/msg/Float64', 'ros2msg', 'float64 data');"
        "INSERT INTO topics VALUES(1, '/x', 'std_msgs/msg/Float64', 'cdr', '');"
    )
    rows = [(n, 1, n, message(n)) for n in range(count)]
    database.executemany("INSERT INTO messages VALUES(?, ?, ?, ?)", rows)
    return database


def steps(database):
    """Change what is there and add to it, in transactions that end in both ways."""
    (page,) = database.execute("PRAGMA page_size").fetchone()
    for end in ("ROLLBACK", "COMMIT", "PRAGMA wal_checkpoint", "COMMIT"):
        if end.startswith("PRAGMA"):
            database.execute(end)
            yield
            continue
        database.execute("BEGIN")
        for number in range(0, 60, 3):
            row = (message(-1 - number, page // 2), number)
            database.execute("UPDATE messages SET data=? WHERE id=?", row)
            if number % 15 == 0:
                yield
        (first,) = database.execute("SELECT MAX(id) + 1 FROM messages").fetchone()
        for number in range(first, first + 20):
            row = (number, 1, number, message(number, page // 2))
            database.execute("INSERT INTO messages VALUES(?, ?, ?, ?)", row)
        yield
        database.execute(end)
        yield


def copied(path, folder, without=()):
    """Copy a database with all that lies beside it."""
    folder.mkdir()
    for extra in ("", *EXTRA):
        source = path.with_name(path.name + extra)
        if source.exists() and extra not in without:
            shutil.copy(source, folder / source.name)
    return folder / path.name


def recovered(path):
    """Return the values that SQLite reads, after it has repaired the file; None if it cannot."""
    with closing(sqlite3.connect(path)) as database:
        database.execute("PRAGMA synchronous=OFF")
        try:
            rows = database.execute("SELECT data FROM messages ORDER BY rowid").fetchall()
        except sqlite3.Error:
            return None
    return [struct.unpack_from("<d", data, 4)[0] for (data,) in rows]


def readable(path):
    """Return the values that SQLite reads before it stops, other than from a page that is cut."""
    values = []
    with closing(sqlite3.connect(path)) as database, suppress(sqlite3.Error):
        database.execute("PRAGMA synchronous=OFF")
        for (data,) in database.execute("SELECT data FROM messages ORDER BY rowid"):
            if not data:
                break
            values.append(struct.unpack_from("<d", data, 4)[0])
    return values if path.stat().st_size % 1024 == 0 else values[:-1]


def read(path):
    """Return the values that idlc reads, or the error."""
    try:
        with idlc.Recording(path) as recording:
            return recording["/x"].to_columns()["data"].tolist()
    except RecordingError as error:
        return error


def files(folder):
    return {one.name: one.read_bytes() for one in folder.iterdir() if "-shm" not in one.name}


@pytest.mark.parametrize("journal", JOURNALS)
@pytest.mark.parametrize(
    "pragmas",
    [
        ("synchronous=OFF", "page_size=512"),
        ("synchronous=FULL", "page_size=65536", "auto_vacuum=FULL"),
        ("synchronous=EXTRA", "auto_vacuum=INCREMENTAL", "locking_mode=EXCLUSIVE"),
    ],
    ids=["512", "65536", "exclusive"],
)
def test_a_writer_that_died_anywhere(journal, pragmas, tmp_path):
    database = create(tmp_path / "a.db3", journal=journal, pragmas=pragmas)
    refused = whole = 0
    with closing(database):
        for number, _ in enumerate(steps(database)):
            for without in ((), ("-shm",)) if journal == "WAL" else ((),):
                name = f"{number}{''.join(without)}"
                mine = copied(tmp_path / "a.db3", tmp_path / name, without)
                other = copied(tmp_path / "a.db3", tmp_path / f"{name}-sqlite", without)
                before = files(mine.parent)
                found = read(mine)
                assert files(mine.parent) == before
                if isinstance(found, RecordingError):
                    assert f"`{mine}`" in found.message
                    assert found.hint
                    refused += 1
                else:
                    assert found == recovered(other)
                    whole += 1
    assert whole
    assert refused or journal == "WAL"


def hot(tmp_path):
    """Return a database whose writer died in a transaction that had reached the file."""
    with closing(create(tmp_path / "w.db3")) as database:
        database.execute("BEGIN")
        database.execute("UPDATE messages SET data=?", (message(-1),))
        path = copied(tmp_path / "w.db3", tmp_path / "hot")
    assert path.with_name("w.db3-journal").stat().st_size
    return path


@pytest.mark.parametrize("how", ["hot", "super-journal", "cut off", "link", "read-only"])
def test_a_hot_journal_is_an_error_that_says_what_to_do(how, tmp_path, capsys):
    path = hot(tmp_path)
    journal = path.with_name(path.name + "-journal")
    if how == "super-journal":
        name = b"/nowhere-mj01234567"
        tail = struct.pack(">II", len(name), sum(name)) + b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"
        journal.write_bytes(journal.read_bytes() + struct.pack(">I", 9) + name + tail)
    if how == "cut off":
        journal.write_bytes(journal.read_bytes()[:-300])
    if how == "read-only":
        path.parent.chmod(0o500)
    if how == "link":
        (tmp_path / "link.db3").symlink_to(path)
        path = tmp_path / "link.db3"
    for words in (["show"], ["check"], ["columns", "/x", "-o", str(tmp_path / "x.csv")]):
        assert main([words[0], str(path), *words[1:]]) != 0
        said = "".join(capsys.readouterr())
        assert "IDL651" in said
        assert "its writer stopped within a transaction" in said
        assert "sqlite3 " in said
    path.parent.chmod(0o700)
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize("journal", ["DELETE", "PERSIST", "TRUNCATE", "MEMORY", "OFF", "WAL"])
def test_a_writer_at_work(journal, tmp_path, monkeypatch):
    """Another connection has written half of a transaction."""
    monkeypatch.setattr("idlc.recordings.containers.db3.PATIENCE", 0.01)
    path = tmp_path / "a.db3"
    with closing(create(path, journal=journal)) as database:
        database.execute("BEGIN")
        database.execute("UPDATE messages SET data=?", (message(-1),))
        found = read(path)
        if journal == "WAL":
            assert found == list(range(60))
        else:
            assert "is locked by the program that is writing it" in found.message
        database.execute("COMMIT")
        assert read(path) == [-1] * 60


def test_reading_does_not_hold_a_writer_up(tmp_path, monkeypatch):
    """Between two groups of messages, nothing is locked."""
    monkeypatch.setattr("idlc.recordings.containers.db3.GROUP", 2000)
    path = tmp_path / "a.db3"
    with closing(create(path)) as database, idlc.Recording(path) as recording:
        found = []
        for some in recording["/x"].batches():
            found += [np.frombuffer(one, "<f8", 1, 4)[0] for one in some.views()]
            number = 1000 + len(found)
            row = (number, 1, number, message(number))
            database.execute("INSERT INTO messages VALUES(?, ?, ?, ?)", row)
        assert found == list(range(60))


def test_a_log_that_was_not_copied_is_told_of(tmp_path, capsys):
    with closing(create(tmp_path / "a.db3", journal="WAL")) as database:
        database.execute("PRAGMA wal_checkpoint")
        path = copied(tmp_path / "a.db3", tmp_path / "copy", ("-wal", "-shm"))
    main(["show", str(path)])
    assert not capsys.readouterr().err
    metadata = path.with_name("metadata.yaml")
    for count, note in ((60, ""), (0, ""), (61, "may be in `a.db3-wal`, which is missing")):
        metadata.write_text(f"rosbag2_bagfile_information: {{message_count: {count}}}")
        main(["show", str(path.parent)])
        assert note in (error := capsys.readouterr().err)
        assert bool(note) == bool(error)
    metadata.unlink()
    for mode in (0o700, 0o500):
        path.parent.chmod(mode)
        main(["show", str(path)])
        assert list(path.parent.iterdir()) == [path]
    path.parent.chmod(0o700)


def test_a_log_that_is_written_back_meanwhile_is_an_error(tmp_path, monkeypatch):
    path = tmp_path / "a.db3"
    create(path, journal="WAL").close()
    assert not path.with_name("a.db3-wal").exists()
    with idlc.Recording(path) as recording:
        with closing(sqlite3.connect(path)) as database, database:
            database.execute("UPDATE messages SET data=?", (message(-1),))
        os.utime(path, (1, 1))
        with pytest.raises(RecordingError, match="was changed while it was read"):
            recording["/x"].to_columns()
        path.unlink()
        with pytest.raises(RecordingError, match="No such file"):
            recording["/x"].to_columns()


@pytest.mark.parametrize("journal", JOURNALS)
@pytest.mark.parametrize("auto_vacuum", [0, 1])
def test_a_database_that_is_cut_off(journal, auto_vacuum, tmp_path):
    pragmas = (f"auto_vacuum={auto_vacuum}", "page_size=1024")
    create(tmp_path / "a.db3", 12, journal, pragmas).close()
    data = (tmp_path / "a.db3").read_bytes()
    for size in range(100, len(data), 300):
        path, other = tmp_path / f"{size}.db3", tmp_path / f"{size}-sqlite.db3"
        for one in (path, other):
            one.write_bytes(data[:size])
        found = read(path)
        if not isinstance(found, RecordingError):
            assert set(found) >= set(readable(other))
            assert found == sorted(found)
            assert set(found) <= set(range(12))


def test_times_before_1970_are_read(tmp_path):
    path = tmp_path / "a.db3"
    with closing(create(path, 0)) as database:
        for number in (-(1 << 63), -5, 0, 5, (1 << 63) - 1):
            row = (1, number, message(number))
            database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", row)
    with idlc.Recording(path) as recording:
        topic = recording["/x"]
        assert len(topic.to_columns()) == 5
        assert topic.between(-5, 5).to_columns()["log_time"].tolist() == [-5, 0]
        assert len(topic.between(-(1 << 70), 1 << 70).to_columns()) == 5
        for window in ((1 << 63, None), (None, -(1 << 70))):
            with pytest.raises(RecordingError, match="no message is in the range of times"):
                topic.between(*window)
