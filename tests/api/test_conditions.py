"""Messages that match a condition, and their fields, without decoding the others."""

import operator
import pickle
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

import idlc
from idlc.cli.main import main
from idlc.recordings.columns.elements import MissingElementWarning
from idlc.recordings.containers.source import RecordingError
from tests.recordings.test_elements import AMBIGUOUS
from tests.recordings.test_elements import recorded as joints
from tests.support import recordings as made

MESSAGES = made.messages()
OPERATORS = {"==": "eq", "!=": "ne", "<": "lt", "<=": "le", ">": "gt", ">=": "ge"}


@pytest.fixture(scope="module", params=["mcap", "db3"])
def recording(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    if request.param == "mcap":
        path = made.by_mcap(folder / "rec.mcap", MESSAGES, chunk_size=3000)
    else:
        path = made.by_rosbags(folder / "bag", MESSAGES, "sqlite3")
    with idlc.Recording(path) as opened:
        yield opened


@pytest.mark.parametrize("sign", OPERATORS)
def test_each_operator_selects_what_python_selects(recording, sign):
    topic, compare = recording["/camera/image"], getattr(operator, OPERATORS[sign])
    expected = [time for time, message in topic if compare(message.width, 4)]
    chosen = topic.where("width", sign, 4)
    assert [time for time, _ in chosen] == expected
    assert chosen.to_columns()["log_time"].tolist() == expected
    assert chosen.to_arrow()["log_time"].cast("int64").to_pylist() == expected
    assert [time for part in topic.where("width", sign, "4").parts(500)
            for time, _ in pickle.loads(pickle.dumps(part)).messages()] == expected  # fmt: skip


def test_conditions_combine_and_messages_without_the_field_are_counted(recording):
    topic = recording["/joints"]
    lengths = [len(message.position) for _, message in topic]
    chosen = topic.where("position[2]", ">=", 0.25).where("header.frame_id", "!=", "frame")
    expected = [
        time
        for time, message in topic
        if len(message.position) > 2
        and message.position[2] >= 0.25
        and message.header.frame_id != "frame"
    ]
    assert [time for time, _ in chosen] == expected
    assert chosen.absent == sum(length < 3 for length in lengths) > 0
    chosen.to_columns()
    assert chosen.absent == sum(length < 3 for length in lengths)
    none = topic.where("position[9]", "==", 0)
    assert list(none) == []
    assert len(none.to_columns()) == none.to_arrow().num_rows == 0


@pytest.mark.filterwarnings("ignore::idlc.recordings.columns.elements.MissingElementWarning")
def test_an_element_is_selected_by_the_name_that_its_message_gives_it(tmp_path):
    orders = [(["a", "b"], [1, 2]), (["b", "a"], [3, 4]), (["c"], [9]), (["a"], []), ([], [])]
    messages = [joints(number, *each) for number, each in enumerate(orders * 4)]
    with idlc.Recording(made.by_mcap(tmp_path / "rec.mcap", messages)) as recording:
        topic = recording["/joints"]
        expected = [
            time
            for time, message in topic
            if dict(zip(message.name, message.position, strict=False)).get("a", 0) > 1
        ]
        chosen = topic.where("position.a", ">", 1)
        assert [time for time, _ in chosen] == expected
        assert len(expected) == 4
        assert chosen.absent == 12
        assert [time for time, _ in topic.where("position.a", ">", "1").messages()] == expected
        with pytest.raises(ValueError, match="is a float64, which is not compared"):
            topic.where("position.a", ">", "x")
        chosen = topic.where("position.c", "==", 9).where("position.aa", "==", 1)
        with pytest.warns(MissingElementWarning, match="no `aa` in any of 4 messages: it has c"):
            assert list(chosen) == []


@pytest.mark.parametrize("case", AMBIGUOUS)
def test_a_condition_on_an_element_that_names_do_not_tell_is_an_error(case, tmp_path):
    names, position, error = AMBIGUOUS[case]
    found = [joints(0, ["a", "b"], [1, 2]), joints(1, names, position)]
    with (
        idlc.Recording(made.by_mcap(tmp_path / "rec.mcap", found)) as recording,
        pytest.raises(RecordingError, match=error),
    ):
        list(recording["/joints"].where("position.a", ">", 0))


def test_times_of_a_header_select_as_log_times_do(recording):
    topic = recording["/imu"]
    stamps = [
        message.header.stamp.sec * 10**9 + message.header.stamp.nanosec for _, message in topic
    ]
    first, last = stamps[3], stamps[7]
    chosen = topic.between(first, last, by="header.stamp")
    assert [time for time, _ in chosen] == [time for time, _ in topic][3:7]
    assert [time for time, _ in topic.between(np.datetime64(first, "ns"), by="header.stamp")] == [
        time for time, _ in topic
    ][3:]
    later = topic.between("1", timedelta(seconds=2), by="header.stamp")
    assert 0 < len(list(later)) < len(stamps)


def test_fields_of_messages(recording):
    topic = recording["/camera/image"]
    messages = [message for _, message in topic]
    assert [value for _, value in topic.messages(fields="width")] == [m.width for m in messages]
    pairs = [values for _, values in topic.messages(fields=["width", "header.frame_id"])]
    assert pairs == [(message.width, message.header.frame_id) for message in messages]
    with pytest.raises(RecordingError, match=r"message \d+ of `/joints` is broken: position\[3\]"):
        list(recording["/joints"].messages(fields="position[3]"))


WRONG = {
    ("widht", "<", 3): "did you mean `width`",
    ("width", "=", 3): "is not one of",
    ("width", "<", "many"): "not compared with 'many'",
    ("width", "<", True): "not compared with True",
    ("width", "<", None): "not compared with None",
    ("encoding", "==", 3): "not compared with 3",
    ("data", "==", 3): "not a single value",
    ("data[*]", "==", 3): "many values",
    ("header", "==", 3): "not a single value",
    ("data.x", "==", 3): "write an index, such as `data",
    ("header.stamp", "==", True): "not compared with True",
}


@pytest.mark.parametrize(("path", "sign", "value"), WRONG)
def test_a_wrong_condition_is_refused_at_once(recording, path, sign, value):
    with pytest.raises(ValueError, match=WRONG[path, sign, value]):
        recording["/camera/image"].where(path, sign, value)


def test_a_broken_message_is_named_after_those_before_it(tmp_path):
    broken = [
        one._replace(data=one.data[:12]) if number == 15 else one
        for number, one in enumerate(MESSAGES[::3])
    ]
    path = made.by_mcap(tmp_path / "rec.mcap", broken)
    with idlc.Recording(path) as recording:
        topic = recording["/imu"]
        for messages in (
            topic.messages(),
            topic.messages(fields="linear_acceleration.z"),
            topic.where("linear_acceleration.z", ">=", -1).messages(),
        ):
            times = []
            with pytest.raises(RecordingError, match="message 15 of `/imu` is broken"):  # noqa: PT012
                for time, _ in messages:
                    times.append(time)
            assert len(times) == 15


def test_columns_takes_conditions(tmp_path, monkeypatch, capsys):
    from pyarrow import parquet

    monkeypatch.chdir(tmp_path)
    made.by_mcap(tmp_path / "rec.mcap", MESSAGES)
    words = ["columns", "rec.mcap", "/joints", "-o", "a.parquet", "--force", "--where"]
    assert main([*words, "position[0] > 0.5", "--where", "header.frame_id == ''"]) == 0
    assert "messages do not have a field of --where" in capsys.readouterr().err
    with idlc.Recording("rec.mcap") as recording:
        chosen = recording["/joints"].where("position[0]", ">", 0.5)
        expected = len(list(chosen.where("header.frame_id", "==", "")))
    assert parquet.read_table("a.parquet").num_rows == expected > 0
    for text, problem in {
        "position": "is not a condition",
        "__import__('os')": "is not a condition",
        "positoin[0] > 1": "did you mean `position`",
        "name.elbow == 'x'": "`name` is a list: write `name[0]`",
    }.items():
        assert main([*words, text]) == 2
        assert problem in capsys.readouterr().err
    Path("a b").mkdir()
    Path("rec.mcap").rename("a b/rec.mcap")
    for more in (["/joints", "--where", "positoin > 1"], ["/joints:positoin", "--grid", "1s"]):
        assert main(["columns", "a b/rec.mcap", *more, "-o", "b.csv"]) == 2
        assert "`idlc show 'a b/rec.mcap' /joints` lists" in capsys.readouterr().err
