"""An idlc.lock of unknown origin is used, or refused with IDL615, by every command."""

import json
import shutil
import string
from pathlib import Path

import pytest

from idlc.diagnostics.report import Report
from idlc.project import lock
from idlc.project.lock import load_lock
from tests.support.examples import example, given, settings, st
from tests.support.fuzzing import idlc

LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9)
JSON = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner),
    max_leaves=9,
)
#: Paths as they are written, and pieces that have a meaning somewhere.
PIECES = st.sampled_from(
    [
        "msg",
        "_idlc",
        "a.py",
        "__init__.py",
        "..",
        ".",
        "",
        "~",
        "C:",
        "\\",
        "\0",
        "\n",
        "é",
        "x" * 300,
    ]
) | st.text(max_size=4)
PATHS = st.lists(PIECES, max_size=12).map("/".join)
NAMES = st.sampled_from(["std_msgs/msg/Bool", "demo/msg/A", "a/b", "../msg/A"]) | PATHS
TEXTS = st.just("0" * 64) | st.text(max_size=3)
LOCKS = st.fixed_dictionaries(
    {
        "format": st.just(1) | st.integers(),
        "idlc": st.just("0.1.0") | st.text(max_size=5),
        "package": st.just("demo") | PATHS,
        "inputs": st.dictionaries(st.just("msg/A.msg") | PATHS, TEXTS, max_size=3),
        "dependencies": st.dictionaries(NAMES, TEXTS, max_size=3),
        "types": st.dictionaries(NAMES, TEXTS, max_size=3),
        "outputs": st.dictionaries(PATHS, TEXTS, max_size=3),
    },
    optional={
        "vendor_deps": st.booleans(),
        "vendored": st.lists(PATHS, max_size=3),
        "imports": st.lists(st.sampled_from(["std_msgs.msg", "a.b.c", "."]) | PATHS, max_size=3),
        "more": JSON,
    },
)
FULL = {"format": 1, "idlc": "0.1.0", "package": "demo", "inputs": {}, "dependencies": {}}
FULL |= {"types": {}, "outputs": {}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("lock")
    (place / ".git").mkdir()
    (place / "demo/msg").mkdir(parents=True)
    (place / "demo/msg/A.msg").write_text("int8 a\n", encoding="utf-8")
    return place


def attempt(folder: Path, data: bytes) -> None:
    """Every command that reads the lock ends in an answer, and only a sound one is taken."""
    out = folder / "out/demo"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    (out / lock.FILE).write_bytes(data)
    report = Report()
    known = load_lock(out, "demo", report)
    assert [one.code for one in report] == ([] if known else ["IDL615"])
    here = str(folder / "demo")
    checked = idlc("gen", here, "-o", str(out), "--check")
    assert known or checked == 2
    assert idlc("breaking", here, "--against", str(out / lock.FILE)) == 2 or known
    assert idlc("gen", here, "-o", str(out)) == (0 if known else 2)
    assert sorted(path.name for path in folder.iterdir()) == [".git", "demo", "out"]


def with_outputs(path: str) -> dict[str, object]:
    return {**FULL, "outputs": {path: "0" * 64}}


@settings(max_examples=60)
@given(LOCKS | JSON)
@example(with_outputs("msg/\0.py"))
@example(with_outputs("/".join(["a"] * 3000)))
@example(with_outputs("a" * 300))
@example({**FULL, "imports": ["a.b.c"]})
@example({**FULL, "imports": ["std_msgs"]})
@example({**FULL, "vendored": ["../x"]})
def test_any_json_is_used_or_refused(folder, content):
    attempt(folder, json.dumps(content).encode())


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"{",
        b"[" * 100_000,
        b'{"format":1,"idlc":"","x":' + b"[" * 100_000,
        b'{"format":1,"idlc":"' + b"9" * 5000 + b'"}',
        b'{"format":' + b"9" * 5000 + b',"idlc":""}',
        b'{"format":1,"idlc":"\\ud800"}',
        b"\xff\xfe",
    ],
)
def test_other_bytes_are_refused(folder, data):
    attempt(folder, data)


@given(st.lists(st.text(string.ascii_letters + "_-.", min_size=1, max_size=9), min_size=1))
def test_paths_that_may_be_ones_own_stay_below_their_folder(parts):
    path = "/".join(parts)
    if lock.may_be_own(path):
        assert not {"", ".", ".."} & set(parts)
        assert Path("/x", path).is_relative_to("/x")
