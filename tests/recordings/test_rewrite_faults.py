"""Whatever happens while a recording is rewritten: the source is whole, and the target all or none.

Faults are committed at every write, as in tests/hardening/test_faults.py.
"""

import errno
import os
import random
import shutil
import signal
import subprocess
import sys
from collections import Counter
from contextlib import suppress

import pytest
import zstandard

from idlc.project.atomic import locked
from idlc.recordings.containers.compression import MOST_IN_A_CHUNK
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.messages import ALWAYS
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.rewrite import Conversion, rewrite
from tests.recordings.test_hostile_containers import bombs, mutated, sources
from tests.support import db3_mutations, mcap_mutations
from tests.support import recordings as made
from tests.support.machine import running, tree
from tests.support.rounds import SEED, rounds

COUNT = rounds(300)
MESSAGES = made.messages(60)
NEW = Conversion("new_msgs/msg/New", "ros2msg", "int8 a\n", "RIHS01_new")
CONVERTED = NEW._replace(convert=lambda raws, _: [bytes(raw) * 2 for raw in raws])


@pytest.fixture(scope="module")
def machine():
    with running() as found:
        made.by_mcap(found.folder / "in.mcap", MESSAGES, "zstd", chunk_size=2000)
        made.by_rosbags(found.folder / "in_db3", MESSAGES, "db3")
        yield found


@pytest.fixture(params=["in.mcap", "in_db3"])
def source(request, machine):
    """Return a recording, and what is in the folder before it is rewritten."""
    return request.param, tree(machine.folder)


def run(machine, name, **fault):
    return machine.run([], rewrite=[name, f"new/out/{name}"], **fault)


def done(machine, before):
    """Return the files that are new, and remove them; fail if others changed."""
    now = tree(machine.folder)
    assert {path: data for path, data in now.items() if path in before} == before
    new = {path: data for path, data in now.items() if path not in before}
    shutil.rmtree(machine.folder / "new", ignore_errors=True)
    return new


def is_draft(path):
    return path.startswith("new/out/.in")


def test_killed_at_any_write(machine, source):
    name, before = source
    points = run(machine, name)["points"]
    whole = done(machine, before)
    assert points >= 5
    for point in range(1, points + 1):
        assert run(machine, name, point=point)["status"] == -signal.SIGKILL
        found = {path: data for path, data in done(machine, before).items() if not is_draft(path)}
        assert found in ({}, whole)
        assert run(machine, name)["status"] == 0
        assert done(machine, before) == whole


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO])
def test_every_write_from_some_point_on_fails(number, machine, source):
    name, before = source
    points = run(machine, name)["points"]
    whole = done(machine, before)
    for point in range(1, points + 1):
        found = run(machine, name, point=point, error=number)
        left = done(machine, before)
        if found["status"] == 0:  # only tidying up was left
            assert {path: data for path, data in left.items() if not is_draft(path)} == whole
            continue
        assert found["status"] == 1, found
        assert f"`new/out/{name}` cannot be written: {os.strerror(number)}" in found["said"]
        # removing the draft fails, too
        assert all(map(is_draft, left))


@pytest.mark.parametrize("size", [0, 1000, 9000])
def test_a_full_disk(size, machine, source):
    name, before = source
    found = run(machine, name, size=size)
    assert found["status"] == 1, found
    assert "cannot be written" in found["said"]
    assert done(machine, before) == {}
    assert run(machine, name)["status"] == 0
    assert done(machine, before)


@pytest.mark.skipif(sys.platform == "win32", reason="folders cannot be locked")
def test_the_draft_of_a_killed_run_is_removed_by_the_next(tmp_path):
    """But not that of a run that has not ended."""
    made.by_mcap(tmp_path / "a.mcap", MESSAGES, "")
    out = tmp_path / "out"
    for name in (".a.mcap.00112233", ".a.mcap.44556677", ".a.mcap.backup", ".b.mcap.00112233"):
        (out / name).mkdir(parents=True)
        (out / name / "a.mcap").write_bytes(b"x")
    with locked(out / ".a.mcap.44556677"):
        rewrite(str(tmp_path / "a.mcap"), str(out / "a.mcap"), {})
    left = [".a.mcap.44556677", ".a.mcap.backup", ".b.mcap.00112233", "a.mcap"]
    assert sorted(path.name for path in out.iterdir()) == left


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
@pytest.mark.parametrize("storage", ["mcap", "db3"])
def test_a_signal_leaves_no_draft(number, storage, tmp_path):
    made.by_rosbags(tmp_path / "bag", MESSAGES, storage)
    code = (
        "import os, sys\n"
        "from idlc.recordings.rewrite import Conversion, rewrite\n"
        "def convert(raws, times):\n"
        f"    os.kill(os.getpid(), {int(number)})\n"
        "    return [bytes(raw) for raw in raws]\n"
        "new = Conversion('a/msg/B', 'ros2msg', '', '', convert)\n"
        "rewrite('bag', 'new/bag', {'/imu': new})\n"
    )
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, cwd=tmp_path, check=False, stderr=subprocess.DEVNULL)
    assert result.returncode in (-number, 130)
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]


def test_an_error_of_the_conversion_passes_through(tmp_path):
    def convert(raws, times):
        raise ZeroDivisionError(len(raws))

    for storage in ("mcap", "db3"):
        source = made.by_rosbags(tmp_path / storage, MESSAGES, storage)
        with pytest.raises(ZeroDivisionError):
            rewrite(str(source), str(tmp_path / "new"), {"/imu": NEW._replace(convert=convert)})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["db3", "mcap"]


@pytest.mark.parametrize("name", ["a.mcap", "b.mcap", "link.mcap", "bag", "bag/new", "bag/x/new"])
def test_a_target_is_free_and_outside_of_the_source(name, tmp_path):
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    (tmp_path / "b.mcap").write_bytes(b"precious")
    (tmp_path / "link.mcap").symlink_to("nowhere")
    bag = made.by_rosbags(tmp_path / "bag", MESSAGES, "mcap")
    before = tree(tmp_path)
    with pytest.raises(RecordingError, match=r"exists|is the recording itself|is inside of"):
        rewrite(str(bag if "bag" in name else path), str(tmp_path / name), {})
    assert tree(tmp_path) == before
    assert sorted(one.name for one in tmp_path.iterdir()) == [
        "a.mcap",
        "b.mcap",
        "bag",
        "link.mcap",
    ]


@pytest.mark.parametrize("has_links", [True, False])
def test_a_target_that_is_made_meanwhile_is_not_replaced(has_links, tmp_path, monkeypatch):
    def link(*_):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    if not has_links:  # as on FAT
        monkeypatch.setattr("os.link", link)
    path = made.by_mcap(tmp_path / "a.mcap", MESSAGES)
    target = tmp_path / "b.mcap"
    with pytest.raises(RecordingError, match="cannot be written: File exists"):
        rewrite(str(path), str(target), {}, lambda *_: target.write_bytes(b"precious"))
    assert target.read_bytes() == b"precious"
    target.unlink()
    rewrite(str(path), str(target), {})
    assert sorted(one.name for one in tmp_path.iterdir()) == ["a.mcap", "b.mcap"]


@pytest.mark.parametrize("how", ["grows", "is replaced", "is cut off", "changes"])
def test_a_source_that_changes_meanwhile_is_an_error(how, tmp_path):
    path, other = made.by_mcap(tmp_path / "a.mcap", MESSAGES), tmp_path / "other"
    data = path.read_bytes()

    def progress(*_):
        match how:
            case "grows":
                path.write_bytes(data + b"more")
            case "is replaced":
                other.write_bytes(data[:-9])
                other.replace(path)
            case "is cut off":
                os.truncate(path, 100)
            case _:
                path.write_bytes(data)
                os.utime(path, (1, 1))

    with pytest.raises(RecordingError, match=r"was changed while|cut off|was replaced"):
        rewrite(str(path), str(tmp_path / "b.mcap"), {}, progress)
    assert list(tmp_path.iterdir()) == [path]


def read(path, **options):
    """Return topic, time and bytes of all messages, in the order of topics."""
    found = []
    with open_recording(path, **options) as container:
        for topic in container.topics:
            for some in container.messages(topic, ALWAYS):
                pairs = zip(some.log_times.tolist(), map(bytes, some.views()), strict=True)
                found += [(topic.name, *one) for one in pairs]
    return sorted(found)


@pytest.mark.rounds
def test_mutated_containers_are_rewritten_or_an_error(tmp_path):
    rng, errors = random.Random(SEED), 0
    (tmp_path / "sound").mkdir()
    sound = sources(tmp_path / "sound")
    sound += 4 * sound[-1:]
    path, target = tmp_path / "mutated", tmp_path / "target"
    for number in range(COUNT):
        data = sound[number % len(sound)]
        is_mcap = data.startswith(mcap_mutations.MAGIC)
        if number % 2:
            path.write_bytes(mutated(data, rng))
        elif is_mcap:
            path.write_bytes(mcap_mutations.mutated(data, rng))
        else:
            path.write_bytes(db3_mutations.mutated(data, rng, tmp_path / "work"))
        before, use_index = path.read_bytes(), rng.random() < 0.7
        conversions = rng.choice([{}, {"/imu": NEW}, {"/imu": CONVERTED}, {"/joints": CONVERTED}])
        try:
            rewritten = rewrite(str(path), str(target), conversions, index=use_index)
        except RecordingError:
            errors += 1
        else:
            with suppress(RecordingError):  # the rest of the file may be what is broken
                expected = read(path, index=use_index, check=True)
                wanted = [
                    (topic, time, data * 2)
                    if topic in conversions and conversions[topic].convert
                    else (topic, time, data)
                    for topic, time, data in expected
                ]
                written = read(target)
                if rewritten.damage:  # of which it may write less than can be read
                    assert Counter(written) <= Counter(wanted), number
                else:
                    assert written == sorted(wanted), number
                assert sum(topic.messages for topic in rewritten.topics.values()) == len(written)
            target.unlink()
        assert path.read_bytes() == before
        assert sorted(one.name for one in tmp_path.iterdir()) == ["mutated", "sound"]
    assert 0 < errors < COUNT


LIMITED = (
    "import sys, resource, zstandard, lz4.frame, numpy, sqlite3\n"
    "from idlc.recordings.containers.source import RecordingError\n"
    "from idlc.recordings.containers import db3_to_mcap, mcap_rewrite\n"
    "from idlc.recordings.rewrite import Conversion, rewrite\n"
    "convert = lambda raws, _: [b'\\0\\1\\0\\0' + bytes(raw[:9]) for raw in raws]\n"
    "new = Conversion('a/msg/B', 'ros2msg', '', '', convert)\n"
    "before = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
    "most = before + int(sys.argv[1])\n"
    "resource.setrlimit(resource.RLIMIT_AS, (most, most))\n"
    "for path in sys.argv[2:]:\n"
    "    try:\n        print(rewrite(path, path + '.new', {'/imu': new}, strict=True))\n"
    "    except RecordingError as error:\n        print(error)\n"
)


def limited(most, paths):
    """Rewrite files in a process that may use so many bytes; return what it says of each."""
    command = [sys.executable, "-c", LIMITED, str(most), *map(str, paths)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout.splitlines()


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are those of Linux")
def test_a_bomb_does_not_go_off(tmp_path):
    paths = []
    for name, data in bombs():
        paths.append(tmp_path / name.replace(" ", "_"))
        paths[-1].write_bytes(data)
    said = limited(MOST_IN_A_CHUNK + (64 << 20), paths)
    assert len(said) == len(paths)
    known = ("declares", "unknown compression", "cannot be decompressed", "cut off")
    assert all(any(one in line for one in known) for line in said), said
    assert sorted(tmp_path.iterdir()) == sorted(paths)


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are those of Linux")
def test_memory_is_bounded_for_recordings_that_are_larger(tmp_path):
    """Each has a GB of messages, and the process a quarter of that."""
    large = MESSAGES[0]._replace(data=b"\0\1\0\0" + random.Random(1).randbytes(1 << 14) * 512)
    made.by_mcap(tmp_path / "chunks.mcap", [large] * 128, "zstd", chunk_size=1 << 24)
    packed = large._replace(data=zstandard.compress(large.data))
    made.by_mcap(tmp_path / "packed.mcap", [packed] * 128, "", chunk_size=1 << 24)
    made.by_mcap(tmp_path / "loose.mcap", [packed] * 128, "", use_chunking=False)
    made.by_rosbags(tmp_path / "bag", [packed] * 128, "db3")
    paths = [*tmp_path.glob("*.mcap"), tmp_path / "bag"]
    said = limited(1 << 28, paths)
    assert len(said) == len(paths)
    assert all("messages=128" in line for line in said), said
