"""Columns that few types have, in each format: of nothing, of bytes, of lists of times."""

import csv
import json
import pickle
from base64 import b64encode

import pyarrow as pa
import pytest
from mcap.writer import Writer
from pyarrow import parquet

import idlc
from idlc.cli.main import main
from idlc.model.ir import DUMMY_FIELD
from idlc.recordings.containers.source import RecordingError
from tests.support import recorded_text
from tests.support import recordings as made

DEFINITIONS = {
    "Nothing": "",
    "Holds": "Nothing one\nint32 a\n",
    "HoldsOnly": "Nothing one\n",
    "HoldsMany": "Nothing[] many\nNothing[2] two\nHolds[] deep\nHoldsOnly[2] deeper\n",
    "Bytes": "byte one\nbyte[3] three\nuint8[] many\nuint8[16] id\nBytesInside[] inside\n",
    "BytesInside": "uint8[2] two\nbyte[] many\n",
    "Texts": "wstring wide\nwstring[] wides\nstring<=3[<=2] short\nTexts2[2] twice\n",
    "Texts2": "string[] a\nwstring[2] b\n",
    "Times": "builtin_interfaces/Time t\nbuiltin_interfaces/Time[] ts\nTimes2[] in\n",
    "Times2": "builtin_interfaces/Duration[2] ds\nbuiltin_interfaces/Time t\n",
    "Unsent": "Holds[] a\nstring b\nuint8[2] c\nTimes[] d\n",
}
BUILT_IN = {
    f"builtin_interfaces/{name}": "int32 sec\nuint32 nanosec\n" for name in ("Time", "Duration")
}
#: Messages of these types by fields; there are none of the last.
VALUES = {
    "Nothing": [{}] * 3,
    "Holds": [{"a": 5}] * 2,
    "HoldsOnly": [{}] * 2,
    "HoldsMany": [
        {"many": [{}] * 3, "deep": [{"a": 1}, {"a": 2}]},
        {},
        {"many": [{}], "deep": [{"a": 3}]},
    ],
    "Bytes": [
        {"one": b"\x01", "three": [b'"', b",", b"\n"], "many": [0, 34], "id": [255] * 16},
        {"inside": [{"two": [0, 10], "many": [b"\xff"]}, {}]},
    ],
    "Texts": [
        {"wide": "a,é𝄞", "wides": ["", '"\n'], "short": ["abc"], "twice": [{"a": ["é"]}, {}]},
        {},
    ],
    "Times": [
        {"t": {"sec": 1, "nanosec": 1}, "ts": [{"sec": 1_700_000_000, "nanosec": 123456789}] * 2},
        {"in": [{"ds": [{"sec": -1, "nanosec": 7}, {}], "t": {"sec": 3, "nanosec": 1}}]},
    ],
    "Unsent": [],
}


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("odd_msgs")
    (folder / "msg").mkdir()
    for name, text in DEFINITIONS.items():
        (folder / "msg" / f"{name}.msg").write_text(text, encoding="utf-8")
    classes = idlc.load(folder, include=[folder.parent])
    package = folder.name
    line = "=" * 80
    with (folder / "odd.mcap").open("wb") as file:
        writer = Writer(file, chunk_size=100)
        writer.start()
        known = {f"{package}/{name}": text for name, text in DEFINITIONS.items()} | BUILT_IN
        others = [f"{line}\nMSG: {name}\n{text}" for name, text in known.items()]
        for name, values in VALUES.items():
            text = DEFINITIONS[name] + "\n".join(others)
            schema = writer.register_schema(f"{package}/msg/{name}", "ros2msg", text.encode())
            channel = writer.register_channel(f"/{name}", "cdr", schema)
            for number, fields in enumerate(values):
                data = getattr(classes, name).from_dict(fields).serialize()
                writer.add_message(channel, number, data, number)
        writer.finish()
    return folder / "odd.mcap"


def read(recording, topic):
    """Return what messages hold, read one by one."""
    with idlc.Recording(recording) as opened:
        return [made.plain(message.to_dict()) for _, message in opened[topic]]


def without_times(rows):
    return [
        {key: row[key] for key in row if key not in ("log_time", "publish_time")} for row in rows
    ]


def without_dummies(value):
    """Return a value without what stands in messages that have no fields."""
    if isinstance(value, dict):
        assert value.pop(DUMMY_FIELD, 0) == 0
        return {name: without_dummies(one) for name, one in value.items()}
    return [without_dummies(one) for one in value] if isinstance(value, list) else value


def written(recording, topic, path, *options):
    assert main(["columns", str(recording), topic, "-o", str(path), *options]) == 0
    return path


@pytest.mark.parametrize("name", VALUES)
def test_parquet_and_arrow_hold_what_messages_do(name, recording, tmp_path):
    wanted = read(recording, f"/{name}")
    assert len(wanted) == len(VALUES[name])
    plainly = ("--nested", "--no-datetimes")
    stored = parquet.read_table(written(recording, f"/{name}", tmp_path / "a.parquet", *plainly))
    assert without_dummies(made.plain(without_times(stored.to_pylist()))) == wanted
    assert stored.schema.metadata[b"ros2.type"].endswith(b"/" + name.encode())
    with pa.ipc.open_file(written(recording, f"/{name}", tmp_path / "a.arrow", *plainly)) as file:
        found = file.read_all()
    assert made.plain(without_times(found.to_pylist())) == wanted
    with idlc.Recording(recording) as opened:
        flat = opened[f"/{name}"].to_arrow(flat=True, datetimes=True)
    stored = parquet.read_table(written(recording, f"/{name}", tmp_path / "b.parquet"))
    assert stored.schema.names == flat.schema.names
    assert without_dummies(stored.to_pylist()) == flat.to_pylist()


def as_cells(row, prefix=""):
    """Yield name and text of each cell of a row, as a person would write it."""
    for name, value in row.items():
        if isinstance(value, dict):
            yield from as_cells(value, f"{prefix}{name}.")
        elif isinstance(value, bytes):
            yield prefix + name, b64encode(value).decode()
        elif isinstance(value, list):
            text = json.dumps(value, default=lambda one: b64encode(one).decode())
            yield prefix + name, json.loads(text)
        else:
            yield prefix + name, str(value)


@pytest.mark.parametrize("name", VALUES)
def test_csv_has_plain_cells_and_json(name, recording, tmp_path):
    path = written(recording, f"/{name}", tmp_path / "a.csv", "--no-datetimes")
    with path.open(newline="", encoding="utf-8") as file:
        found = [
            {key: json.loads(cell) if cell[:1] == "[" else cell for key, cell in row.items()}
            for row in csv.DictReader(file)
        ]
    with idlc.Recording(recording) as opened:
        wanted = opened[f"/{name}"].to_arrow().to_pylist()
    assert without_times(found) == [dict(as_cells(row)) for row in without_times(wanted)]


def test_times_in_lists_keep_their_nanoseconds(recording, tmp_path):
    """As columns of times and durations have them, though Python itself has no such times."""
    path = written(recording, "/Times", tmp_path / "a.csv")
    with path.open(newline="", encoding="utf-8") as file:
        first, second = csv.DictReader(file)
    assert first["t"] == "1970-01-01 00:00:01.000000001"
    assert json.loads(first["ts"]) == ["2023-11-14 22:13:20.123456789"] * 2
    inside = {"ds": [-999_999_993, 0], "t": "1970-01-01 00:00:03.000000001"}
    assert json.loads(second["in"]) == [inside]


def test_what_a_recording_does_not_define_is_looked_for_and_that_is_said(tmp_path, capfd):
    """As with recordings of Humble, in which there are no definitions and no hashes."""
    path = recorded_text.write(tmp_path / "a.mcap", "@ /x own_msgs/msg/Pair unknown\n", {"/x": 2})
    assert main(["columns", str(path), "-o", str(tmp_path / "a.csv")]) == 1
    assert "the recording does not define `own_msgs/msg/Pair`" in capfd.readouterr().err
    (tmp_path / "own_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "own_msgs" / "msg" / "Pair.msg").write_text("int8 a", encoding="utf-8")
    words = ("-I", str(tmp_path / "own_msgs"))
    assert main(["columns", str(path), "-o", str(tmp_path / "a.csv"), *words]) == 0
    assert "warning[IDL652]: `/x`: the recording does not define" in capfd.readouterr().err
    with idlc.Recording(path, include=[tmp_path]) as opened:
        (part,) = opened["/x"].parts()
        with pytest.warns(UserWarning, match="not define `own_msgs/msg/Pair`"):
            assert pickle.loads(pickle.dumps(part)).to_arrow().num_rows == 2
    with (
        idlc.Recording(path, include=["nowhere"]) as opened,
        pytest.raises(RecordingError, match="nowhere"),
    ):
        opened["/x"].to_arrow()
