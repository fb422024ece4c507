"""Elements of lists as columns, by the names beside them or by index."""

import random

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

import idlc
from idlc.cli.main import main
from idlc.recordings.columns.elements import MissingElementWarning
from idlc.recordings.containers.source import RecordingError
from tests.support import recorded_text
from tests.support import recordings as made
from tests.support.rounds import rounds

MS = 1_000_000
NAMES = ["a", "b", "ab", "ä", "arm/b.c[0]", ""]


def recorded(index, names, position, velocity=()):
    """Return the message of some joints, 100 ms after the one before."""
    type_ = "sensor_msgs/msg/JointState"
    time = made.START + index * 100 * MS
    arrays = (np.array(values, float) for values in (position, velocity, ()))
    message = made.kind(type_)(made.header(random.Random(1), time), names, *arrays)
    return made.Recorded(
        "/joints", type_, time, time, bytes(made.STORE.serialize_cdr(message, type_))
    )


@pytest.mark.filterwarnings("ignore::idlc.recordings.columns.elements.MissingElementWarning")
def test_elements_are_those_that_dictionaries_have(tmp_path):
    fields = [f"position.{name}" for name in NAMES if name] + ["velocity.ab", "position[1]"]
    for seed in range(rounds(12)):
        rng, messages, rows = random.Random(seed), [], []
        for index in range(rng.randrange(1, 40)):
            names = rng.sample(NAMES, rng.randrange(len(NAMES)))
            position = [rng.random() for _ in names]
            velocity = position[::-1] if rng.random() < 0.5 else []
            messages.append(recorded(index, names, position, velocity))
            values = dict(zip(names, position, strict=True))
            row = {f"position.{name}": values.get(name) for name in NAMES if name}
            row["velocity.ab"] = dict(zip(names, velocity, strict=False)).get("ab")
            rows.append(row | {"position[1]": position[1] if len(position) > 1 else None})
        path = made.by_mcap(tmp_path / "a.mcap", messages, chunk_size=rng.choice([200, 5000]))
        with idlc.Recording(path) as recording:
            table = recording["/joints"].to_arrow(fields=fields)
            assert table.select(fields).to_pylist() == rows
            columns = recording["/joints"].to_columns(fields=fields).to_list()
            assert [{name: row[name] for name in fields} for row in columns] == rows
            aligned = recording.aligned({"/joints": fields}, on="/joints").to_arrow()
            named = [f"/joints.{name}" for name in fields]
            assert aligned.select(named).rename_columns(fields).to_pylist() == rows


#: The names and positions of messages -> the message of the error.
AMBIGUOUS = {
    "twice": (["a", "b", "a"], [1, 2, 3], r"message 1 .*`name` has `a` more than once"),
    "fewer": (["b", "a"], [1], r"message 1 .*`name` has 2 names, and `position` has 1 elements"),
    "more": (["a"], [1, 2], r"message 1 .*`name` has 1 names, and `position` has 2 elements"),
}


@pytest.mark.filterwarnings("ignore::idlc.recordings.columns.elements.MissingElementWarning")
@pytest.mark.parametrize("case", AMBIGUOUS)
def test_names_that_do_not_name_one_element_are_an_error(case, tmp_path):
    names, position, message = AMBIGUOUS[case]
    found = [recorded(0, ["a", "b"], [1, 2]), recorded(1, names, position)]
    with idlc.Recording(made.by_mcap(tmp_path / "a.mcap", found)) as recording:
        for read in (
            lambda: recording["/joints"].to_arrow(fields=["position.a"]),
            lambda: recording.aligned({"/joints": "position.a"}, every="10ms").to_arrow(),
        ):
            with pytest.raises(RecordingError, match=message):
                read()
        names = [f"position.{name}" for name in ("c", "d")]
        assert recording["/joints"].to_arrow(fields=names)["position.c"].null_count == 2


def test_lines_follow_the_names(tmp_path):
    found = [
        recorded(0, ["a", "b"], [0, 10]),
        recorded(1, ["b", "a"], [20, 1]),
        recorded(2, ["b"], [30]),
    ]
    with idlc.Recording(made.by_mcap(tmp_path / "a.mcap", found)) as recording:
        topics = {"/joints": ["position.a", "position.b"]}
        table = recording.aligned(topics, every="50ms", how="linear").to_arrow()
    assert table["/joints.position.a"].to_pylist() == [0, 0.5, 1, None, None]
    assert table["/joints.position.b"].to_pylist() == [10, 15, 20, 25, 30]


def test_lines_lie_between_arrays_only_if_nothing_names_their_elements(tmp_path):
    text = "@ /a p/A\nfloat64[2] x\n@ /b p/B\nfloat64[2] x\nstring[2] y\n@ /c p/C\nfloat64[] x\n"
    with idlc.Recording(recorded_text.write(tmp_path / "a.mcap", text)) as recording:
        assert recording.aligned({"/a": "x"}, every="1s", how="linear").to_arrow().num_rows == 0
        for topic in ("/b", "/c"):
            with pytest.raises(RecordingError, match=f"no values between those of `{topic}.x`"):
                recording.aligned({topic: "x"}, every="1s", how="linear")


TEXTS = {
    "Point": "float64[] positions\n",
    "State": "string[] joint_names\nbool[3] inputs\nPoint point  # of each joint\nfloat32[2] pair",
    "Two": "string[] left\nstring[] right\nfloat64[] values\nPoint[] points\n",
    "None": "float64[] values\n",
}


@pytest.fixture
def types(tmp_path):
    for name, text in TEXTS.items():
        path = tmp_path / f"my_robot/msg/{name}.msg"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return idlc.load(str(tmp_path / "my_robot")).my_robot.msg


def test_names_may_be_in_a_message_around(types):
    message = types.State(joint_names=["x", "y"], inputs=[True, False, True])
    message.point.positions = [1.0, 2.0]
    fields = ["point.positions.y", "point.positions.x", "inputs[2]", "inputs"]
    raws = [message.serialize(), types.State().serialize()]
    table = types.State.to_arrow(raws, fields=fields, flat=True)
    assert table.to_pylist() == [
        {
            "inputs": [True, False, True],
            "inputs[2]": True,
            "point.positions.y": 2,
            "point.positions.x": 1,
        },
        {
            "inputs": [False, False, False],
            "inputs[2]": False,
            "point.positions.y": None,
            "point.positions.x": None,
        },
    ]
    with pytest.raises(ValueError, match=r"\[1\].point.positions.y: is missing"):
        types.State.to_columns(raws, fields=fields).structured()


#: A type and a path -> the message of the error.
REFUSED = {
    ("State", "inputs[3]"): r"`inputs` has 3 elements, and no `inputs\[3\]`",
    ("State", "joint_names[0]"): "no field 'joint_names",
    ("State", "point[0].positions"): "no field 'point",
    ("State", "pair.x.y[0]"): None,
    ("State", "pair[-1]"): "no field 'pair",
    ("State", "pair[0"): "no field 'pair",
    ("State", "pair[0].x"): "no field 'pair",
    ("State", "pair."): "no field 'pair",
    (
        "Two",
        "values.a",
    ): "`left` and `right` may name its elements; write an index",
    ("Two", "points[0].positions"): "no field 'points",
    ("None", "values.a"): "no field .values.a.: no list of texts names its",
}


@pytest.mark.parametrize(("name", "path"), REFUSED)
def test_paths_that_lead_to_no_element_are_refused(name, path, types):
    if message := REFUSED[name, path]:
        with pytest.raises(ValueError, match=message):
            getattr(types, name).to_columns([], fields=[path])
    else:
        assert getattr(types, name).to_columns([], fields=[path]).keys() == [path]


def test_a_name_that_no_message_has_is_noted(here, capfd):
    made.by_mcap(here / "a.mcap", [recorded(0, ["elbow", "wrist"], [1, 2])])
    with (
        idlc.Recording("a.mcap") as recording,
        pytest.warns(MissingElementWarning, match="did you mean `elbow`"),
    ):
        recording["/joints"].to_arrow(fields=["position.elbo"])
    words = ["columns", "a.mcap", "/joints", "--fields", "position.wrist,position.hip"]
    assert main([*words, "-o", "a.parquet"]) == 0
    assert "note: `name` has no `hip` in any of 1 messages: it has elbow" in capfd.readouterr().err
    table = parquet.read_table("a.parquet")
    assert table["position.wrist"].to_pylist() == [2]
    assert table.schema.field("position.hip").type == pa.float64()
    assert main([*words, "--format", "text"]) == 0
    grid = ["columns", "a.mcap", "/joints:position.wrist,position[0]", "--grid", "/joints"]
    assert main([*grid, "-o", "b.csv"]) == 0
    assert (here / "b.csv").read_text(encoding="utf-8").splitlines()[1].endswith(",2,1,0")


def test_each_element_of_a_list_of_messages_is_a_row(here, capfd):
    found = [message for message in made.varied(30) if message.topic in ("/TFMessage", "/Path")]
    made.by_mcap(here / "a.mcap", found, chunk_size=800)
    fields = ["child_frame_id", "transform.rotation"]
    wanted = []
    for message in (message for message in found if message.topic == "/TFMessage"):
        for each in made.STORE.deserialize_cdr(message.data, message.type).transforms:
            turn = made.plain(each.transform.rotation)
            row = {"log_time": message.log_time, "child_frame_id": each.child_frame_id}
            wanted.append(row | {f"transform.rotation.{axis}": turn[axis] for axis in "xyzw"})
    assert len(wanted) > 20
    with idlc.Recording("a.mcap") as recording:
        tf = recording["/TFMessage"]
        options = {"each": "transforms", "flat": True, "datetimes": True}
        table = tf.to_arrow(fields=fields, **options)
        table = table.set_column(0, "log_time", table["log_time"].cast(pa.int64()))
        assert table.drop_columns("publish_time").to_pylist() == wanted
        whole = tf.to_reader(**options).read_all()
        nested = tf.to_arrow(each="transforms")
        assert nested["transform"].type.field("rotation").type.field("x").type == pa.float64()
        for name in ("header", "transforms.header", "x"):
            with pytest.raises(ValueError, match=f"`{name}`|no field '{name}'"):
                tf.to_arrow(each=name)
        assert recording["/Path"].to_arrow(each="poses", fields="pose").num_rows > 20
    words = ["columns", "a.mcap", "/TFMessage", "--each", "transforms"]
    assert main([*words, "-o", "tf.parquet"]) == 0
    assert f"/TFMessage: {len(wanted)} rows → tf.parquet" in capfd.readouterr().err
    assert parquet.read_table("tf.parquet").equals(whole)
    assert main([*words, "--format", "text"]) == 0
    assert f"tf2_msgs/msg/TFMessage  {len(wanted)} rows in " in capfd.readouterr().out
    assert main([*words[:3], "--each", "transform", "-o", "b.parquet"])
    assert "has no field 'transform'; did you mean 'transforms'" in capfd.readouterr().err
