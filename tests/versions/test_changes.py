"""`idlc breaking`: what it compares with, and how changes are told apart."""

import json
import subprocess
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.versions.packages import Comparison, compare, part_to_raise, raised
from tests.support.evolution import Evolution, compile_texts
from tests.support.files import write
from tests.support.tools import tool


def found(old, new):
    """Codes, subjects without package and levels of what changed in A.msg (and B and C)."""
    texts = [side if isinstance(side, dict) else {"A": side} for side in (old, new)]
    changes = compare(*(compile_texts({"B": "", "C": "", **text}) for text in texts)).changes
    return {
        (change.code.id, change.subject.removeprefix("p/msg/"), " ".join(sorted(change.levels)))
        for change in changes
    }


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("int8 a\n", "int8 a\n", set()),
        ("int8 a\n", "# c\n\nint8   a  # x\n", set()),
        # what stands at the end is not missed by whoever reads old bytes
        ("int8 a\nint8 b\n", "int8 a\n", {("IDL503", "A.b", "hash source")}),
        ("int8 a\n", "", {("IDL503", "A.a", "hash source")}),
        ("", "int8 a\n", {("IDL505", "A.a", "hash")}),
        ("", "int16 a\n", {("IDL505", "A.a", "hash wire")}),
        # two changes that make up for each other
        (
            "int32 a\nint32 b\n",
            "int32 c\nint32 b\n",
            {("IDL504", "A.a", "hash source")},
        ),
        ("B b\n", "C b\n", {("IDL507", "A.b", "hash source")}),
        ("char a\n", "uint8 a\n", set()),
        ("byte a\n", "uint8 a\n", {("IDL507", "A.a", "hash source")}),
        ("bool a\n", "uint8 a\n", {("IDL507", "A.a", "hash source")}),
        ("uint8 a\n", "bool a\n", {("IDL507", "A.a", "hash source wire")}),
        ("string<=9 a\n", "string a\n", {("IDL508", "A.a", "hash")}),
        ("string a\n", "string<=9 a\n", {("IDL508", "A.a", "behaviour hash")}),
        ("int8[] a\n", "int8[<=9] a\n", {("IDL508", "A.a", "hash source wire")}),
        ("int8[<=3] a\n", "int8[<=9] a\n", {("IDL508", "A.a", "hash source")}),
        ("int8[3] a\n", "int8[2] a\n", {("IDL508", "A.a", "hash source")}),
        ("int8[3] a\nint8 b\n", "int8[2] a\nint8 b\n", {("IDL508", "A.a", "hash source wire")}),
        ("int8[3] a\n", "int8[<=3] a\n", {("IDL507", "A.a", "hash source wire")}),
        ("int8 a 1\n", "int8 a\n", {("IDL509", "A.a", "behaviour source")}),
        ("int8 a\n", "int8 a 1\n", {("IDL509", "A.a", "behaviour")}),
        ("int8 A=1\n", "int8 B=1\n", {("IDL511", "A.A", "source")}),
        ("int8 A=1\n", "int8 B=2\n", {("IDL510", "A.A", "source")}),
        ("char A=1\n", "uint8 A=1\n", set()),
        ("float64 A=1\n", "float64 A=1.0\n", set()),
        ("bool A=1\n", "bool A=true\n", set()),
        ("int8 A=1\nint8 B=2\n", "int8 B=2\nint8 A=1\n", set()),
        (
            {"A": "B b\nint8 c\n", "B": "int8 x\nint8 y\n"},
            {"A": "B b\nint8 c\n", "B": "int8 x\n"},
            {("IDL503", "B.y", "hash source"), ("IDL515", "A.b", "hash wire")},
        ),
        # what rosidl puts into an empty structure itself
        ("", "uint8 structure_needs_at_least_one_member\n", set()),
        (
            "uint8 structure_needs_at_least_one_member\n",
            "",
            {("IDL503", "A.structure_needs_at_least_one_member", "source")},
        ),
        # removed from the padding before a larger value: nothing moves
        ("int8 a\nint8 b\nint32 c\n", "int8 a\nint32 c\n", {("IDL503", "A.b", "hash source")}),
    ],
)
def test_each_change_has_its_code_and_says_what_it_breaks(old, new, expected):
    assert found(old, new) == expected


def test_several_fields_removed_in_one_place_are_several_findings(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write("old/msg/A.msg", "int8 a\nint8 b\nint8 c\n")
    write("new/msg/A.msg", "int8 c\n")
    assert main(["breaking", "new", "--against", "old"]) == 1
    assert capsys.readouterr().out.count("error[IDL503]") == 2


def test_large_arrays_take_no_longer_than_small_ones():
    old, new = ("B[1000000] b\nuint8[16000000] c\n", "B[1000000] b\nuint8[16000000] d\n")
    texts = {"B": "int8 a\nint32 b\n"}
    expected = {("IDL504", "A.c", "hash source")}
    assert found({**texts, "A": old}, {**texts, "A": new}) == expected
    texts["C"] = "B[5000000] b\n"
    broken = {**texts, "B": "int32 a\nint8 b\n"}
    assert ("IDL515", "C.b", "hash wire") in found(texts, broken)


@pytest.mark.parametrize(
    ("version", "part", "expected"),
    [
        ("1.2.3", "major", "2.0.0"),
        ("1.2.3", "minor", "1.3.0"),
        ("1.2.3", "patch", "1.2.4"),
        ("0.2.3", "major", "0.3.0"),
        ("0.2.3", "minor", "0.3.0"),
        ("1.2", "major", None),
    ],
)
def test_the_next_version_raises_the_part_that_is_asked_for(version, part, expected):
    assert raised(version, part) == expected


def test_the_part_to_raise_follows_from_what_changed():
    assert part_to_raise(Comparison(())) is None
    assert part_to_raise(Comparison((), (), differs=True)) == "patch"
    assert part_to_raise(Comparison((), ("message `a/msg/B`",), differs=True)) == "minor"


@pytest.mark.parametrize("seed", range(60))
def test_the_hash_is_said_to_change_exactly_when_it_does(seed):
    history = Evolution(seed)
    before = compile_texts(history.texts())
    for _ in range(2):
        history.edit()
    after = compile_texts(history.texts())
    changes = compare(before, after).changes
    for name in "ABC":
        full = f"p/msg/{name}"
        said = any(c.subject.startswith(full) and "hash" in c.levels for c in changes)
        assert said == (before.describer.hash(full) != after.describer.hash(full)), name


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "int8 a\n",
            "int8 a\r\n",
            "no breaking changes; compared 1 interface; the versions are the same",
        ),
        (
            "int8 a\n",
            "int8  a\n",
            "no breaking changes; compared 1 interface; raise the patch version",
        ),
        (
            "int8 a\n",
            "int8 a\n\n# the end",
            "no breaking changes; compared 1 interface; raise the patch version",
        ),
        (
            "int8 a\n",
            "int8 a  # [m]\n",
            "no breaking changes; compared 1 interface; raise the patch version",
        ),
        (
            "int8 a\n",
            "int8 B=1\nint8 a\n",
            (
                "no breaking changes; compared 1 interface; added: constant `demo/msg/A.B`; "
                "raise the minor version"
            ),
        ),
    ],
)
def test_only_equal_versions_are_called_the_same(old, new, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write("old/demo/msg/A.msg", old)
    write("new/demo/msg/A.msg", new)
    assert main(["breaking", "new/demo", "--against", "old/demo"]) == 0
    assert capsys.readouterr().out == f"{said}\n"


def test_a_lock_of_other_texts_is_not_the_same(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write("demo/package.xml", "<package><name>demo</name></package>")
    write("demo/msg/A.msg", "int8 a\n")
    assert main(["gen", "demo", "-o", "out/demo"]) == 0
    capsys.readouterr()
    assert main(["breaking", "demo", "--against", "out/demo/idlc.lock"]) == 0
    assert (
        capsys.readouterr().out
        == "no breaking changes; compared 1 interface; the versions are the same\n"
    )
    write("demo/msg/A.msg", "int8 a 3\n")
    assert main(["breaking", "demo", "--against", "out/demo/idlc.lock"]) == 0
    assert (
        capsys.readouterr().out
        == "no breaking changes; compared 1 interface; raise the patch version\n"
    )
    Path("demo/msg/A.msg").unlink()
    assert main(["breaking", "demo", "--against", "out/demo/idlc.lock"]) == 1
    assert "error[IDL501]" in capsys.readouterr().out


def git(*words):
    who = ["-c", "user.name=me", "-c", "user.email=me@example.org"]
    command = [tool("git"), *who, *words]
    return subprocess.run(command, check=True, capture_output=True).stdout


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """Two packages in a workspace, the second using the first, both committed and tagged."""
    monkeypatch.chdir(tmp_path)
    write("src/base/package.xml", "<package><name>base</name><version>0.3.0</version></package>")
    write("src/base/msg/Base.msg", "int32 x\n")
    write("src/top/package.xml", "<package><name>top</name></package>")
    write("src/top/msg/Top.msg", "base/Base base\nNear near\n")
    write("src/top/msg/Near.msg", "int32 x\n")
    git("init", "-q", "-b", "main")
    git("add", ".")
    git("commit", "-q", "-m", "first")
    git("tag", "v1")
    return tmp_path


def run(capsys, *words):
    status = main(["breaking", *words, "--format", "json"])
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    return status, [(line["code"], line["path"]) for line in lines if "code" in line]


@pytest.mark.usefixtures("repository")
def test_a_git_revision_is_compared_and_nothing_in_the_repository_touched(capsys):
    assert run(capsys, "src", "--against", "git:v1") == (0, [])
    assert git("status", "--short") == b""
    write("src/base/msg/Base.msg", "int64 x\n")
    expected = [("IDL507", "src/base/msg/Base.msg"), ("IDL515", "src/top/msg/Top.msg")]
    assert run(capsys, "src", "--against", "git:HEAD") == (1, expected)
    assert run(capsys, "src/base", "--against", "git:HEAD") == (1, expected[:1])


@pytest.mark.usefixtures("repository")
def test_a_package_that_the_revision_does_not_have_is_new(capsys):
    write("src/young/msg/A.msg", "int32 x\n")
    assert run(capsys, "src/young", "--against", "git:v1") == (0, [])


def test_what_was_removed_is_found_in_the_revision(repository, capsys):
    (repository / "src/top/msg/Top.msg").unlink()
    assert run(capsys, "src", "--against", "git:v1") == (
        1,
        [("IDL501", "git:v1:src/top/msg/Top.msg")],
    )


@pytest.mark.usefixtures("repository")
@pytest.mark.parametrize("name", ["nothing", "-h", "--output=x", "v1:src", ""])
def test_a_revision_that_there_is_not(capsys, name):
    assert run(capsys, "src", "--against", f"git:{name}") == (2, [("IDL630", "src")])


@pytest.mark.usefixtures("repository")
def test_what_is_gone_altogether_was_removed(capsys):
    Path("src/base/msg/Base.msg").unlink()
    expected = (1, [("IDL501", "git:v1:src/base/msg/Base.msg")])
    assert run(capsys, "src/base", "--against", "git:v1") == expected


@pytest.mark.usefixtures("repository")
def test_a_revision_without_its_mark_is_recognised(capsys):
    assert main(["breaking", "src", "--against", "HEAD"]) == 2
    assert "hint: for the git revision, use `--against git:HEAD`" in capsys.readouterr().out
    assert main(["breaking", "src", "--against", "HEAD~9"]) == 2
    assert "git:" not in capsys.readouterr().out


@pytest.mark.usefixtures("repository")
def test_excluded_files_are_so_in_both_versions(capsys):
    write("src/base/msg/Base.msg", "int64 x\n")
    write("pyproject.toml", "[tool.idlc]\nexclude = ['src/base/msg/B*.msg', 'top']\n")
    write("src/base/msg/Other.msg", "int64 x\n")
    assert run(capsys, "src", "--against", "git:v1") == (0, [])
    Path("pyproject.toml").unlink()
    assert run(capsys, "src", "--against", "git:v1", "--exclude", "base/msg/B*")[0] == 1
    assert run(capsys, "src/base", "--against", "git:v1", "--exclude", "Base.msg")[0] == 0


@pytest.mark.usefixtures("repository")
def test_the_level_decides_what_counts(capsys):
    write("src/top/msg/Near.msg", "int32 y\n")
    write("pyproject.toml", '[tool.idlc.breaking]\nlevels = ["wire"]\n')
    assert run(capsys, "src", "--against", "git:v1") == (0, [])
    write("pyproject.toml", '[tool.idlc.breaking]\nlevels = ["source"]\n')
    assert run(capsys, "src", "--against", "git:v1") == (
        1,
        [("IDL504", "src/top/msg/Near.msg")],
    )
