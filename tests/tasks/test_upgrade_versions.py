"""Upgrades of recordings with several versions, without definitions, and to another recording."""

import json
import re
import struct

import pytest

import idlc
from idlc.cli.main import main
from tests.api.test_lengths import cdr, humble_range, write_db3
from tests.api.test_versions_together import P1, P2, SAME, body, new, old, same, write
from tests.support import programs
from tests.tasks.test_upgrade import write_package


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "2023.mcap", [(P1, 1, old(1)), (P1, 2, old(2))])
    write(tmp_path / "2024.mcap", [(P2, 3, new(3, 0.5)), (P2, 4, new(4, 1.5))])
    write(tmp_path / "both.mcap", [(P1, 1, old(1)), (P2, 2, new(2, 0.5)), (P1, 3, old(3))])
    return tmp_path


@pytest.mark.parametrize("first", ["2023.mcap", "both.mcap"])
def test_a_recording_is_upgraded_to_another(first, files, capsys):
    """Then both are read together, and a second run changes nothing."""
    assert main(["upgrade", first, "--to", "2024.mcap", "-o", "up"]) == 0
    assert main(["columns", f"up/{first}", "2024.mcap", "/t", "--format", "csv"]) == 0
    capsys.readouterr()
    assert main(["upgrade", f"up/{first}", "--to", "2024.mcap", "-o", "twice"]) == 0
    assert "no types changed" in capsys.readouterr().out
    tables = [idlc.Recording(f"{folder}/{first}")["/t"].to_columns() for folder in ("up", "twice")]
    assert tables[0]["w"].tolist() == tables[1]["w"].tolist()
    assert tables[0]["w"].tolist() == ([7.0, 7.0] if first == "2023.mcap" else [7.0, 0.5, 7.0])


@pytest.mark.parametrize("other", [*SAME][1:])
def test_definitions_of_one_type_are_upgraded_together(other, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "a.mcap", [(same("plain"), 1, body(1.0)), (same(other), 2, body(2.0))])
    texts = {"Out": SAME["plain"].partition("=")[0] + "uint8 more 4\n", "In": "float64 x\n"}
    write_package(tmp_path / "new", texts, "demo_msgs")
    assert main(["upgrade", "a.mcap", "--to", "new/demo_msgs", "-o", "up"]) == 0
    with idlc.Recording("up/a.mcap") as recording:
        columns = recording["/t"].to_columns()
    assert columns["a"]["x"].tolist() == [1.0, 2.0]
    assert columns["more"].tolist() == [4, 4]


def test_what_did_not_change_is_said(files, capsys):
    write_package(files / "other", {"X": "uint8 x\n"}, "other_msgs")
    write_package(files / "near", {"Near": "uint8 x\n"}, "demo_msgs")
    for target in ("other/other_msgs", "near/demo_msgs", "2023.mcap"):
        words = ["--to", target, "-o", target.partition("/")[0] + "_up"]
        assert main(["upgrade", "2023.mcap", *words, "--allow-loss"]) == 0
        captured = capsys.readouterr()
        has_note = "has none of the packages of `2023.mcap`, which are `demo_msgs`" in captured.err
        assert has_note == target.startswith("other")
        assert ("  no types changed\n" in captured.out) != target.startswith("near")


#: Texts of two types on one topic, and those of the target: one type changes, or both do.
TWO_TYPES = {
    "one": ("int32 v\n", "float64 v\n", "int32 v\n"),
    "both": ("int32 v\n", "float64 v\n", "int64 v\n"),
    "one of equal texts": ("float32 v\n", "float64 v\n", "float32 v\n"),
    "both of equal texts": ("float32 v\n", "float64 v\n", "float32 v\nuint8 more\n"),
}


@pytest.mark.parametrize("storage", ["mcap", "db3"])
@pytest.mark.parametrize("case", TWO_TYPES)
def test_each_type_of_a_topic_is_converted_by_itself(case, storage, tmp_path, monkeypatch, capsys):
    """The file has the definitions of both, or of none."""
    monkeypatch.chdir(tmp_path)
    text, new_a, new_b = TWO_TYPES[case]
    form = "<i" if "int32" in text else "<f"
    first = [cdr("<f", value) for value in (1, 2, 3)]
    second = [cdr(form, value) for value in (4, 5)]
    write_package(tmp_path / "old", {"A": "float32 v\n", "B": text}, "demo_msgs")
    write_package(tmp_path / "new", {"A": new_a, "B": new_b}, "demo_msgs")
    a, b = "demo_msgs/msg/A", "demo_msgs/msg/B"
    if storage == "mcap":
        rows = [((a, "float32 v\n"), at, data) for at, data in enumerate(first)]
        write(tmp_path / "r.mcap", [*rows, *(((b, text), 9, data) for data in second)])
    else:
        write_db3(tmp_path / "r.db3", [("/t", a, first), ("/t", b, second)])
    words = ["--from", "old/demo_msgs", "--to", "new/demo_msgs", "-o", "up"]
    assert main(["upgrade", f"r.{storage}", *words]) == 0
    lines = [f"  /t ({a}): 3 messages converted", f"  /t ({b}): 2 messages converted"]
    changed = lines if case.startswith("both") else lines[:1]
    assert capsys.readouterr().out.splitlines()[1:] == changed
    with idlc.Recording("up/r.mcap") as recording:
        assert recording.topic("/t", a).to_columns()["v"].tolist() == [1.0, 2.0, 3.0]
        assert recording.topic("/t", b).to_columns()["v"].tolist() == [4, 5]
        assert {topic.type: topic.schema.text for topic in recording.topics} == {a: new_a, b: new_b}
    main(["show", "up/r.mcap", "--format", "json"])
    facts = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    sizes = {each["type_name"]: each["size"] for each in facts if each["type"] == "topic"}
    assert sizes == {a: 36, b: 2 * (4 + sum(map(int, re.findall(r"\d+", new_b))) // 8)}


def test_a_database_of_humble_is_converted_once(tmp_path, monkeypatch, capsys):
    """What is not converted gets its definition, too; the second run changes nothing."""
    monkeypatch.chdir(tmp_path)
    topics = [
        ("/range", "sensor_msgs/msg/Range", [humble_range(2.0)]),
        ("/text", "std_msgs/msg/String", [b"\0\1\0\0\2\0\0\0a\0"]),
    ]
    path = write_db3(tmp_path / "h.db3", topics)
    words = ["--from", "distro:humble", "--to", "distro:jazzy", "-o"]
    assert main(["upgrade", path, *words, "up"]) == 0
    captured = capsys.readouterr()
    assert "/range: 1 message converted" in captured.out
    assert "ros-humble-rosbag2-storage-mcap" in captured.err
    assert main(["upgrade", "up/h.mcap", *words, "twice"]) == 0
    assert "no types changed" in capsys.readouterr().out
    with idlc.Recording("twice/h.mcap") as recording:
        assert all(topic.schema.text and topic.hash for topic in recording.topics)
        assert recording["/range"].to_columns()["range"].tolist() == [2.0]
        assert recording["/text"].to_columns()["data"].to_list() == ["a"]


def test_recordings_are_compared_with_each_other(files, capsys):
    assert main(["breaking", "2024.mcap", "--against", "2023.mcap"]) == 1
    assert "compared 1 interface, 2 recordings" in capsys.readouterr().out
    assert main(["breaking", "2023.mcap", "--against", "2023.mcap"]) == 0
    assert main(["breaking", "both.mcap", "--against", "2023.mcap"]) == 1


def test_definitions_are_written_as_files(files, capsys):
    """They compile to the recorded types, and nothing is replaced."""
    write(files / "a.mcap", [(same("plain"), 1, body(1.0))])
    assert main(["show", "a.mcap", "--format", "msg", "-o", "defs"]) == 0
    assert capsys.readouterr().out.split() == [
        "defs/demo_msgs/msg/Out.msg",
        "defs/demo_msgs/msg/In.msg",
        "defs/builtin_interfaces/msg/Time.msg",
    ]
    assert (files / "defs/demo_msgs/msg/In.msg").read_text() == "float64 x\n"
    with idlc.Recording("a.mcap") as recording:
        digest = recording["/t"].structure.hash
    assert main(["show", "defs/demo_msgs", "--format", "hash"]) == 0
    assert digest in capsys.readouterr().out
    assert main(["show", "a.mcap", "/t", "--format", "msg", "-o", "defs"]) == 0
    (files / "defs/demo_msgs/msg/In.msg").write_text("mine\n")
    assert main(["show", "a.mcap", "--format", "msg", "-o", "defs"]) != 0
    assert (files / "defs/demo_msgs/msg/In.msg").read_text() == "mine\n"
    assert main(["show", "both.mcap", "--format", "msg", "-o", "both"]) == 1
    assert "IDL653" in capsys.readouterr().err
    for words in (["a.mcap", "--format", "msg"], ["a.mcap", "-o", "x"], ["std_msgs", "-o", "x"]):
        assert main(["show", *words]) == 2


IDL = "module p_msgs {{\n  module msg {{\n    struct P {{\n      double v;\n{}    }};\n  }};\n}};\n"


@pytest.mark.parametrize(
    ("before", "after"),
    [("git:v1", "p_msgs"), ("git:v1", "git:v2"), ("../of_v1/p_msgs", "git:v2")],
)
def test_git_revisions_have_idl_files_too(before, after, tmp_path, monkeypatch, capsys):
    (tmp_path / "src").mkdir()
    git = ("git", "-c", "user.name=A", "-c", "user.email=a@b.c")
    programs.run("git", "init", "-q", cwd=tmp_path / "src")
    for tag, fields in {"v1": "", "v2": "      long extra;\n"}.items():
        for place in ("src", f"of_{tag}"):
            path = tmp_path / place / "p_msgs/msg/P.idl"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(IDL.format(fields), encoding="utf-8")
            manifest = path.parent.parent / "package.xml"
            manifest.write_text("<package><name>p_msgs</name></package>", encoding="utf-8")
        for words in ("add p_msgs", "commit -qm more", f"tag {tag}"):
            programs.run(*git, *words.split(), cwd=tmp_path / "src")
    monkeypatch.chdir(tmp_path / "src")
    payload = b"\0\1\0\0" + struct.pack("<d", 1.5)
    recording = write_db3(tmp_path / "x.db3", [("/p", "p_msgs/msg/P", [payload])])
    words = ["upgrade", recording, "--from", before, "--to", after, "-o", "up"]
    assert main(words) == 0
    assert "/p: 1 message converted" in capsys.readouterr().out
    with idlc.Recording("up/x.mcap") as upgraded:
        ((_, message),) = upgraded["/p"]
        assert (message.v, message.extra) == (1.5, 0)
