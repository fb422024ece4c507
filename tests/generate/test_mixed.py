"""A package whose files are of two runs of `idlc gen` raises ImportError and loses no value."""

import itertools
import shutil
import subprocess
import sys

import pytest

from idlc.cli.main import main
from tests.support.files import write_all
from tests.support.generated import catalog_files, write_package
from tests.support.rounds import ALL

MORE = ("int8 a\n", "int8 a\nint16 x\n")
#: A message before and after a change.
CHANGES = {
    "one more field": MORE,
    "one field less": MORE[::-1],
    "another type": ("int8 a\n", "int16 a\n"),
    "another order": ("int8 a\nint8 x\n", "int8 x\nint8 a\n"),
}

#: For each folder, prints for each class and each way what comes of a message.
PROGRAM = """
import os, sys
import numpy

def one():
    from demo.msg import A
    fields = A.get_fields_and_field_types()
    return A(**{name: at for at, name in enumerate(fields, 1)})

def nested():
    from demo.msg import B
    return B(a=one(), many=[one(), one()], s="text")

def goal():
    from demo.action import Go
    return Go.Goal(goal=one())

def request():
    from demo.action import Go
    return Go.Impl.SendGoalService.Request(goal=goal())

def little(message):
    return type(message).deserialize(message.serialize())

def big(message):
    return type(message).deserialize(message.serialize(byteorder="big"))

def listed(message):
    return type(message).from_dict(message.to_dict())

def careful(message):
    # a text that does not end, which only the careful reader takes
    raw = message.serialize().replace(b"text\\0", b"text!")
    again = type(message).deserialize(raw)
    if hasattr(again, "s"):
        again.s = message.s
    return again

for folder in sys.argv[2:]:
    if os.fork():
        assert os.wait()[1] == 0
        continue
    sys.path[:0] = [folder, sys.argv[1]]
    for make in (one, nested, goal, request):
        for way in (little, big, listed, careful):
            try:
                message = make()
                outcome = "whole" if repr(way(message)) == repr(message) else "lost"
            except (ImportError, AttributeError) as error:
                assert "run `idlc gen` again" in str(error), error
                outcome = "refused"
            print(folder, outcome, make.__name__, way.__name__, flush=True)
    os._exit(0)
"""


@pytest.mark.rounds
@pytest.mark.parametrize("change", CHANGES)
def test_no_mixed_package_loses_a_value(change, tmp_path):
    for version, text in zip(("old", "new"), CHANGES[change], strict=True):
        nested = {
            "msg/B.msg": "A a\nA[] many\nstring s\n",
            "action/Go.action": "A goal\n---\n---\n",
        }
        write_package(tmp_path / version, "demo", {"msg/A.msg": text, **nested})
    for package in ("builtin_interfaces", "service_msgs", "unique_identifier_msgs"):
        write_package(tmp_path / "others", package, catalog_files()[package])
    old, new = tmp_path / "old", tmp_path / "new"
    changed = [
        path.relative_to(new)
        for path in new.rglob("*.py")
        if path.read_bytes() != (old / path.relative_to(new)).read_bytes()
    ]
    assert len(changed) == 5
    mixtures = {}
    for number in range(len(changed) + 1) if ALL else (0, 1, 4, 5):
        for paths in itertools.combinations(changed, number):
            folder = str(tmp_path / f"{len(mixtures)}")
            mixtures[folder] = paths
            shutil.copytree(old, folder)
            for path in paths:
                shutil.copy(new / path, f"{folder}/{path}")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path / "others"), *mixtures],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    outcomes = {folder: set() for folder in mixtures}
    for line in done.stdout.splitlines():
        folder, outcome, *_ = line.split()
        outcomes[folder].add(outcome)
    for folder, paths in mixtures.items():
        assert "lost" not in outcomes[folder], paths
        assert ("refused" in outcomes[folder]) == (len(paths) not in (0, 5)), paths


#: Changes of a type that another package uses, directly or through a type between.
FOREIGN = {
    "direct": "far/Deep d\n",
    "nested": "near/Pos d\n",
    "many": "far/Deep[] d\n",
}


@pytest.mark.parametrize("way", FOREIGN)
@pytest.mark.parametrize("change", CHANGES)
def test_a_package_that_was_not_compiled_again_loses_no_value(way, change, tmp_path):
    """Another package, which it uses, was."""
    before, after = CHANGES[change]
    write_all(
        {
            f"{tmp_path}/src/far/msg/Deep.msg": before,
            f"{tmp_path}/src/near/msg/Pos.msg": "far/Deep x\n",
            f"{tmp_path}/src/user/msg/Track.msg": FOREIGN[way],
        }
    )
    sources, out = tmp_path / "src", tmp_path / "out"
    for package in ("far", "near", "user"):
        assert (
            main(["gen", f"{sources / package}", "-o", f"{out / package}", "-I", f"{sources}"]) == 0
        )
    write_all({f"{sources}/far/msg/Deep.msg": after})
    assert main(["gen", f"{sources / 'far'}", "-o", f"{out / 'far'}"]) == 0
    program = (
        "from user.msg import Track\n"
        "for use in (lambda: Track().serialize(), lambda: Track.deserialize(bytes(64)),\n"
        "            lambda: Track().to_dict(), lambda: Track.from_dict({})):\n"
        "    try:\n"
        "        use()\n"
        "    except ImportError as error:\n"
        "        assert 'far.msg.Deep has other fields' in str(error), error\n"
        "    else:\n"
        "        raise SystemExit(1)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=out, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
