"""What a recording says is text of anybody: it becomes no code, no path, and no endless work."""

import ast
import json
from pathlib import Path

import pytest
from mcap.writer import Writer

import idlc
from idlc.cli.main import main
from tests.support import recorded_text
from tests.support.generated import class_of, importable
from tests.support.hostile import PAYLOADS, assert_harmless, assert_untouched, run

#: An attack and what stands there in the message that all others must look like.
HARMLESS = "x"
IDL = """\
@ /{name} attack/msg/{name} ros2idl
--- IDL attack/msg/{name}
module attack {{ module msg {{
  module {name}_Constants {{
    @verbatim (language="comment", text={text})
    const string TEXT = {text};
  }};
  @verbatim (language="comment", text={text} "\\n" {text})
  struct {name} {{
    @verbatim (language="comment", text={text})
    @default (value={text})
    @unit (value={text})
    string a;
    @default (value={many})
    sequence<string> b;
  }};
}}; }};
"""


def quoted(text):
    """Return text as a literal of IDL, as ROS 2's adapter would have it written."""
    inner = text.replace("\\", "\\\\\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{inner}"'


def sound(payload):
    """Return a payload without what no line of IDL can hold."""
    return "".join(one for one in PAYLOADS[payload] if one not in "\r\n\0\x0b\x0c")


@pytest.fixture(scope="module")
def attacked(tmp_path_factory):
    """One recording with every payload at every place of its IDL, compiled."""
    folder = tmp_path_factory.mktemp("attack")
    blocks = []
    for number, payload in enumerate(PAYLOADS):
        for name, text in ((f"Attack{number}", sound(payload)), (f"Twin{number}", HARMLESS)):
            many = quoted(repr((text, text)))
            blocks.append(IDL.format(name=name, text=quoted(text), many=many))
    recorded_text.write(folder / "attack.mcap", "".join(blocks))
    done = run(["gen", "attack.mcap", "-o", "out/attack"], folder)
    assert done.status == 0, done.stderr[-3000:]
    return folder, done


def test_nothing_ran_and_nothing_was_forged(attacked):
    folder, done = attacked
    for words in (["show", "attack.mcap", "/Attack1"], ["check", "attack.mcap"]):
        said = run(words, folder)
        assert_harmless(said.stdout + said.stderr)
    assert_harmless(done.stdout + done.stderr)
    assert_untouched(folder)


@pytest.mark.parametrize("payload", PAYLOADS)
def test_values_arrive_and_add_nothing_to_the_program(payload, attacked):
    folder, _ = attacked
    number = list(PAYLOADS).index(payload)
    trees = []
    for name in (f"attack{number}", f"twin{number}"):
        text = (folder / f"out/attack/msg/_{name}.py").read_text(encoding="utf-8")
        tree = ast.parse(text)
        trees.append([type(node).__name__ for node in tree.body])
    assert trees[0] == trees[1]
    with importable(folder / "out"):
        cls = class_of(f"attack/msg/Attack{number}")
        assert sound(payload) == cls.TEXT
        assert cls().a == sound(payload)
        assert cls().b == [sound(payload)] * 2
        assert cls.deserialize(cls().serialize()) == cls()
    assert_untouched(folder)


@pytest.mark.parametrize("payload", PAYLOADS)
def test_names_of_topics_types_and_encodings_are_no_commands(payload, tmp_path):
    hostile = sound(payload).replace(" ", "_") or "x"
    text = f"@ {hostile} {hostile} {hostile} {hostile}\nint32 a\n"
    text += f"@ /y std_msgs/msg/String ros2msg {hostile}\nint32 {hostile}\n"
    text += f"@ /z demo/msg/{hostile}\nint32 a\n--- MSG {hostile}\nint32 b\n"
    recorded_text.write(tmp_path / "a.mcap", text)
    for words in (["show", "a.mcap"], ["check", "a.mcap"], ["gen", "a.mcap", "-o", "out"]):
        said = run(words, tmp_path)
        assert_harmless(said.stdout + said.stderr)
    for line in run(["show", "a.mcap", "--format", "json"], tmp_path).stdout.splitlines():
        assert json.loads(line)["type"] in ("recording", "topic")
    assert_untouched(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} <= {"a.mcap", "out"}


def nested(count):
    """Return messages of two fields each, which make 2**count fields."""
    parts = [f"--- MSG a/M{n}\nM{n + 1} a\nM{n + 1} b" for n in range(count)]
    return "\n".join(["M0 a", *parts, f"--- MSG a/M{count}", "int8 a", ""])


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("IDL210", "A again\n"),
        ("IDL210", "B[] b\n--- MSG a/B\nA a\n"),
        ("IDL619", nested(40)),
        ("IDL301", "int8[" + "9" * 10_000 + "] a\n"),
        ("IDL202", "nowhere_msgs/Thing a\n"),
        ("IDL201", "Thing a\n"),
        ("IDL203", "int32 a;import os\n"),
    ],
    ids=lambda text: text[:20],
)
def test_types_that_nobody_can_use_are_refused(code, text, tmp_path, capsys):
    path = str(recorded_text.write(tmp_path / "a.mcap", f"@ /x a/msg/A\n{text}"))
    for words in (["check", path], ["gen", path, "-o", str(tmp_path / "out")]):
        assert main(words) in (1, 2)
        said = capsys.readouterr()
        assert f"error[{code}]" in said.out + said.err
    main(["breaking", "--against", path])
    main(["show", path, "--format", "hash"])
    main(["show", path])
    assert "Traceback" not in "".join(capsys.readouterr())
    assert not Path(tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("encoding", "text"),
    [
        ("ros2msg", "# " + "x" * (17 << 20)),
        ("ros2msg", "#\n" * 600_000),
        ("ros2msg", "#\x85" * 600_000),
        ("ros2idl", "module a { module msg { " + "typedef int8 a; " * 200_000),
    ],
)
def test_a_definition_of_all_memory_is_none(encoding, text, tmp_path, capsys):
    path = recorded_text.write(tmp_path / "a.mcap", f"@ /x a/msg/A {encoding}\n{text}\nint8 a\n")
    assert main(["check", str(path)]) == 0
    assert "warning[IDL652]" in capsys.readouterr().out


def test_a_bag_of_ros_1_is_told_from_others(tmp_path, capsys):
    path = tmp_path / "old.bag"
    path.write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    assert main(["show", str(path)]) == 1
    assert "rosbags-convert" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("fields", "values"),
    [
        ("float64 sec\nfloat64 nanosec", {"sec": 0.0, "nanosec": 0.0}),
        ("uint32 nanosec\nint32 sec", {"nanosec": 0, "sec": 0}),
        ("uint64 sec\nuint64 nanosec", {"sec": 0, "nanosec": 0}),
        ("string sec\nuint32 nanosec", {"sec": "", "nanosec": 0}),
        ("int32 sec\nuint32 nanosec\nint32 more", {"sec": 0, "nanosec": 0, "more": 0}),
    ],
)
def test_other_types_of_the_name_of_times_are_no_times(fields, values, tmp_path, capsys):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        end = f"\n{'=' * 80}\nMSG: builtin_interfaces/Time\n"
        schema = writer.register_schema(
            "a/msg/A", "ros2msg", f"builtin_interfaces/Time t{end}{fields}\n".encode()
        )
        channel = writer.register_channel("/x", "cdr", schema)
        writer.add_message(channel, 0, b"\0\1" + bytes(18), 0)
        writer.finish()
    with idlc.Recording(path) as recording:
        frame = recording["/x"].to_pandas()
    assert frame.iloc[:, 2:].to_dict("records") == [
        {f"t.{name}": value for name, value in values.items()}
    ]
    assert main(["columns", str(path), "/x", "--format", "text"]) == 0
    assert "t.nanosec" in capsys.readouterr().out
