"""Rules that return wrong values, and hostile recordings, end in an error and leave no files."""

import os
import random
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import idlc
from idlc.cli.main import main
from tests.recordings.test_hostile_containers import mutated, sources
from tests.support import db3_mutations, mcap_mutations
from tests.support.paths import ROOT
from tests.support.rounds import SEED, rounds
from tests.tasks.test_upgrade import PAIR, key_of, write_package, write_recording

OLD = {"Drive": "Wheel wheel\nWheel[] wheels\n", "Wheel": "int8 size\n"}
NEW = {
    "Drive": "Wheel wheel\nWheel[] wheels\nfloat32[] numbers\nint8[] few\nWheel hub\nWheel[] all\n",
    "Wheel": "int8 size\n",
}
LIMIT = "must be a number from -3.4028234663852886e+38 to 3.4028234663852886e+38 (float32)"


@pytest.fixture
def types(tmp_path, monkeypatch):
    """The classes of two versions of a recording's type."""
    monkeypatch.chdir(tmp_path)
    old = idlc.load(write_package(tmp_path / "old", OLD))
    message = old.Drive(wheel=old.Wheel(size=1), wheels=[old.Wheel(size=2)])
    write_recording(tmp_path / "a.mcap", old.Drive, [message] * 2)
    return old, idlc.load(write_package(tmp_path / "new", NEW))


def upgraded(old, new, *functions):
    """Write rules, and return the status of the upgrade with them."""
    text = PAIR.format(key_of(old), key_of(new)) + "\n\n".join(functions)
    Path("rules.py").write_text(text, encoding="utf-8")
    return main(["upgrade", "a.mcap", "--to", "new/drive_msgs", "--rules", "rules.py", "-o", "out"])


@pytest.mark.parametrize(
    ("field", "body", "message"),
    [
        ("numbers", "return [1.0, float('inf'), 1e39]", f"numbers[2]: {LIMIT}, not 1e+39"),
        ("numbers", "return (1 / 0 for _ in 'a')", "the rule raised ZeroDivisionError: division"),
        ("numbers", "return '1'", "numbers: must be a sequence, not '1'"),
        ("few", "return [128]", "few[0]: must be an integer from -128 to 127 (int8), not 128"),
        ("few", "return None", "few: must be a sequence, not None"),
        ("hub", "return 5", "hub: must be a Wheel, not 5"),
        ("hub", "return {'size': 200}", "hub: size: must be an integer"),
        ("hub", "return old", "hub: wheel: drive_msgs/msg/Wheel has no such field"),
        ("all", "return 5", "all: must be a sequence, not 5"),
        ("all", "return [old.wheel, 5]", "all[1]: must be a Wheel, not 5"),
        ("hub", "raise SystemExit(0)", "hub: the rule raised SystemExit: 0"),
        ("hub", "return hub(old)", "hub: the rule raised RecursionError"),
        (
            "hub",
            "raise type('Odd', (Exception,), {'__str__': lambda _: 1 / 0})",
            "hub: the rule raised Odd: an exception without a text",
        ),
    ],
)
def test_wrong_values_name_topic_time_and_path(types, tmp_path, capsys, field, body, message):
    old, new = types
    assert upgraded(old.Drive, new.Drive, f"def {field}(old):\n    {body}\n") == 1
    error = capsys.readouterr().err
    assert "`/drive` at 10 ns: " in error
    assert message in error
    assert not (tmp_path / "out").exists()


def test_other_iterables_are_values(types, tmp_path):
    old, new = types
    functions = (
        "import numpy",
        "def numbers(old): return (n for n in (1, float('inf')))",
        "def few(old): return numpy.array([1, 2])",
        "def hub(old): return {'size': 7}",
        "def all(old): return (wheel for wheel in old.wheels)",
    )
    assert upgraded(old.Drive, new.Drive, *functions) == 0
    with idlc.Recording("out/a.mcap") as recording:
        (_, message), _ = recording["/drive"]
    assert message.to_dict() == {
        "wheel": {"size": 1},
        "wheels": [{"size": 2}],
        "numbers": [1.0, float("inf")],
        "few": [1, 2],
        "hub": {"size": 7},
        "all": [{"size": 2}],
    }


def test_paths_lead_to_nested_fields(types, tmp_path, capsys):
    old, _ = types
    new = idlc.load(write_package(tmp_path / "new", {**OLD, "Wheel": "uint8 size\n"}))
    assert upgraded(old.Wheel, new.Wheel, "def size(old): return old.size - 2\n") == 1
    assert "`/drive` at 10 ns: wheel.size: must be an integer" in capsys.readouterr().err
    assert upgraded(old.Wheel, new.Wheel, "def size(old): return 1 // (old.size - 2)\n") == 1
    assert "`/drive` at 10 ns: wheel.size: must be an integer" in capsys.readouterr().err
    assert upgraded(old.Wheel, new.Wheel, "def size(old): return 7 // (2 - old.size)\n") == 1
    assert "wheels[].size: the rule raised ZeroDivisionError" in capsys.readouterr().err


def test_the_text_of_rules_is_run_and_no_cached_bytecode(types, tmp_path, monkeypatch, capsys):
    """A file can change within the second and the size by which Python knows its bytecode."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    old, new = types
    pair = PAIR.format(key_of(old.Drive), key_of(new.Drive))
    words = ["upgrade", "a.mcap", "--to", "new/drive_msgs", "--rules", "rules.py", "-o", "out"]
    for number in "12":
        Path("rules.py").write_text(f"{pair}def few(old): return ['{number}']\n", encoding="utf-8")
        os.utime("rules.py", (10**9, 10**9))
        assert main(words) == 1
        assert f"not '{number}'" in capsys.readouterr().err
    assert not (tmp_path / "__pycache__").exists()


def test_rules_that_end_the_process_are_an_error(types, tmp_path, capsys):
    old, new = types
    assert upgraded(old.Drive, new.Drive, "def few(old): return []", "raise SystemExit(0)") == 1
    assert "rules.py cannot be run: SystemExit: 0" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["SIGINT", "SIGKILL"])
def test_a_run_that_ends_early_leaves_the_source(types, tmp_path, name):
    old, new = types
    kill = f"def few(old): import os, signal; os.kill(os.getpid(), signal.{name})\n"
    text = PAIR.format(key_of(old.Drive), key_of(new.Drive)) + kill
    (tmp_path / "rules.py").write_text(text, encoding="utf-8")
    before = (tmp_path / "a.mcap").read_bytes()
    words = ["a.mcap", "--to", "new/drive_msgs", "--rules", "rules.py", "-o", "out"]
    command = [sys.executable, "-m", "idlc", "upgrade", *words]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=env, check=False, capture_output=True, text=True)
    assert done.returncode in (-getattr(signal, name), 130), done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "a.mcap").read_bytes() == before
    assert not (tmp_path / "out" / "a.mcap").exists()
    if name == "SIGINT":
        assert not (tmp_path / "out").exists()


@pytest.mark.rounds
def test_hostile_recordings_end_in_an_error(tmp_path, monkeypatch, capsys):
    """The new type of /imu has another field, so that messages are converted."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "sensor_msgs" / "msg"
    folder.mkdir(parents=True)
    text = "std_msgs/Header header\nfloat64[9] orientation_covariance\nint8 added 5\n"
    (folder / "Imu.msg").write_text(text, encoding="utf-8")
    rng, outcomes = random.Random(SEED), set()
    (tmp_path / "sound").mkdir()
    sound = sources(tmp_path / "sound")
    sound += 4 * sound[-1:]
    source, out = tmp_path / "hostile", tmp_path / "out"
    for number in range(rounds(150)):
        data = sound[number % len(sound)]
        if number % 2:
            source.write_bytes(mutated(data, rng))
        elif data.startswith(mcap_mutations.MAGIC):
            source.write_bytes(mcap_mutations.mutated(data, rng))
        else:
            source.write_bytes(db3_mutations.mutated(data, rng, tmp_path / "work"))
        before = source.read_bytes()
        status = main(["upgrade", "hostile", "--to", "sensor_msgs", "-o", "out"])
        output = capsys.readouterr()
        assert status in (0, 1, 2), output.err
        assert "IDL901" not in output.err
        assert source.read_bytes() == before
        left = [path.name for path in out.rglob("*")] if out.exists() else []
        if status == 1 and "IDL656" in output.err:  # the intact part, if there is one
            assert left in ([], ["hostile"]), output.err
        else:
            assert left == (["hostile"] if status == 0 else []), output.err
        shutil.rmtree(out, ignore_errors=True)
        outcomes.add((status, bool(left)))
    assert {(1, False), (1, True)} <= outcomes
