"""Containers from anybody: each ends in messages or in an error, in bounded time and memory."""

import random
import re
import subprocess
import sys
from struct import pack

import pytest
import zstandard

import idlc
from idlc.recordings.containers.compression import MOST_IN_A_CHUNK
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.messages import ALWAYS
from idlc.recordings.containers.records import CHUNK_OP, HEAD, MAGIC
from idlc.recordings.containers.source import RecordingError
from tests.support import recordings as made
from tests.support.rounds import SEED, rounds

COUNT = rounds(150)
SMALL = [one for one in made.messages(24) if one.topic != "/camera/image"]
#: Where readers that trust numbers go wrong.
NUMBERS = [
    pack(f"<{code}", value & (1 << bits) - 1)
    for code, bits in (("B", 8), ("H", 16), ("I", 32), ("Q", 64))
    for value in (0, 1, 8, 9, -1, 1 << bits - 1, (1 << bits - 1) - 1, 1 << 29, 1000)
]


def sources(folder):
    """Return sound files of every kind, as bytes."""
    found = [
        made.by_mcap(folder / f"{name}{compression}", SMALL, compression, chunk_size=1500, **more)
        for compression in made.COMPRESSIONS
        for name, more in {
            "whole": {},
            "loose": {"use_chunking": False},
            "bare": {"index_types": made.INDEX_TYPES.NONE, "use_statistics": False},
        }.items()
    ]
    found += made.by_rosbags(folder / "bag", SMALL, "db3").glob("*.db3")
    return [path.read_bytes() for path in found]


def mutated(data, rng):
    raw = bytearray(data)
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        at = rng.randrange(len(raw))
        match rng.randrange(5):
            case 0:
                raw[at] = rng.randrange(256)
            case 1 | 2:
                number = rng.choice(NUMBERS)
                raw[at : at + len(number)] = number
            case 3:
                size = rng.randrange(1, 200)
                other = rng.randrange(len(raw))
                raw[at : at + size] = raw[other : other + size]
            case _:
                del raw[at : at + rng.choice([1, 9, 1 << 20])]
        raw = raw or bytearray(b"\0")
    return bytes(raw)


def read(path, index, strict=False):
    """Read all there is; return how many bytes of messages there are."""
    with open_recording(path, index=index, strict=strict) as container:
        found = [one for topic in container.topics for one in container.messages(topic, ALWAYS)]
        return sum(len(view) for one in found for view in one.views())


@pytest.mark.rounds
def test_mutated_containers_end_in_messages_or_in_an_error(tmp_path):
    rng = random.Random(SEED)
    sound = sources(tmp_path)
    path, errors = tmp_path / "mutated", 0
    for number in range(COUNT):
        path.write_bytes(mutated(sound[number % len(sound)], rng))
        for index in (True, False):
            try:
                # each byte of a file is in a message once; these files do not compress well
                assert read(path, index) < 20 * path.stat().st_size
            except RecordingError:
                errors += 1
    assert 0 < errors < 2 * COUNT


@pytest.mark.rounds
def test_mutated_messages_end_in_values_or_in_an_error(tmp_path):
    rng = random.Random(SEED)
    path = tmp_path / "mutated.mcap"
    for _ in range(rounds(30)):
        found = [one._replace(data=mutated(one.data, rng)) for one in SMALL]
        made.by_mcap(path, found, "")
        with idlc.Recording(path) as recording:
            for topic in recording.values():
                try:
                    values = [message for _, message in topic]
                except RecordingError as error:
                    said = str(error).partition(":")[0]
                    with pytest.raises(RecordingError, match=re.escape(said)):
                        topic.to_arrow()
                else:
                    assert topic.to_arrow().num_rows == len(topic.to_columns()) == len(values)


def chunk(compression, declared, data):
    """Return a file with one chunk."""
    name = compression.encode()
    fixed = pack("<QQQII", 0, 0, declared, 0, len(name)) + name + pack("<Q", len(data)) + data
    header = HEAD.pack(1, 8) + bytes(8)
    return MAGIC + header + HEAD.pack(CHUNK_OP, len(fixed)) + fixed


def bombs():
    """Yield files whose chunks hold, or say that they hold, more than anybody has room for."""
    much = zstandard.ZstdCompressor().compress(bytes(MOST_IN_A_CHUNK // 4))
    for declared in (1 << 20, MOST_IN_A_CHUNK, MOST_IN_A_CHUNK + 1, 1 << 40, (1 << 64) - 1):
        yield f"zstd {declared}", chunk("zstd", declared, much)
        yield f"nothing {declared}", chunk("", declared, b"abc")
        yield f"lz4 {declared}", chunk("lz4", declared, b"\x04\x22\x4d\x18" + bytes(40))
        yield f"brotli {declared}", chunk("brotli", declared, b"abc")


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are those of Linux")
def test_a_bomb_does_not_go_off(tmp_path):
    """With room for the largest chunk that is accepted and not much more."""
    paths = []
    for name, data in bombs():
        paths.append(tmp_path / name.replace(" ", "_"))
        paths[-1].write_bytes(data)
    code = (
        "import sys, resource, zstandard, lz4.frame, numpy\n"
        "from tests.recordings.test_hostile_containers import read\n"
        "from idlc.recordings.containers.container import RecordingError\n"
        "before = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
        f"most = before + {MOST_IN_A_CHUNK} + (64 << 20)\n"
        "resource.setrlimit(resource.RLIMIT_AS, (most, most))\n"
        "for path in sys.argv[1:]:\n"
        "    try:\n        read(path, True, True)\n"
        "    except RecordingError as error:\n        print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, paths)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    said = done.stdout.splitlines()
    assert len(said) == len(paths)
    known = ("declares", "unknown compression", "cannot be decompressed", "cut off")
    assert all(any(one in line for one in known) for line in said), said


def test_a_checksum_that_is_wrong_is_an_error_on_wish(tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", SMALL, "")
    data = bytearray(path.read_bytes())
    data[data.rindex(SMALL[-1].data) + 5] ^= 1
    path.write_bytes(data)
    with idlc.Recording(path) as recording:
        assert sum(topic.to_arrow().num_rows for topic in recording.values()) == len(SMALL)
    with (
        idlc.Recording(path, check=True, strict=True) as recording,
        pytest.raises(RecordingError, match="sum"),
    ):
        recording[SMALL[-1].topic].to_arrow()
