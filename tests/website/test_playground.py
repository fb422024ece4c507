"""The session of the playground, without a browser: its bytes are those of generated classes."""

import json

import pytest

from maintenance.playground.session import PACKAGE, Session
from tests.support.generated import class_of, importable, write_package

TEXT = """# How to drive.
std_msgs/Header header
bool ready
float64 speed 0.5  # forward [m/s]
geometry_msgs/Vector3 size
string<=16 frame "base"
wstring wide "é"
uint16[3] gears [1, 2, 3]
float32[] ranges
int64[<=2] last [-4]
geometry_msgs/Point[] path
"""


@pytest.fixture
def ask(tmp_path):
    session = Session(tmp_path)

    def ask(method, **params):
        return json.loads(session.handle(json.dumps([method, params])))

    ask.folder = session.folder
    return ask


def opened(ask, text, kind="msg", before=None):
    before = text if before is None else before
    return ask("open", kind=kind, name="Drive", text=text, before=before)["items"]


def test_a_problem_appears_and_goes(ask):
    assert opened(ask, "flot64 x\n")[0]["code"] == "IDL201"
    assert ask("python") == ask("hash") == ask("schema") == ""
    assert ask("bytes", values={}) is None
    assert ask("change", text="float64 x\n")["items"] == []
    assert list(ask.folder.iterdir()) == []


def test_bytes_are_those_of_the_class(ask, tmp_path):
    assert [each["code"] for each in opened(ask, TEXT)] == ["IDL421"]  # wstring
    values = {
        "ready": "true",
        "header.stamp.sec": "7",
        "frame": '"map"',
        "ranges": "[1.5, 2]",
        "path": '[{"x": 1}, {"z": -2.5}]',
    }
    answer = ask("bytes", values=values)
    write_package(tmp_path / "out", PACKAGE, {"msg/Drive.msg": TEXT})
    with importable(tmp_path / "out"):
        drive = class_of(f"{PACKAGE}/msg/Drive")
        point = class_of("geometry_msgs/msg/Point")
        message = drive(ready=True, frame="map", ranges=[1.5, 2.0])
        message.header.stamp.sec = 7
        message.path = [point(x=1.0), point(z=-2.5)]
        data = message.serialize()
    assert bytes.fromhex(answer["hex"]) == data
    ends = [row["end"] for row in answer["rows"]]
    assert ends == sorted(ends)
    assert ends[-1] == len(data)


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("ready", "1"),
        ("speed", '"fast"'),
        ("speed", "{"),
        ("frame", '"much too long a name"'),
        ("gears", "[1, 2]"),
        ("gears", "[1, 2, 65536]"),
        ("last", "[1, 2, 3]"),
        ("path", '[{"w": 1}]'),
        ("ranges", "[1e39]"),
        ("path", "[" * 100_000),
        ("ranges", json.dumps([0] * 300_000)),
    ],
)
def test_a_wrong_value_is_reported_and_the_default_is_written(ask, path, text):
    opened(ask, TEXT)
    answer = ask("bytes", values={path: text})
    assert [row["path"] for row in answer["rows"] if row["error"]] == [path]
    assert answer["hex"] == ask("bytes", values={})["hex"]


@pytest.mark.parametrize(
    ("kind", "text", "names"),
    [
        ("srv", "int8 a\n---\nint8 b\n", "Drive_Request"),
        ("action", "int8 a\n---\nint8 b\n---\nint8 c\n", "Drive_SendGoal_Request"),
    ],
)
def test_all_kinds_have_all_views(ask, kind, text, names):
    assert [each for each in opened(ask, text, kind) if each["severity"] == 1] == []
    assert names in ask("hash")
    assert "class Drive" in ask("python")
    assert json.loads(ask("schema"))["title"] == f"{PACKAGE}/{kind}/Drive"
    assert ask("bytes", values={})["hex"] == "0001000000"


def test_what_breaks_against_the_first_text(ask):
    opened(ask, "float64 speed\n", before="float64 speed\n")
    assert ask("breaking") == []
    ask("change", text="float64 velocity\n")
    assert [change["code"] for change in ask("breaking")] == ["IDL504"]


def test_completion_and_hover(ask):
    opened(ask, "flo\nfloat64 speed  # forward [m/s]\n")
    labels = [each["label"] for each in ask("completion", line=0, character=3)["items"]]
    assert "float64" in labels
    assert "m/s" in ask("hover", line=1, character=10)["contents"]["value"]


def test_colours_leave_the_text_as_it_is(ask):
    long = "# [é] " * 1000
    pieces = ask("colours", text=f"{TEXT}{long}")
    assert "".join(text for text, _ in pieces) == f"{TEXT}{long}\n"
    assert ["float64", "kt"] in pieces
    assert ["[m/s]", "cs"] in pieces
    assert [long, ""] in pieces
