"""Tables of pandas and polars: flat names, and times as times."""

import subprocess
import sys

import numpy as np
import pytest

import idlc
from tests.support import recordings as made

MESSAGES = made.messages()
DEFINITIONS = {
    "Odd": (
        "builtin_interfaces/Time[] times\nbuiltin_interfaces/Duration[2] both\nstring[2] texts\n"
        "std_msgs/Header[] headers\nuint8[] data\nuint8[3] three\nbool[] flags\nfloat64[] numbers\n"
        "builtin_interfaces/Time at\nbuiltin_interfaces/Duration for\nbool[2] pair\n"
    ),
    "Empty": "",
}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return made.by_mcap(tmp_path_factory.mktemp("frames") / "rec.mcap", MESSAGES)


@pytest.fixture(scope="module")
def types(tmp_path_factory):
    folder = tmp_path_factory.mktemp("types") / "frame_msgs"
    (folder / "msg").mkdir(parents=True)
    for name, text in DEFINITIONS.items():
        (folder / f"msg/{name}.msg").write_text(text, encoding="utf-8")
    return idlc.load(str(folder))


@pytest.mark.parametrize("topic", made.MAKERS)
def test_a_topic_is_a_table_of_pandas(path, topic):
    import pandas as pd

    with idlc.Recording(path) as recording:
        frame = recording[topic].to_pandas()
        arrow = recording[topic].to_arrow(flat=True, datetimes=True)
    pd.testing.assert_frame_equal(frame, arrow.to_pandas())
    for name in ("log_time", "publish_time", "header.stamp"):
        assert frame[name].dtype == "datetime64[ns]"
    mine = [each for each in MESSAGES if each.topic == topic]
    assert frame["log_time"].astype("int64").tolist() == [each.log_time for each in mine]
    sent = [made.STORE.deserialize_cdr(each.data, each.type) for each in mine]
    stamps = [each.header.stamp.sec * 10**9 + each.header.stamp.nanosec for each in sent]
    assert frame["header.stamp"].astype("int64").tolist() == stamps
    assert frame["header.frame_id"].tolist() == [each.header.frame_id for each in sent]
    if topic == "/imu":
        assert frame["angular_velocity.z"].tolist() == [each.angular_velocity.z for each in sent]
        assert (
            frame["orientation_covariance"][3].tolist() == sent[3].orientation_covariance.tolist()
        )


@pytest.mark.parametrize("topic", made.MAKERS)
def test_a_topic_is_a_table_of_polars(path, topic):
    import polars as pl

    with idlc.Recording(path) as recording:
        frame = recording[topic].to_polars()
        arrow = recording[topic].to_arrow(flat=True, datetimes=True)
    assert frame.equals(pl.from_arrow(arrow))
    assert frame.schema["log_time"] == frame.schema["header.stamp"] == pl.Datetime("ns")


def test_some_fields_of_a_time_in_a_table(path):
    with idlc.Recording(path) as recording:
        part = recording["/imu"].between("1", "3")
        frame = part.to_pandas(fields=["header.stamp", "angular_velocity.z"])
        assert [*frame] == ["log_time", "publish_time", "header.stamp", "angular_velocity.z"]
        assert len(frame) == len(part.to_polars()) == 6
        assert [*part.to_pandas(fields=["header.stamp.sec"])][2:] == ["header.stamp.sec"]
        # columns are as they were asked for, their tables have times either way
        columns = part.to_columns(fields=["header.stamp"])
        assert columns["log_time"].dtype == np.int64
        assert columns.keys() == ["log_time", "publish_time", "header"]
        assert columns[1:4].to_pandas().equals(frame.iloc[1:4, :3].reset_index(drop=True))
        dated = part.to_columns(fields=["header.stamp"], datetimes=True)
        assert dated.to_pandas().equals(columns.to_pandas())


def test_every_kind_of_field_and_no_messages(types):
    import polars as pl

    time, duration = (idlc.load(f"builtin_interfaces/msg/{name}") for name in ("Time", "Duration"))
    header = idlc.load("std_msgs/msg/Header").Header
    first = types.Odd(at=time.Time(-1, 5), for_=duration.Duration(-1, 999_999_999))
    second = types.Odd(
        times=[time.Time(1, 2), time.Time(-2, 3)],
        headers=[header(stamp=time.Time(7, 1), frame_id="a")],
        texts=["a", "ü"],
        data=b"ab",
        numbers=[np.nan, 1.5],
    )
    columns = types.Odd.to_columns([first.serialize(), second.serialize()])
    frame = columns.to_pandas()
    assert frame["at"].astype("int64").tolist() == [-999_999_995, 0]
    assert frame["for"].dtype == "timedelta64[ns]"
    assert frame["for"].astype("int64").tolist() == [-1, 0]
    assert frame["times"][1].view("i8").tolist() == [1_000_000_002, -1_999_999_997]
    assert frame["texts"][1].tolist() == ["a", "ü"]
    assert frame["data"].tolist() == [b"", b"ab"]
    table = columns.to_polars()
    assert table.schema["times"] == pl.List(pl.Datetime("ns"))
    assert table.schema["both"] == pl.Array(pl.Duration("ns"), 2)
    assert table["headers"][1][0]["frame_id"] == "a"
    assert table.schema["headers"].inner.fields[0].dtype == pl.Datetime("ns")
    # a table of no messages has the same types
    none = types.Odd.to_columns([])
    assert none.to_polars().schema == table.schema
    assert none.to_pandas().dtypes.to_dict() == frame.dtypes.to_dict()
    assert len(types.Empty.to_columns([types.Empty().serialize()] * 3).to_pandas()) == 3


@pytest.mark.parametrize("library", ["pandas", "polars", "pyarrow"])
def test_a_library_that_is_missing_is_named(path, library):
    method = "to_polars" if library == "polars" else "to_pandas"
    code = (
        f"import sys\nsys.modules[{library!r}] = None\nimport idlc\n"
        f"with idlc.Recording({str(path)!r}) as recording:\n"
        f"    columns = recording['/imu'].to_columns()\n"
        "    assert not {'pandas', 'polars', 'pyarrow'} & {*filter(sys.modules.get, sys.modules)}\n"
        "    try:\n"
        f"        columns.{method}()\n"
        "    except ImportError as error:\n"
        "        print(error.name, error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith(f"{library} {method} needs {library}, which cannot be imported")
    assert done.stdout.endswith(f": pip install {library}\n")
