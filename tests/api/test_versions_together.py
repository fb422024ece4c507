"""Recordings of one type and of several versions, read together."""

import random
import struct

import pyarrow as pa
import pytest
from mcap.writer import Writer

import idlc
from idlc.api.upgrade import UpgradeError
from idlc.cli.main import main
from idlc.recordings.containers.source import RecordingError

LINE = "=" * 80
IN = f"{LINE}\nMSG: demo_msgs/In\nfloat64 x\n"
TIME = f"{LINE}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
TOP = "demo_msgs/In a\nbuiltin_interfaces/Time t\n"
#: Definitions of one type.
SAME = {
    "plain": TOP + IN + TIME,
    "order": TOP + TIME + IN,
    "comment": TOP.replace("In a\n", "In a  # a comment\n") + IN + TIME,
    "blanks": TOP.replace("In a\n", "In   a\n\n") + IN + TIME + "\n",
    "names": TOP.replace("demo_msgs/In", "demo_msgs/msg/In") + IN + TIME,
    "constant": "uint8 MOST=3\n" + TOP + IN + TIME,
}


def body(value):
    return b"\0\1\0\0" + struct.pack("<dII", value, 5, 6)


def write(path, channels, *, topic="/t"):
    """Write messages `(definition, time, bytes)`, each definition as a channel of its own."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        numbers = {}
        for (name, text), time, data in channels:
            if (name, text) not in numbers:
                schema = writer.register_schema(name, "ros2msg", text.encode())
                numbers[name, text] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(numbers[name, text], time, data, time)
        writer.finish()
    return str(path)


def same(name):
    return "demo_msgs/msg/Out", SAME[name]


@pytest.mark.parametrize("other", [*SAME][1:])
def test_definitions_of_one_type_are_one(other, tmp_path, capsys):
    """In two files, and in one, tables, messages, parts and upgrades do not mind the text."""
    first = write(tmp_path / "a.mcap", [(same("plain"), 1, body(1.0))])
    second = write(tmp_path / "b.mcap", [(same(other), 2, body(2.0))])
    both = write(
        tmp_path / "c.mcap",
        [(same("plain"), 1, body(1.0)), (same(other), 2, body(2.0)), (same("plain"), 3, body(3.0))],
    )
    for place, values in (([first, second], [1.0, 2.0]), (both, [1.0, 2.0, 3.0])):
        with idlc.Recording(place) as recording:
            topic = recording["/t"]
            assert topic.topic.count == len(values)
            assert topic.to_columns()["a"]["x"].tolist() == values
            assert topic.to_arrow(flat=True)["a.x"].to_pylist() == values
            assert [message.a.x for _, message in topic] == values
            parts = [value for part in topic.parts() for value in part.to_columns()["a"]["x"]]
            assert parts == values
            assert topic.between(2, 3).to_columns()["a"]["x"].tolist() == [2.0]
    assert main(["columns", first, second, "/t", "--format", "csv"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 3


P1, P2 = ("demo_msgs/msg/P", "uint8 v\n"), ("demo_msgs/msg/P", "uint8 v\nfloat64 w 7\n")
OTHER = ("demo_msgs/msg/Q", "string s\n")


def old(value):
    return b"\0\1\0\0" + bytes([value])


def new(value, more):
    return b"\0\1\0\0" + struct.pack("<B7xd", value, more)


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "2023.mcap", [(P1, 1, old(1)), (P1, 2, old(2))])
    write(tmp_path / "2024.mcap", [(P2, 3, new(3, 0.5)), (P2, 4, new(4, 1.5))])
    write(tmp_path / "both.mcap", [(P1, 1, old(1)), (P2, 2, new(2, 0.5)), (P1, 3, old(3))])
    write(tmp_path / "two.mcap", [(P1, 1, old(1)), (OTHER, 2, b"\0\1\0\0\2\0\0\0a\0")])
    return tmp_path


@pytest.mark.parametrize(
    ("place", "values"),
    [
        (["2023.mcap", "2024.mcap"], [(1, 7.0), (2, 7.0), (3, 0.5), (4, 1.5)]),
        (["2024.mcap", "2023.mcap"], [(3, 0.5), (4, 1.5), (1, 7.0), (2, 7.0)]),
        ("both.mcap", [(1, 7.0), (2, 0.5), (3, 7.0)]),
    ],
)
def test_versions_are_read_as_one(place, values, files):
    kind = idlc.load("2024.mcap").P
    with idlc.Recording(place, as_=kind) as recording:
        topic = recording["/t"]
        assert [(message.v, message.w) for _, message in topic] == values
        columns = topic.to_columns()
        assert [*zip(columns["v"].tolist(), columns["w"].tolist(), strict=True)] == values
        assert topic.to_arrow(fields=["w"])["w"].to_pylist() == [w for _, w in values]
        assert topic.topic.count == len(values)
        rows = [v for part in topic.parts() for v in part.to_columns()["v"].tolist()]
        assert sorted(rows) == sorted(v for v, _ in values)
        assert topic.between(2, 4).to_columns()["v"].tolist() == [
            v for v, _ in values if 2 <= v < 4
        ]


def test_versions_are_on_one_clock(files):
    """Of several messages of one time the last counts; no part mistakes one version for another."""
    kind = idlc.load("2024.mcap").P
    for seed in range(8):
        rng, rows, places, definitions = random.Random(seed), [], [], []
        for number in range(seed % 3 + 1):
            versions, messages = rng.choice([[1], [2], [1, 2]]), []
            times = (
                rng.sample(range(1, 20), 12) if len(versions) > 1 else rng.choices(range(20), k=9)
            )
            for time in times:
                value = rng.randrange(256)
                is_old = rng.choice(versions) == 1
                message = (P1, time, old(value)) if is_old else (P2, time, new(value, value / 2))
                messages.append(message)
                rows.append((time, value, 7.0 if is_old else value / 2))
            places.append(write(files / f"{number}.mcap", messages))
            definitions.append({definition for definition, *_ in messages})
        ordered = sorted(rows, key=lambda row: row[0])
        with idlc.Recording(places, as_=kind) as recording:
            on, every = (
                recording.aligned(["/t"], **clock) for clock in ({"on": "/t"}, {"every": "3ns"})
            )
            table = on.to_arrow().to_pydict()
            assert [*zip(table["/t.v"], table["/t.w"], strict=True)] == [row[1:] for row in ordered]
            ticks = range(ordered[0][0], ordered[-1][0] + 1, 3)
            last = [[row for row in ordered if row[0] <= tick][-1][1] for tick in ticks]
            assert every.to_arrow()["/t.v"].to_pylist() == last
            if any(len(texts) > 1 for texts in definitions):
                with pytest.raises(RecordingError, match="several versions"):
                    on.parts(1)
            else:
                parts = pa.concat_tables([part.to_arrow() for part in on.parts(1)])
                assert parts.equals(on.to_arrow())


@pytest.mark.parametrize("place", [["2023.mcap", "2024.mcap"], "both.mcap"])
def test_versions_without_as_are_named(place, files):
    with idlc.Recording(place) as recording, pytest.raises(RecordingError) as caught:
        recording["/t"]
    assert caught.value.message.count("RIHS01_") == 2
    assert ".mcap" in caught.value.message
    target = "2024.mcap" if isinstance(place, list) else "PATH"
    assert f"--to {target} -o upgraded`" in caught.value.hint


def test_one_of_two_types_is_selected(files, capsys):
    with idlc.Recording("two.mcap") as recording:
        with pytest.raises(RecordingError, match=r"demo_msgs/msg/P, demo_msgs/msg/Q"):
            recording["/t"]
        assert recording.topic("/t", "demo_msgs/Q").to_columns()["s"].to_list() == ["a"]
        with pytest.raises(RecordingError, match="no messages of"):
            recording.topic("/t", "demo_msgs/msg/R")
    assert main(["columns", "two.mcap", "/t", "--format", "csv"]) == 1
    assert "--type" in capsys.readouterr().err
    words = ["columns", "two.mcap", "/t", "--type", "demo_msgs/msg/P", "--format", "csv"]
    assert main(words) == 0
    assert capsys.readouterr().out.splitlines()[0].endswith('"v"')


NESTED = f"In i\n{LINE}\nMSG: demo_msgs/In\nint32 x  # [{{}}]\n"
#: Definitions of one hash, the bytes of a message, and what is said if it means something else.
MEANINGS = {
    "unit": ("float64 v  # [rad]\n", "float64 v  # [deg]\n", 8, "the unit of `v` changed"),
    "constant": ("uint8 A=0\nuint8 v\n", "uint8 A=1\nuint8 v\n", 1, "from A=0 to A=1"),
    "nested unit": (NESTED.format("m"), NESTED.format("mm"), 4, "the unit of `x` changed"),
    "added unit": ("float64 v\n", "float64 v  # [deg]\n", 8, ""),
    "comment": ("float64 v  # to the left\n", "float64 v  # left\n", 8, ""),
}


@pytest.mark.parametrize("case", MEANINGS)
def test_values_of_other_meanings_are_not_mixed_without_a_word(case, tmp_path, recwarn):
    """Nor are they converted as one."""
    first, second, size, words = MEANINGS[case]
    rows = [(("demo_msgs/msg/M", text), 1, bytes(4 + size)) for text in (first, second)]
    path = write(tmp_path / "a.mcap", rows)
    with idlc.Recording(path) as recording:
        assert len(recording["/t"].to_columns()) == 2
    messages = [str(warning.message) for warning in recwarn]
    assert len(messages) == bool(words)
    assert all("several definitions" in message and words in message for message in messages)
    top, _, nested = second.partition(f"{LINE}\nMSG: demo_msgs/In\n")
    folder = tmp_path / "demo_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "M.msg").write_text(f"uint8 more\n{top}")
    if nested:
        (folder / "In.msg").write_text(nested)
    kind = idlc.load(str(folder.parent))["demo_msgs/msg/M"]
    with idlc.Recording(path, as_=kind) as recording:
        if words:
            with pytest.raises(UpgradeError, match="rule"):
                recording["/t"].to_columns()
        else:
            assert len(recording["/t"].to_columns()) == 2
