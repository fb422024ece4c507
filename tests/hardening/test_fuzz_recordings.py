"""Recordings may come from anybody: mutations that know what they change, in great number.

A failure says the number of its input, which this seed always has, and keeps the input where it
says.
"""

import random
import resource
import shutil
import signal
import sys
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

import idlc
from idlc.cli.main import main
from idlc.diagnostics.report import Report
from idlc.model.idl_text import idl
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.recordings.containers.container import Schema, Topic, open_recording
from idlc.recordings.containers.messages import ALWAYS, Ranges
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.definitions import read_definition
from idlc.recordings.types import LocalTypes, recorded_types, versions
from tests.support import db3_mutations, definition_mutations, mcap_mutations
from tests.support import recordings as made
from tests.support.paths import ROOT
from tests.support.rounds import SEED, rounds

#: Seconds of processor time that any of these small inputs may take.
MOST_TIME = 20
#: Bytes that a process may have more than it has at the beginning; the largest chunk is a third.
MOST_MEMORY = 3 << 29
pytestmark = pytest.mark.rounds

SMALL = [one for one in made.messages(24) if one.topic != "/camera/image"]


@pytest.fixture(autouse=True)
def bounded():
    """Let nothing take all memory; only Linux says how much there is."""
    if sys.platform != "linux":
        yield
        return
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = pages * resource.getpagesize() + MOST_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    yield
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@contextmanager
def attempt(number, name, data):
    """Say which input it was that broke something, or took too long, and keep it."""

    def late(*_):
        raise AssertionError(f"took more than {MOST_TIME} s")

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, MOST_TIME)
    try:
        yield
    except Exception as error:
        path = ROOT / "build" / f"{SEED}-{number}-{name}"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)
        raise AssertionError(f"broken by input {number} of seed {SEED}, kept as {path}") from error
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


class Kinds:
    """What of the mutated files can be decoded by types that were compiled once."""

    def __init__(self, folder):
        path = made.by_mcap(folder / "sound.mcap", SMALL, "")
        with idlc.Recording(path) as recording:
            self.known = {one.topic.schema: one._type for one in recording.values()}

    def decode(self, recording):
        """Read messages as objects and as columns, which agree."""
        for name in recording:
            topic = recording[name]
            if topic.topic.encoding == "cdr" and topic.topic.schema in self.known:
                topic._type = self.known[topic.topic.schema]
                count = sum(1 for _ in topic)
                assert len(topic.to_columns()) == topic.to_arrow().num_rows == count


@pytest.fixture(scope="module")
def kinds(tmp_path_factory):
    return Kinds(tmp_path_factory.mktemp("sound"))


def outcome(work):
    """Return whether work came to an end without an error about the recording."""
    try:
        work()
    except RecordingError:
        return False
    return True


def exhausted(container, topic):
    """Read all messages, which lie in their buffer, if they have one, and not in each other."""
    for some in container.messages(topic, ALWAYS):
        assert len(some.views()) == len(some) > 0
        if not isinstance(some, Ranges):
            continue
        assert some.starts[0] >= 0
        assert some.stops[-1] <= len(some.buffer)
        assert (some.starts <= some.stops).all()
        assert (some.stops[:-1] <= some.starts[1:]).all()


def walk(path, kinds, **options):
    """Do with a recording what programs do."""
    with idlc.Recording(path, **options) as recording:
        assert len(recording) <= len(recording.topics)
        for topic in recording.topics:
            container = recording._container
            outcome(partial(exhausted, container, topic))
            read_definition(topic, "demo")
        kinds.decode(recording)


def containers():
    """Return sound files of MCAP, small ones, of all shapes."""
    shapes = {
        "whole": {},
        "loose": {"use_chunking": False},
        "bare": {"index_types": made.INDEX_TYPES.NONE, "use_statistics": False},
        "lean": {"repeat_schemas": False, "repeat_channels": False, "use_summary_offsets": False},
    }
    for compression in made.COMPRESSIONS:
        for name, more in shapes.items():
            yield f"{name}-{compression}", compression, {"chunk_size": 1500, **more}


def test_mcap_files(tmp_path, kinds):
    rng = random.Random(SEED)
    sound = [
        made.by_mcap(tmp_path / name, SMALL, compression, **more).read_bytes()
        for name, compression, more in containers()
    ]
    path, fine = tmp_path / "mutated.mcap", 0
    for number in range(rounds(200)):
        data = mcap_mutations.mutated(sound[number % len(sound)], rng)
        path.write_bytes(data)
        walked = partial(walk, path, kinds, index=number % 3 > 0, check=number % 2 > 0)
        with attempt(number, path.name, data):
            fine += outcome(walked)
    assert 0.1 < fine / rounds(200) < 1


def test_db3_files(tmp_path, kinds):
    rng = random.Random(SEED)
    bag = made.by_rosbags(tmp_path / "bag", SMALL, "db3")
    other = made.by_rosbags(tmp_path / "compressed", SMALL, "db3", "message")
    sound = [next(one.glob("*.db3")).read_bytes() for one in (bag, other)]
    path, fine = tmp_path / "mutated.db3", 0
    for number in range(rounds(240)):
        data = db3_mutations.mutated(sound[number % 2], rng, tmp_path / "work.db3")
        path.write_bytes(data)
        with attempt(number, path.name, data):
            fine += outcome(lambda: walk(path, kinds))
    assert 1 / 15 < fine / rounds(240) < 1


#: Names that lead out of a folder, or are none.
NAMES = [
    *("../outside.mcap", "/etc/passwd", "bag_0.mcap", "bag_1.mcap", "a\\b", "..", ".", "''", '"'),
    *("~/x.mcap", "\0", "é.mcap", "x" * 5000, "&a", "*a", "!!python/object:os.system", "{}", "|"),
]


def test_bags(tmp_path, kinds):
    rng = random.Random(SEED)
    sound = made.by_rosbags(tmp_path / "bag", SMALL, "mcap")
    text = (sound / "metadata.yaml").read_text(encoding="utf-8")
    path = tmp_path / "bag" / "metadata.yaml"
    made.by_mcap(tmp_path / "outside.mcap", SMALL[:1], "")
    for number in range(rounds(20)):
        lines = text.splitlines(keepends=True)
        for _ in range(rng.choice([1, 2, 5])):
            at = rng.randrange(len(lines))
            if rng.random() < 0.5:
                at = next(n for n, one in enumerate(lines) if "relative_file_paths" in one) + 1
                lines.insert(at, f"{' ' * rng.randrange(6)}- {rng.choice(NAMES)}\n")
            else:
                lines[at] = definition_mutations.mutated(lines[at], rng, idl=False)
            if "relative_file_paths" not in "".join(lines):
                lines.append(f"  relative_file_paths: [{rng.choice(NAMES)}]\n")
        path.write_text("".join(lines), encoding="utf-8")
        with attempt(number, path.name, "".join(lines).encode()):
            if outcome(lambda: walk(sound, kinds)):
                with open_recording(sound) as container:
                    assert [one.place for one in container.files] == [next(sound.glob("*.mcap"))]


def definitions(style):
    """Return sound definitions of types of every shape, with all that they need."""
    around = LocalTypes(Scope(Root.here()), Report())
    found = []
    for name in made.KINDS:
        text = made.definition(name)
        if style == "ros2idl":
            types = typed(around, name, "ros2msg", text)
            model = types.models[name.partition("/")[0]]
            text = idl(next(one for one in model.own if str(one.name) == name))
        found.append((name, text))
    return found


def typed(around, name, encoding, text, hash_=None):
    """Return what a recording's topic of a type means."""
    topic = Topic("/x", name, 1, hash_, "cdr", Schema(name, encoding, text))
    (version,) = versions([read_definition(topic, "demo")])
    return recorded_types(version, around, Report())


@pytest.mark.parametrize("style", ["ros2msg", "ros2idl"])
def test_definitions(style, tmp_path):
    rng = random.Random(SEED)
    around = LocalTypes(Scope(Root.here()), Report())
    sound = definitions(style)
    whole = 0
    for number in range(rounds(60)):
        name, text = sound[number % len(sound)]
        text = definition_mutations.mutated(text, rng, idl=style == "ros2idl")
        with attempt(number, f"definition.{style}", text.encode("utf-8", "surrogatepass")):
            # with another hash, nothing that is known stands in for what has errors
            types = typed(around, name, style, text, "RIHS01_0" if number % 2 else None)
            for one in types.topics:
                whole += types.hash(one) is not None
    assert 1 / 15 < whole / rounds(60) < 1


def test_what_is_written_stays_in_its_folder(tmp_path, monkeypatch, capsys):
    """The whole command, for some definitions and containers of those above."""
    rng = random.Random(SEED)
    monkeypatch.chdir(tmp_path)
    whole = made.by_mcap(tmp_path / "sound", SMALL, "").read_bytes()
    for number in range(rounds(2)):
        data = mcap_mutations.mutated(whole, rng)
        (tmp_path / "rec.mcap").write_bytes(data)
        with attempt(number, "rec.mcap", data):
            for words in (["gen", "-o", "out"], ["columns", "-o", "columns/"], ["show"]):
                assert main([words[0], "rec.mcap", *words[1:]]) in (0, 1, 2)
        said = "".join(capsys.readouterr())
        assert "Traceback" not in said
        assert "IDL901" not in said
        inside = {"sound", "rec.mcap", "out", "columns"}
        assert {one.name for one in tmp_path.iterdir()} <= inside
        for one in ("out", "columns"):
            shutil.rmtree(one, ignore_errors=True)
