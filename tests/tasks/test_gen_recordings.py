"""`idlc gen` of recordings: classes that read what was recorded, whatever is installed."""

import json

import pytest

from idlc.cli.main import main
from idlc.diagnostics.report import Report, ReportedError
from idlc.tasks.gen import run_for
from tests.support import recorded_text
from tests.support.files import write
from tests.support.generated import class_of, importable
from tests.support.recordings import MAKERS, STORE, by_mcap, by_rosbags, messages

PACKAGES = ["builtin_interfaces", "geometry_msgs", "sensor_msgs", "std_msgs"]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Return what was recorded, and the same recording in each kind of container."""
    folder = tmp_path_factory.mktemp("recorded")
    found = messages(12)
    return found, {
        "mcap": by_mcap(folder / "drive.mcap", found),
        "without compression": by_mcap(folder / "plain.mcap", found, ""),
        "bag of mcap": by_rosbags(folder / "mcap_bag", found, "mcap"),
        "bag of db3": by_rosbags(folder / "db3_bag", found, "db3"),
    }


KINDS = ["mcap", "without compression", "bag of mcap", "bag of db3"]


@pytest.mark.parametrize("kind", KINDS)
def test_the_classes_read_what_was_recorded(kind, recorded, tmp_path):
    found, paths = recorded
    out = tmp_path / "out"
    assert main(["gen", str(paths[kind]), "-o", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir() if path.is_dir()) == PACKAGES
    with importable(out):
        for one in found:
            message = class_of(one.type).deserialize(one.data)
            assert message.serialize() == one.data
            expected = STORE.deserialize_cdr(one.data, one.type)
            assert message.header.stamp.sec == expected.header.stamp.sec
            assert message.header.frame_id == expected.header.frame_id


@pytest.mark.parametrize("kind", ["mcap", "bag of db3"])
def test_settings_mean_the_same_recordings_in_an_editor(kind, recorded, tmp_path, monkeypatch):
    """An editor's server runs anywhere; it writes what the command writes in the folder."""
    name = recorded[1][kind].name
    (tmp_path / "bags").symlink_to(recorded[1][kind].parent)
    write(tmp_path / "msg/Drive.msg", "float64 speed\n")
    table = f'[tool.idlc]\npackage = "demo"\npaths = [".", "bags/{name}"]\nout = "out"\n'
    write(tmp_path / "pyproject.toml", table)
    run = run_for(tmp_path / "msg/Drive.msg", "demo")
    report = Report()
    assert run.make(report)
    assert list(report) == []
    monkeypatch.chdir(tmp_path)
    assert main(["gen", "--check"]) == 0
    assert not any(str(tmp_path) in file.read_text() for file in (tmp_path / "out").rglob("*.py"))


def test_an_editor_reports_a_recording_by_the_name_in_the_settings(tmp_path):
    write(tmp_path / "msg/Drive.msg", "float64 speed\n")
    table = '[tool.idlc]\npackage = "demo"\npaths = [".", "bags/a.mcap"]\nout = "out"\n'
    write(tmp_path / "pyproject.toml", table)
    for content in (None, "", "no recording"):
        if content is not None:
            write(tmp_path / "bags/a.mcap", content)
        report = Report()
        with pytest.raises(ReportedError):
            run_for(tmp_path / "msg/Drive.msg", "demo").make(report)
        (problem,) = report
        assert problem.where[0] == "bags/a.mcap"
        assert "`bags/a.mcap`" in problem.message
        assert str(tmp_path) not in f"{problem.message} {problem.hint}"


@pytest.mark.ros
def test_a_note_says_what_hides_an_installed_package(recorded, tmp_path, capsys):
    assert main(["gen", str(recorded[1]["mcap"]), "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().err
    assert said.startswith("note: ")
    assert "`sensor_msgs`" in said  # the wheel has more of them than the recording
    assert len(said.splitlines()) == 1


def test_topics_narrow_it_down(recorded, tmp_path):
    out = tmp_path / "out"
    words = ["gen", str(recorded[1]["mcap"]), "-o", str(out), "/joints"]
    assert main(words) == 0
    assert sorted(path.name for path in out.iterdir() if path.is_dir()) == [
        "builtin_interfaces",
        "sensor_msgs",
        "std_msgs",
    ]
    lock = json.loads((out / "sensor_msgs/idlc.lock").read_text(encoding="utf-8"))
    assert list(lock["inputs"]) == ["msg/JointState.msg"]


def test_all_that_topics_can_be_is_the_same_for_every_container(recorded, capsys):
    outputs = set()
    for path in recorded[1].values():
        assert main(["show", str(path), "--format", "hash"]) == 0
        outputs.add(capsys.readouterr().out)
    (output,) = outputs
    for type_, _ in MAKERS.values():
        assert f"{STORE.hash_rihs01(type_)}  {type_}\n" in output


OWN = """\
@ /wheels demo_msgs/msg/Wheels
{0}[4] speed
std_msgs/Header header
Part part
--- MSG std_msgs/Header
int8 something_else
--- MSG demo_msgs/Part
{1} number
@ /alone alone_msgs/msg/Alone
int32 a
"""


def test_what_is_recorded_counts_not_what_is_installed(tmp_path):
    out = tmp_path / "out"
    path = recorded_text.write(tmp_path / "a.mcap", OWN.format("float64", "int32"))
    assert main(["gen", str(path), "-o", str(out)]) == 0
    with importable(out):
        wheels = class_of("demo_msgs/msg/Wheels")()
        assert wheels.header.something_else == 0
        assert wheels.part.number == 0


def test_only_what_a_change_concerns_is_written_again(tmp_path, capsys):
    out, path = tmp_path / "out", tmp_path / "a.mcap"
    words = ["gen", str(path), "-o", str(out)]
    recorded_text.write(path, OWN.format("float64", "int32"))
    assert main(words) == 0
    capsys.readouterr()
    assert main(words) == 0
    assert capsys.readouterr().out.count("(unchanged)") == 3
    assert main([*words, "--check"]) == 0
    recorded_text.write(path, OWN.format("float64", "int64"))
    capsys.readouterr()
    assert main([*words, "--check"]) == 1
    assert main(words) == 0
    with importable(out):
        wheels = class_of("demo_msgs/msg/Wheels")()
        wheels.part.number = 1 << 40
        assert type(wheels).deserialize(wheels.serialize()).part.number == 1 << 40


def test_one_package_is_out_itself(tmp_path):
    path = recorded_text.write(tmp_path / "a.mcap", OWN.format("float64", "int32"))
    assert main(["gen", str(path), "-o", str(tmp_path / "out"), "/alone"]) == 0
    assert (tmp_path / "out/msg/_alone.py").exists()


def test_a_recording_goes_with_other_inputs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recorded_text.write("a.mcap", OWN.format("float64", "int32"))
    (tmp_path / "mine/msg").mkdir(parents=True)
    (tmp_path / "mine/msg/Own.msg").write_text("demo_msgs/Wheels wheels\n", encoding="utf-8")
    assert main(["gen", "a.mcap", "mine", "shape_msgs/msg/Plane", "-o", "out"]) == 0
    found = sorted(path.name for path in (tmp_path / "out").iterdir() if path.is_dir())
    assert found == ["alone_msgs", "demo_msgs", "mine", "shape_msgs", "std_msgs"]
    with importable(tmp_path / "out"):
        assert class_of("mine/msg/Own")().wheels.header.something_else == 0


def test_topics_are_those_of_recordings(tmp_path, capsys):
    (tmp_path / "A.msg").write_text("int8 a\n", encoding="utf-8")
    assert main(["gen", str(tmp_path), "-o", str(tmp_path / "out"), "/x"]) == 2
    assert "no such file or folder: `/x`" in capsys.readouterr().err
    assert main(["show", "std_msgs/msg/Header", "/x"]) == 2
    assert "is not a recording" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["a.mcap"], ["std_msgs/msg/Header"], ["std_msgs", "a.mcap"]])
def test_what_has_a_name_gets_no_other(words, here, capsys):
    recorded_text.write("a.mcap", "@ /x a_msgs/msg/A\nint8 a\n")
    assert main(["gen", *words, "-o", "out", "--package", "other"]) == 2
    assert "--package applies to files, but" in capsys.readouterr().err
    assert not (here / "out").exists()
    (here / "msg").mkdir()
    (here / "msg/B.msg").write_text("std_msgs/Header a\n", encoding="utf-8")
    assert main(["gen", *words, "msg", "-o", "out", "--package", "other"]) == 0
    assert (here / "out/other/msg/_b.py").exists()


def test_nothing_is_written_of_a_recording_without_types(tmp_path, capsys):
    path = recorded_text.write(tmp_path / "a.mcap", "@ /x foxglove.Scene protobuf\nabc\n")
    assert main(["gen", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "error[IDL606]" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_into_a_prefix_packages_go_whole(tmp_path):
    path = recorded_text.write(tmp_path / "a.mcap", "@ /x std_msgs/msg/String\nstring data\n")
    assert main(["gen", str(path), "--ament", str(tmp_path / "prefix")]) == 0
    share = tmp_path / "prefix/share/std_msgs/msg"
    assert {"String.msg", "Header.msg", "Bool.idl"} <= {one.name for one in share.iterdir()}
