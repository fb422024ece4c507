"""Messages whose lengths prove that their definition is not the publisher's."""

import sqlite3
import struct
import warnings

import pytest

import idlc
from idlc.cli.main import main
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.load import MissingDefinitionWarning, OtherDefinitionWarning
from tests.api.test_versions_together import write
from tests.tasks.test_upgrade import write_package


def cdr(form, *values):
    return b"\0\1\0\0" + struct.pack(form, *values)


def floats(values, tail):
    return cdr("<I4x", len(values)) + struct.pack(f"<{len(values)}dI", *values, tail)


#: A type, its recorded definition, the publisher's, and messages of that.
CASES = {
    "wider": (
        "float32 left\nfloat32 right\n",
        "float64 left\nfloat64 right\n",
        [cdr("<dd", n, 2) for n in (1, 2)],
    ),
    "inserted": (
        "float32 rate\nuint8 n\n",
        "float64 more\nfloat32 rate\nuint8 n\n",
        [cdr("<dfB", 1, 2, 3)],
    ),
    "elements": (
        "float32[] r\nint32 n\n",
        "float64[] r\nint32 n\n",
        [floats([1, 2, 3, 4], 7), floats([1], 8)],
    ),
    "appended": (
        "uint8 a\n",
        "uint8 a\nfloat64 b\n",
        [cdr("<B7xd", n, 1.5) for n in range(100)],
    ),
    "nothing": ("uint8 A=1\n", "float64 a\n", [cdr("<d", 1.5)]),
}


def recorded(folder, name):
    wrong, right, messages = CASES[name]
    channels = [(("demo_msgs/msg/W", wrong), at, data) for at, data in enumerate(messages)]
    return write(folder / f"{name}.mcap", channels), right


def read(path, way):
    with idlc.Recording(path) as recording:
        topic = recording["/t"]
        if way == "messages":
            return list(topic.messages())
        if way == "fields":
            return topic.to_arrow(fields=[topic.to_columns().keys()[-1]])
        if way == "between":
            return topic.between(0, 1).to_columns()
        if way == "parts":
            return [part.to_columns() for part in topic.parts()]
        return getattr(topic, way)()


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(
    "way", ["to_columns", "to_arrow", "messages", "fields", "between", "parts"]
)
def test_unread_bytes_are_a_warning(name, way, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path, _ = recorded(tmp_path, name)
    if way == "fields" and name == "nothing":
        return
    with pytest.warns(OtherDefinitionWarning, match=r"/t` has [0-9,]+( to [0-9,]+)? bytes"):
        read(path, way)


@pytest.mark.parametrize("name", CASES)
def test_unread_bytes_are_an_error_where_another_version_fits(name, tmp_path, monkeypatch, capsys):
    """The fitting version is local, or that of another topic."""
    monkeypatch.chdir(tmp_path)
    path, right = recorded(tmp_path, name)
    assert main(["check", path]) == 0
    assert "IDL654" in capsys.readouterr().out
    write_package(tmp_path / "src", {"W": right}, "demo_msgs")
    with (
        idlc.Recording(path, include=["src"]) as recording,
        pytest.raises(RecordingError, match=r"the version on this machine fits"),
    ):
        recording["/t"].to_columns()
    assert main(["columns", path, "/t", "-I", "src", "--format", "csv"]) == 1
    assert "fits" in capsys.readouterr().err
    assert main(["check", path, "-I", "src"]) == 1
    assert "fits" in capsys.readouterr().out


@pytest.mark.parametrize("way", ["to_columns", "to_arrow", "between", "parts"])
def test_messages_are_judged_as_they_are_read(way, tmp_path, monkeypatch):
    """Those of which all fields are read are not read twice."""
    path = write(tmp_path / "a.mcap", [(("demo_msgs/msg/W", "uint8 a\n"), 0, cdr("<B", 1))])
    twice = []
    monkeypatch.setattr("idlc.recordings.columns.unread_bytes", lambda *_: twice.append(way))
    read(path, way)
    assert not twice


def test_a_message_of_another_version_among_others_is_a_warning(tmp_path):
    text = "demo_msgs/msg/W", "uint8 a\n"
    channels = [(text, n, cdr("<B", 1)) for n in range(200)]
    path = write(tmp_path / "a.mcap", [*channels, (text, 200, cdr("<B7xd", 1, 2))])
    with pytest.warns(OtherDefinitionWarning, match=r"1 of 201 messages of `/t` has 15 bytes"):
        read(path, "to_columns")


def test_padding_proves_nothing(tmp_path):
    text = "demo_msgs/msg/W", "string s\nuint8 a\n"
    for size in range(4):
        data = cdr("<I", 3) + b"ab\0" + bytes([size]) + bytes(size)
        path = write(tmp_path / f"{size}.mcap", [(text, 0, data)])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for way in ("to_columns", "messages", "parts"):
                read(path, way)


def write_db3(path, topics):
    """Write a .db3 file as Humble does: without definitions."""
    with sqlite3.connect(path) as database:
        database.executescript(
            "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
            " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
            " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        )
        for number, (name, kind, messages) in enumerate(topics, 1):
            qos = "- history: 1\n  depth: 7\n"
            database.execute("INSERT INTO topics VALUES(?,?,?,'cdr',?)", (number, name, kind, qos))
            rows = [(number, 10 + at, data) for at, data in enumerate(messages)]
            database.executemany(
                "INSERT INTO messages(topic_id, timestamp, data) VALUES(?,?,?)", rows
            )
    database.close()
    return str(path)


HEADER = struct.pack("<iII", 1, 2, 2) + b"a\0"


def humble_range(distance):
    """Return sensor_msgs/Range of Humble, which ends before `variance`."""
    return b"\0\1\0\0" + HEADER + b"\1\0" + struct.pack("<4f", 0.5, 0.1, 9.0, distance)


def test_the_distribution_that_fits_is_used(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    echo = [0.0, 0.5, 0.75]
    nested = [humble_range(n) + struct.pack("<I3f", 3, *echo) for n in range(3)]
    several = cdr("<I", 2) + HEADER + b"\1\0" + struct.pack("<4f", 0.5, 0.1, 9.0, 3.0)
    several += HEADER + b"\1\0" + struct.pack("<4f", 0.5, 0.1, 9.0, 4.0)
    topics = [
        ("/range", "sensor_msgs/msg/Range", [humble_range(n) for n in range(3)]),
        ("/echo", "own_msgs/msg/Echo", nested),
        ("/all", "own_msgs/msg/All", [several]),
    ]
    path = write_db3(tmp_path / "humble.db3", topics)
    own = {
        "Echo": "sensor_msgs/Range range\nfloat32[] echo\n",
        "All": "sensor_msgs/Range[] ranges\n",
    }
    write_package(tmp_path / "src", own, "own_msgs")
    with idlc.Recording(path, include=["src"]) as recording:
        with pytest.warns(MissingDefinitionWarning, match="type of Humble, .*, which fits|Humble"):
            assert recording["/range"].to_columns()["range"].tolist() == [0.0, 1.0, 2.0]
        with pytest.warns(MissingDefinitionWarning, match="Humble"):
            assert recording["/echo"].to_columns()["echo"].to_list() == [echo] * 3
        with pytest.warns(MissingDefinitionWarning, match="Humble"):
            assert [each.range for _, all_ in recording["/all"] for each in all_.ranges] == [3, 4]
        with pytest.warns(MissingDefinitionWarning, match="Humble"):
            assert [message.range for _, message in recording["/range"]] == [0.0, 1.0, 2.0]
    words = ["columns", path, "/range", "--format", "csv"]
    assert main(words) == 0
    assert "which fits the messages" in capsys.readouterr().err
    assert main([*words, "--distro", "humble"]) == 0
    error = capsys.readouterr().err
    assert "fits" not in error
    assert "idlc uses the type of ROS 2 Humble, which has the same name" in error
    commands = {
        (*words, "--distro", "jazzy"): "use `--distro humble`",
        ("upgrade", path, "/range", "-o", "up"): "use `--from distro:humble`",
        ("upgrade", path, "--from", "src/own_msgs", "-o", "up"): "use `--from distro:humble`",
        ("gen", path, "-o", "g", "-I", "src"): "generate with `--distro humble`",
        ("check", path, "-I", "src"): "check with `--distro humble`",
    }
    for command, advice in commands.items():
        assert main([*command]) == (1 if "use" in advice else 0)
        assert advice in "".join(capsys.readouterr())


@pytest.mark.parametrize("name", CASES)
def test_upgrades_refuse_messages_of_another_version(name, tmp_path, monkeypatch, capsys):
    """Whether bytes are converted, or copied under a new definition."""
    monkeypatch.chdir(tmp_path)
    path, _ = recorded(tmp_path, name)
    for more in ("uint8 extra\n", "# a comment\n"):
        write_package(tmp_path / "new", {"W": CASES[name][0] + more}, "demo_msgs")
        assert main(["upgrade", path, "--to", "new/demo_msgs", "-o", "out"]) == 1
        assert "does not read" in capsys.readouterr().err
        assert not (tmp_path / "out").exists()


#: A definition, a message of it, and the size that `serialize_message` of Fast DDS gives to it.
ESTIMATED = {
    "empty sequences": ("float64[] a\nfloat64[] b\n", cdr("<II", 0, 0), 20),
    "wstring": ("wstring w\nuint8 b\n", cdr("<IIB", 1, 65, 2), 17),
    "nested": ("Inner[2] i\n", cdr("<IIII", 0, 5, 0, 6), 24),
    "drift": ("int64[] a\nint32 b\nfloat64 c\n", cdr("<Iid", 0, 1, 2.5), 28),
}
INNER = f"{'=' * 80}\nMSG: demo_msgs/Inner\nuint64[] n\nint32 m\n"


@pytest.mark.parametrize("case", ESTIMATED)
def test_bytes_that_a_serializer_has_estimated_prove_nothing(case, tmp_path, capsys):
    text, message, size = ESTIMATED[case]
    text += INNER if case == "nested" else ""
    for number, extra in enumerate((size - len(message), size - len(message) + 4)):
        tail = b"\xa5" * extra
        channels = [(("demo_msgs/msg/W", text), at, message + tail) for at in range(3)]
        path = write(tmp_path / f"{number}.mcap", channels)
        for command in (["check"], ["columns", "--format", "csv"]):
            assert main([*command, str(path)]) == 0
            assert ("IDL654" in "".join(capsys.readouterr())) == bool(number)
        with warnings.catch_warnings(record=True) as caught, idlc.Recording(path) as recording:
            warnings.simplefilter("always")
            assert len(list(recording["/t"])) == 3
        assert len(caught) == number
        (tmp_path / "new" / f"{number}").mkdir(parents=True)
        words = ["upgrade", str(path), "-o", str(tmp_path / "new" / f"{number}")]
        assert main(words) == number
        capsys.readouterr()
