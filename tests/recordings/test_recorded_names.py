"""Names that interface files cannot have, and packages of .idl files, in recordings of others."""

import shutil
import sqlite3
import struct
from contextlib import closing

import pytest
from mcap.writer import Writer

import idlc
from idlc.cli.main import main
from idlc.project import inputs
from idlc.recordings.containers.source import RecordingError

BODY = b"\0\1\0\0" + struct.pack("<iI", 7, 8)


def recording(path, text, encoding="ros2msg"):
    """Write a recording of one message; without a text, it has no definition."""
    if text is None:
        with closing(sqlite3.connect(path)) as file:
            file.executescript(
                "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,"
                " serialization_format TEXT, offered_qos_profiles TEXT);"
                "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER,"
                " timestamp INTEGER, data BLOB);"
                "INSERT INTO topics VALUES (1, '/x', 'demo_msgs/msg/X', 'cdr', '');"
            )
            file.execute("INSERT INTO messages VALUES (1, 1, 5, ?)", (BODY,))
            file.commit()
        return path
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema("demo_msgs/msg/X", encoding, text.encode())
        channel = writer.register_channel("/x", "cdr", schema)
        writer.add_message(channel, 5, BODY, 5)
        writer.finish()
    return path


IDL = "module demo_msgs {{ module msg {{ {} }}; }};"
NAMES = {
    "one capital": ("int32 D\nuint32 d\n", ["D", "d"]),
    "camel case": ("int32 wheelSpeed\nuint32 wheel_Speed\n", ["wheelSpeed", "wheel_Speed"]),
    "underscores": ("int32 a__b\nuint32 None\n", ["a__b", "None"]),
    "constants": ("uint8 open=1\nuint8 Closed_=2\nint32 a\nuint32 b\n", ["a", "b"]),
    "IDL": (IDL.format("struct X { long wheelSpeed; uint32 D; };"), ["wheelSpeed", "D"]),
}


@pytest.mark.parametrize("case", NAMES)
def test_names_of_ros_1_and_idl_are_harmless(case, tmp_path, capsys):
    text, names = NAMES[case]
    path = recording(tmp_path / "a.mcap", text, "ros2idl" if case == "IDL" else "ros2msg")
    with idlc.Recording(path) as opened:
        columns = opened["/x"].to_arrow().to_pydict()
        assert [columns[name] for name in names] == [[7], [8]]
        (stamped,) = opened["/x"]
        assert stamped.message.serialize() == BODY
        assert case != "constants" or (stamped.message.open, stamped.message.Closed_) == (1, 2)
    for command in (["check"], ["show"], ["columns", "--format", "csv"]):
        assert main([*command, str(path)]) == 0
    assert main(["gen", str(path), "-o", str(tmp_path / "out")]) == 1
    assert "cannot be a" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["a;import os", "2d", "ä", "_a", "from_"])
def test_other_names_are_errors(name, tmp_path):
    path = recording(tmp_path / "a.mcap", f"int32 {name}\nuint32 b\n")
    with (
        idlc.Recording(path) as opened,
        pytest.raises(RecordingError, match="cannot be a field name"),
    ):
        opened["/x"].to_arrow()


def test_a_field_and_a_constant_have_different_names(tmp_path):
    path = recording(tmp_path / "a.mcap", "uint8 A=1\nint32 A\nuint32 b\n")
    with (
        idlc.Recording(path) as opened,
        pytest.raises(RecordingError, match="`A` is the name of a field and of a constant"),
    ):
        opened["/x"].to_arrow()


@pytest.mark.parametrize(
    "inside",
    [
        "struct X { long a; unsigned long b; };",
        "enum Mode { OFF, ON }; struct X { @key int32 a; Mode b; };",
        "typedef octet pair__4[4]; struct X { int32 a; pair__4 b; };",
    ],
)
@pytest.mark.parametrize("include", ["", "demo_msgs"])
def test_a_package_of_idl_files_defines_recorded_types(inside, include, tmp_path, capsys):
    path = recording(tmp_path / "a.db3", None)
    package = tmp_path / "ws" / "demo_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>demo_msgs</name></package>\n")
    (package / "msg" / "X.idl").write_text(IDL.format(inside))
    folder = str(tmp_path / "ws" / include)
    assert main(["columns", str(path), "/x", "-I", folder, "--format", "csv"]) == 0
    assert ",,7," in capsys.readouterr().out
    longer = tmp_path / "longer" / "demo_msgs"
    shutil.copytree(package, longer)
    (longer / "msg" / "X.idl").write_text(IDL.format(inside.replace("; };", "; octet c; };")))
    for number, words in enumerate((["-I", folder], ["--from", folder, "--to", str(longer)])):
        out = tmp_path / str(number)
        assert main(["upgrade", str(path), *words, "-o", str(out)]) == 0
        with idlc.Recording(out / "a.mcap") as opened:
            columns = opened["/x"].to_arrow()
        assert columns["a"].to_pylist() == [7]
        assert ("c" in columns.column_names) == bool(number)


def test_complete_recordings_need_no_packages_around_here(tmp_path, monkeypatch):
    calls = []
    monkeypatch.setattr(inputs, "nearby_packages", lambda root: calls.append(root) or {})
    with idlc.Recording(recording(tmp_path / "a.mcap", "int32 a\nuint32 b\n")) as opened:
        assert opened["/x"].to_columns()["b"].tolist() == [8]
    assert calls == []
    with (
        idlc.Recording(recording(tmp_path / "a.db3", None)) as opened,
        pytest.raises(RecordingError, match="does not define `demo_msgs/msg/X`"),
    ):
        opened["/x"].to_columns()
    assert calls
