"""`idlc breaking` as a gate: it passes only if it compared everything that the old version has."""

import shutil
from pathlib import Path
from typing import NamedTuple

import pytest

from idlc.cli.main import main
from tests.support import recorded_text
from tests.support.files import write, write_all
from tests.support.repositories import git

ALLOWED = """
[[tool.idlc.breaking.allow]]
at = "reef_msgs/msg/R*"
reason = "the first version has errors"
until = 2999-12-31
"""
ENDED = ALLOWED.replace("2999", "2001")
#: What is said of a package that moved, of a part of it, and of a file.
WIRE = "1 breaking change (1 wire, 1 hash, 1 source)"


def package(folder, name, **interfaces):
    """Return the files of a package, with messages by name."""
    manifest = f"<package format='3'><name>{name}</name></package>"
    files = {f"{folder}/msg/{each}.msg": f"{text}\n" for each, text in interfaces.items()}
    return {f"{folder}/package.xml": manifest, **files}


class Gate(NamedTuple):
    """Two versions, the words of the command, its status, and a part of its last line."""

    old: dict[str, str]
    new: dict[str, str]
    words: str
    status: int
    last: str


OLD, NEW = (
    package("old/reef", "reef_msgs", Reef="float32 a"),
    package("src/r", "reef_msgs", Reef="float64 a"),
)
SAME = package("src/r", "reef_msgs", Reef="float32 a")
LESS = package("src/r", "reef_msgs", Sand="int8 a")
BROKEN = package("src/r", "reef_msgs", Reef="flot32 a")
PIER = package("src/pier", "pier_msgs", Pier="float32 a")
PORT = package("src/port", "port_msgs", Port="pier_msgs/Pier[] piers")
WIDE = package("src/pier", "pier_msgs", Pier="float64 a")
TWICE = {**OLD, **package("legacy/reef", "reef_msgs", Reef="float32 a")}
REPOSITORIES = {
    "the same": Gate(SAME, SAME, "src/r", 0, "compared 1 interface; the versions are the same"),
    "moved": Gate(OLD, NEW, "src", 1, f"{WIRE}: "),
    "moved, and the same": Gate(OLD, SAME, "src/r", 0, "compared 1 interface; the versions are"),
    "moved, a file": Gate(OLD, NEW, "src/r/msg/Reef.msg", 1, WIRE),
    "moved, a folder of it": Gate(OLD, NEW, "src/r/msg", 1, WIRE),
    "moved, and removed": Gate(OLD, LESS, "src/r", 1, WIRE),
    "moved, and removed from a folder of it": Gate(OLD, LESS, "src/r/msg", 1, WIRE),
    "moved within": Gate(
        SAME,
        {**package("src/r", "reef_msgs"), "src/r/b/msg/Reef.msg": "int8 a\n"},
        "src/r/b",
        1,
        WIRE,
    ),
    "moved away": Gate(SAME, {**OLD, **PIER}, "src", 1, "compared 1 interface; added: "),
    "moved, one of two": Gate(TWICE, {**TWICE, **NEW}, "src", 1, "1 not compared; compared 0"),
    "moved, the one of two that is gone": Gate(
        TWICE, {**package("legacy/reef", "reef_msgs", Reef="float32 a"), **NEW}, "src", 1, WIRE
    ),
    "renamed": Gate(SAME, package("src/r", "sand_msgs", Reef="float32 a"), "src", 1, "added: "),
    "new": Gate(PIER, SAME, "src/r", 0, "no breaking changes; compared 0 interfaces; added: "),
    "of another folder name": Gate(
        package("old/reef_msgs", "reef_msgs", Reef="int8 a"),
        package("reefs", "reef_msgs", Reef="int16 a"),
        "reefs",
        1,
        WIRE,
    ),
    "broken": Gate(BROKEN, NEW, "src", 1, "1 not compared; compared 0 interfaces"),
    "broken, and allowed": Gate(
        BROKEN, {**NEW, "pyproject.toml": ALLOWED}, "src", 0, "1 allowed; compared 0 interfaces"
    ),
    "broken, and no longer allowed": Gate(
        BROKEN, {**NEW, "pyproject.toml": ENDED}, "src", 1, "1 not compared; "
    ),
    "broken now": Gate(SAME, BROKEN, "src", 1, "1 not compared; "),
    "all removed": Gate(SAME, PIER, "src/r", 2, ""),
    "a dependency changed": Gate(
        {**PIER, **PORT}, {**WIDE, **PORT}, "src/port -I src", 1, "1 wire"
    ),
    "a dependency moved": Gate(
        {**package("common/pier", "pier_msgs", Pier="float32 a"), **PORT},
        {**WIDE, **PORT},
        "src/port -I src/pier",
        1,
        "1 wire",
    ),
}


def run(capsys, gate, against):
    """Return the status of a comparison, and the last line."""
    status = main(["breaking", *gate.words.split(), "--against", against])
    said = capsys.readouterr()
    return status, (said.out.splitlines() or [said.err])[-1]


@pytest.mark.parametrize("name", REPOSITORIES)
def test_with_a_revision(name, here, capsys):
    gate = REPOSITORIES[name]
    git("init", "-q", cwd=here)
    write_all(gate.old)
    git("add", ".", cwd=here)
    git("commit", "-qm", "old", cwd=here)
    for path in here.iterdir():
        shutil.rmtree(path) if path.name != ".git" else None
    write_all(gate.new)
    status, last = run(capsys, gate, "git:HEAD")
    assert (status, gate.last in last) == (gate.status, True), last


def test_outside_of_a_repository_a_version_has_to_be_named(here, capsys):
    write_all(SAME)
    assert main(["breaking"]) == 2
    shown = capsys.readouterr().err
    assert "missing option `--against`: this folder is in no git repository" in shown


@pytest.mark.parametrize("settings", ["", "[tool.idlc]\npaths = ['src']\n"])
def test_in_a_repository_without_a_version_to_compare_with(settings, here, capsys):
    """The last commit is compared with, of the remote repository if there is one."""
    write_all({**SAME, "pyproject.toml": settings})
    git("init", "-q", "-b", "main")
    assert main(["breaking"]) == 2
    shown = capsys.readouterr().err
    assert "nothing to compare with: the git repository has no commits" in shown
    assert "commit the current version" in shown
    git("add", ".")
    git("commit", "-qm", "one")
    write_all(NEW)
    assert main(["breaking"]) == 1
    shown = capsys.readouterr()
    assert WIRE in shown.out
    assert shown.err == "note: idlc compares with `git:HEAD`\n"
    git("update-ref", "refs/remotes/origin/HEAD", "HEAD")
    git("add", ".")
    git("commit", "-qm", "two")
    assert main(["breaking"]) == 1
    assert "git:origin/HEAD" in capsys.readouterr().err


def test_in_a_clone_without_the_history(here, capsys):
    git("init", "-q", "-b", "main", "up", cwd=here)
    for files in (OLD, NEW):
        write_all({f"up/{path}": text for path, text in files.items()})
        git("add", ".", cwd=here / "up")
        git("commit", "-qm", "more", cwd=here / "up")
    git("clone", "-q", "--depth=1", (here / "up").as_uri(), "clone", cwd=here)
    gate = Gate(OLD, NEW, "clone/src", 2, "")
    assert run(capsys, gate, "git:HEAD~1")[0] == 2
    shutil.rmtree("clone/old")
    assert run(capsys, gate, "git:HEAD") == (0, run(capsys, gate, "git:HEAD")[1])


FOLDERS = {
    "the same": Gate(SAME, SAME, "new/src --against old/src", 0, "the versions are the same"),
    "in other folders": Gate(OLD, NEW, "new --against old", 1, WIRE),
    "a package": Gate(OLD, NEW, "new/src/r --against old/old", 1, WIRE),
    "nothing there": Gate({"src/readme": ""}, SAME, "new/src --against old/src", 2, ""),
    "no such folder": Gate(SAME, SAME, "new/src --against old/srv", 2, ""),
    "of another name": Gate(
        SAME, package("src/r", "sand_msgs", Reef="float32 a"), "new --against old", 1, ""
    ),
    "broken": Gate(BROKEN, SAME, "new --against old", 1, "1 not compared; "),
    "with a dependency": Gate(
        {**PIER, **PORT},
        {**WIDE, **PORT},
        "new/src/port --against old/src/port -I new",
        1,
        "1 wire",
    ),
    "with both dependencies": Gate(
        {**PIER, **PORT},
        {**WIDE, **PORT},
        "new/src/port --against old/src/port -I new -I old",
        1,
        "1 wire",
    ),
    "with both dependencies, the old one first": Gate(
        {**PIER, **PORT},
        {**WIDE, **PORT},
        "new/src/port --against old/src/port -I old/src -I new/src/pier",
        1,
        "1 wire",
    ),
    "with a dependency that is beside the old one only": Gate(
        {**PIER, **PORT},
        {**package("deps/p", "pier_msgs", Pier="float64 a"), **PORT},
        "new/src/port --against old/src/port -I new/deps",
        1,
        "1 wire",
    ),
}


@pytest.mark.parametrize("name", FOLDERS)
def test_with_a_folder(name, here, capsys):
    gate = FOLDERS[name]
    write_all({f"old/{path}": text for path, text in gate.old.items()})
    write_all({f"new/{path}": text for path, text in gate.new.items()})
    *words, _, against = gate.words.partition(" -I")[0].split()
    include = gate.words.removeprefix(" ".join([*words, _, against]))
    status, last = run(capsys, gate._replace(words=" ".join(words) + include), against)
    assert (status, gate.last in last) == (gate.status, True), last


REEF = "@ /reef reef_msgs/msg/Reef\nfloat32 a\n"
WIDER = REEF.replace("32", "64")
OTHER = "@ /sand sand_msgs/msg/Sand\nint8 a\n"
UNDEFINED = '@ /reef reef_msgs/msg/Reef ""\n'
RECORDINGS = {
    "the same": Gate({"a": REEF}, SAME, "src", 0, "compared 1 interface, 1 recording"),
    "changed": Gate({"a": REEF}, NEW, "src", 1, WIRE),
    "of other types": Gate({"a": OTHER}, NEW, "src", 2, "compared 0 interfaces"),
    "some of other types": Gate({"a": REEF + OTHER}, SAME, "src", 0, "compared 1 interface"),
    "in the wrong folder": Gate({"a": REEF}, {}, "", 2, "1 not compared; compared 0 interfaces"),
    "some types are not here": Gate(
        {"a": "@ /s std_msgs/msg/String\nstring data\n" + REEF}, {}, "", 1, "1 not compared; no"
    ),
    "a type is not defined": Gate(
        {"a": OTHER + "@ /reef reef_msgs/msg/Reef\n"}, SAME, "src", 2, "1 not compared; "
    ),
    "two": Gate({"a": REEF}, {"b": WIDER}, "b.mcap", 1, WIRE),
    "two that are the same": Gate({"a": REEF}, {"b": REEF}, "b.mcap", 0, "1 interface, 2 rec"),
    "two without a common type": Gate({"a": REEF}, {"b": OTHER}, "b.mcap", 2, "1 not compared; "),
    "two, and one lacks a type": Gate(
        {"a": REEF + OTHER}, {"b": OTHER}, "b.mcap", 1, "1 not compared; no breaking changes in"
    ),
    "two, and one has more": Gate({"a": OTHER}, {"b": OTHER + REEF}, "b.mcap", 0, "no breaking"),
    "three": Gate({"a": REEF}, {"b": REEF, "c": WIDER}, "b.mcap c.mcap", 1, WIRE),
    "two, and interfaces": Gate({"a": REEF, "b": WIDER}, SAME, "src b.mcap", 1, WIRE),
}


@pytest.mark.parametrize("name", RECORDINGS)
def test_with_recordings(name, here, capsys):
    gate = RECORDINGS[name]
    for path, text in {**gate.old, **gate.new}.items():
        if text.startswith("@"):
            recorded_text.write(f"{path}.mcap", text)
        else:
            write(path, text)
    status, last = run(capsys, gate, "a.mcap")
    assert (status, gate.last in last) == (gate.status, True), last


def test_with_a_lock_and_a_distribution(here, capsys):
    write_all({**SAME, **PIER})
    assert main(["gen", "src/r", "-o", "out/reef_msgs"]) == 0
    capsys.readouterr()
    gate = Gate({}, {}, "src", 0, "")
    status, last = run(capsys, gate, "out/reef_msgs/idlc.lock")
    assert (status, "compared 1 interface; added: message `pier_msgs/msg/Pier`" in last) == (
        0,
        True,
    )
    assert main(["breaking", "src", "--against", "distro:humble"]) == 2
    assert "error[IDL521]: idlc compared nothing: " in capsys.readouterr().out
    write("src/r/msg/Reef.msg", "std_msgs/Header header\n")
    assert run(capsys, gate, "out/reef_msgs/idlc.lock")[0] == 1
    assert run(capsys, gate, "distro:humble")[0] == 0
    Path("src/r/package.xml").unlink()
    Path("src/r/msg/Reef.msg").unlink()
    assert run(capsys, gate, "out/reef_msgs/idlc.lock")[0] == 1
