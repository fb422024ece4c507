"""Damaged recordings: whole messages around the damage are read, and the damage is reported."""

import random
import sqlite3
from collections import Counter
from contextlib import closing, suppress

import pytest
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

import idlc
from idlc.cli.main import main
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.damage import DamageWarning
from idlc.recordings.containers.messages import ALWAYS, NO_TIME
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.rewrite import rewrite
from tests.support import mcap_mutations
from tests.support import recordings as made
from tests.support.rounds import ALL, SEED

MESSAGES = made.messages(120)
TOPICS = {number: topic for number, topic in enumerate(made.MAKERS, 1)}
WHOLE = Counter((one.log_time, one.data) for one in MESSAGES)


def mcap_files(folder):
    """Yield kinds of MCAP files: their bytes, and whether checksums cover the messages."""
    for compression in made.COMPRESSIONS:
        for name, options in {
            "chunks": {"chunk_size": 3000},
            "unproven": {"chunk_size": 3000, "enable_crcs": False},
            "loose": {"use_chunking": False},
            "bare": {"chunk_size": 3000, "index_types": made.INDEX_TYPES.NONE},
        }.items():
            path = made.by_mcap(folder / "sound.mcap", MESSAGES, compression, **options)
            data = path.read_bytes()
            is_proven = name in ("chunks", "bare")
            yield data, is_proven
            end = next(one.at for one in mcap_mutations.records(data[:-8], 8) if one.op == 15)
            yield data[:end], is_proven


def database(path, page):
    """Write a .db3 file with the messages."""
    path.unlink(missing_ok=True)
    with closing(sqlite3.connect(path)) as file:
        file.execute(f"PRAGMA page_size={page}")
        file.executescript(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,"
            " serialization_format TEXT, offered_qos_profiles TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,"
            " data BLOB);"
        )
        rows = [(number, topic, made.MAKERS[topic][0]) for number, topic in TOPICS.items()]
        file.executemany("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", rows)
        numbers = {topic: number for number, topic in TOPICS.items()}
        file.executemany(
            "INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)",
            [(numbers[one.topic], one.log_time, one.data) for one in MESSAGES],
        )
        file.commit()
    return path.read_bytes()


def damaged(data, rng):
    """Return a file with damage in one place or two."""
    raw = bytearray(data)
    for _ in range(rng.choice([1, 1, 1, 2])):
        at = rng.randrange(8, len(raw))
        size = min(rng.choice([1, 8, 100, 512, 4096]), len(raw) - at)
        match rng.randrange(5):
            case 0:
                raw[at : at + size] = bytes(size)
            case 1:
                raw[at : at + size] = rng.randbytes(size)
            case 2:
                raw[at] ^= 1 << rng.randrange(8)
            case 3:
                raw[at:] = bytes(len(raw) - at)
            case _:
                del raw[at:]
                if len(raw) <= 8:
                    return bytes(data)
    return bytes(raw)


def read(path, **options):
    """Return the messages that idlc reads, and the container."""
    found = Counter()
    with open_recording(path, **options) as container:
        for topic in container.topics:
            with suppress(RecordingError):
                for some in container.messages(topic, ALWAYS):
                    pairs = zip(some.log_times.tolist(), map(bytes, some.views()), strict=True)
                    found.update(pairs)
    return found, container


def in_stream(file):
    """Yield the topic of each message of a defined channel, and the message."""
    topics = {}
    for one in StreamReader(file, validate_crcs=True).records:
        if isinstance(one, Channel):
            topics[one.id] = one.topic
        if isinstance(one, Message):
            yield topics.get(one.channel_id), one


def of_mcap(path):
    """Return the messages that the readers of the mcap library yield before they stop."""
    found = []
    for reader in ("stream", "seeking"):
        messages = Counter()
        with path.open("rb") as file, suppress(Exception):
            if reader == "stream":
                every = in_stream(file)
            else:
                seeking = make_reader(file, validate_crcs=True)
                summary = seeking.get_summary()
                # without indexes, it does not compare checksums
                has_indexes = summary is not None and len(summary.chunk_indexes) > 0
                pairs = seeking.iter_messages() if has_indexes else ()
                every = ((channel.topic, one) for _, channel, one in pairs)
            for topic, one in every:
                time = one.log_time if one.log_time < 1 << 63 else NO_TIME
                messages[time, bytes(one.data)] += topic is not None
        found.append(messages)
    return found[0] | found[1]


@pytest.mark.rounds
def test_what_the_mcap_library_reads_of_a_damaged_file_is_read(tmp_path):
    rng, path, found, lost = random.Random(SEED), tmp_path / "a.mcap", 0, 0
    sound = list(mcap_files(tmp_path))
    for number in range(1400 if ALL else 24):
        data, is_proven = sound[number % len(sound)]
        path.write_bytes(damaged(data, rng))
        try:
            messages, container = read(path, check=True)
        except RecordingError as error:
            assert "two different definitions" in error.message  # noqa: PT017
            continue
        expected = of_mcap(path)
        # without checksums, a chunk is only read until the damage in it
        assert not (expected - messages) or (container.damage and not is_proven), number
        if is_proven:
            assert not (messages - WHOLE), number
        elif container.damage and messages:
            assert "no checksum covers" in " ".join(container.notes), number
        found += messages.total() - expected.total()
        lost += WHOLE.total() - messages.total()
        assert container.damage or not is_proven or not (WHOLE - messages) or "not closed" in str(
            container.notes
        )
    assert found > 0
    assert lost > 0


def of_sqlite(path):
    """Return the messages that SQLite finds, each row by itself."""
    messages = Counter()
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as file:
        for row in range(1, len(MESSAGES) + 2):
            query = "SELECT topic_id, timestamp, data FROM messages WHERE id = ?"
            with suppress(sqlite3.Error, UnicodeError):
                for topic, time, data in file.execute(query, (row,)):
                    if isinstance(time, int) and isinstance(data, bytes) and topic in TOPICS:
                        messages[time, data] += 1
    return messages


@pytest.mark.rounds
def test_what_sqlite_reads_of_a_damaged_file_is_read(tmp_path):
    rng, path, partial = random.Random(SEED), tmp_path / "a.db3", 0
    sound = [database(tmp_path / "sound.db3", page) for page in (512, 1024, 4096)]
    for number in range(600 if ALL else 12):
        data = damaged(sound[number % len(sound)], rng)
        path.write_bytes(data)
        expected = of_sqlite(path)
        if len(data) % (512, 1024, 4096)[number % 3]:
            expected &= WHOLE  # SQLite fills the page with zeros
        try:
            messages, container = read(path)
        except RecordingError:
            # its topics cannot be read either
            with closing(sqlite3.connect(path)) as file, pytest.raises(sqlite3.Error):
                file.execute("SELECT COUNT(*), MAX(name || type) FROM topics").fetchall()
                raise sqlite3.DataError from None
            continue
        assert not (expected - messages), number
        partial += 0 < messages.total() < WHOLE.total() and bool(container.damage)
    assert partial > 0
