"""What classes make of None and of sequences, for each distribution that does it in its own way.

`golden/rosidl/conversions.json` has what rosidl's own classes do, by kinds of fields: Jazzy's are
asked again where it is installed; Lyrical's were made by rosidl_generator_py 0.27.2.
"""

import json
import shutil
import subprocess
import sys

import pytest

from idlc.project.prefixes import distribution
from tests.support.installed import generate
from tests.support.paths import EVERY_KIND, GOLDEN, PROGRAMS

TABLE = json.loads((GOLDEN / "rosidl" / "conversions.json").read_text("utf-8"))
NAMES = [f"every_kind/msg/{one}" for one in ("Scalars", "Arrays", "Sequences", "BoundedSequences")]


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Return a folder with messages that rosidl's Python classes can be made of."""
    folder = tmp_path_factory.mktemp("source")
    shutil.copytree(EVERY_KIND / "msg", folder / "msg")
    (folder / "msg" / "Keywords.msg").unlink()
    return folder


def outcomes(folder, environment):
    """Return the outcomes of classes in a folder: field, kind of field, operation, outcome."""
    command = [sys.executable, str(PROGRAMS / "conversions_side.py"), *NAMES]
    done = subprocess.run(
        command,
        env={**environment, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    for line in done.stdout.splitlines():
        field, kind, found = json.loads(line)
        yield from ((field, kind, operation, outcome) for operation, outcome in found.items())


def test_rosidl_does_what_the_table_says(source, ros_environment, tmp_path):
    name = distribution().name
    if name not in TABLE:
        pytest.skip(f"nothing is recorded of ROS 2 {name}")
    command = [sys.executable, str(PROGRAMS / "rosidl_package.py"), source, tmp_path / "every_kind"]
    subprocess.run(list(map(str, command)), check=True, capture_output=True)
    found = {}
    for field, kind, operation, outcome in outcomes(tmp_path, ros_environment):
        said = outcome if isinstance(outcome, str) else outcome[0]
        assert found.setdefault(kind, {}).setdefault(operation, said) == said, field
    assert found == TABLE[name]


def is_known(kind, operation, expected, outcome):
    """Return whether docs/differences.md has the difference from what Jazzy's class does."""
    if operation == "keyword":  # unknown keywords
        return expected == "message" and "TypeError" in outcome
    if operation.startswith("None"):  # nothing is the default; wrong values
        is_default = kind.split()[0] != "one" or kind == "one message"
        return outcome in ("message", "list", "array", "ndarray") if is_default else True
    return operation.startswith("constructed") and "TypeError" in outcome  # wrong values


@pytest.mark.parametrize("name", TABLE)
def test_idlc_does_what_the_table_says(name, source, ros_environment, tmp_path):
    generate(source, tmp_path / "every_kind", "--distro", name)
    compared = 0
    for field, kind, operation, outcome in outcomes(tmp_path, ros_environment):
        expected = TABLE[name][kind][operation]
        agree = outcome == expected or (isinstance(outcome, list) and expected in outcome)
        known = name == "jazzy" and is_known(kind, operation, expected, outcome)
        assert agree or known, (field, operation, expected, outcome)
        compared += 1
    assert compared > 500
