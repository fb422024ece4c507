"""Messages as tables of Arrow; that these hold what messages hold is tested with the columns."""

import json
import random
import subprocess
import sys

import pyarrow as pa
import pyarrow.parquet
import pytest

from tests.support import generated
from tests.support.columns import buffers_of, messages_of

FILES = {
    "msg/Point.msg": "float64 x\nfloat64 y\n",
    "msg/Head.msg": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "msg/Kinds.msg": (
        "# Comments are kept.\nbool a\nbyte b\nchar c\nint8 d\nuint8 e\nint16 f\nuint16 g\n"
        "int32 h\nuint32 i\nint64 j\nuint64 k\nfloat32 l\nfloat64 m\nstring n\nwstring<=5 o\n"
        "Head p\nint8 A=5\n"
    ),
    "msg/Lists.msg": (
        "uint8[] a\nbyte[<=3] b\nchar[4] c\nint8[] d\nbool[] e\nbool[3] f\nfloat32[2] g\n"
        "string[] h\nwstring[2] i\nPoint[] j\nPoint[3] k\nHead[<=2] l\nuint8[2] m\n"
    ),
    "msg/Plain.msg": "Head[<=2] headers\nPoint[3] points\nstring<=4 text\n",
    "srv/Ask.srv": "Point[<=2] points\n---\nstring<=3[4] words\n",
}
STAMP = pa.struct([("sec", pa.int32()), ("nanosec", pa.uint32())])
HEADER = pa.struct([("stamp", STAMP), ("frame_id", pa.large_string())])
POINT = pa.struct([("x", pa.float64()), ("y", pa.float64())])


@pytest.fixture(scope="module")
def folder(tmp_path_factory, standard_folder):
    folder = tmp_path_factory.mktemp("arrow")
    generated.write_package(folder, "arrow_msgs", FILES)
    (folder / "builtin_interfaces").symlink_to(standard_folder / "builtin_interfaces")
    with generated.importable(folder):
        yield folder


@pytest.fixture
def msg(folder):
    return __import__("arrow_msgs.msg").msg


def raws_of(cls, count=30, seed=1):
    rng = random.Random(seed)
    return buffers_of(messages_of(cls, rng, count, 4), rng)


def test_the_types_of_columns(msg):
    plain = [pa.bool_(), pa.uint8(), pa.uint8(), pa.int8(), pa.uint8(), pa.int16(), pa.uint16()]
    plain += [pa.int32(), pa.uint32(), pa.int64(), pa.uint64(), pa.float32(), pa.float64()]
    plain += [pa.large_string(), pa.large_string(), HEADER]
    assert msg.Kinds.to_arrow([]).schema.types == plain
    assert msg.Kinds.to_arrow(raws_of(msg.Kinds)).schema.types == plain
    lists = [pa.large_binary(), pa.large_binary(), pa.binary(4), pa.large_list(pa.int8())]
    lists += [pa.large_list(pa.bool_()), pa.list_(pa.bool_(), 3), pa.list_(pa.float32(), 2)]
    lists += [pa.large_list(pa.large_string()), pa.list_(pa.large_string(), 2)]
    lists += [pa.large_list(POINT), pa.list_(POINT, 3), pa.large_list(HEADER), pa.binary(2)]
    assert msg.Lists.to_arrow([]).schema.types == lists
    table = msg.Lists.to_arrow(raws_of(msg.Lists))
    assert table.schema.types == lists
    assert all(column.null_count == 0 for column in table.columns)


def test_names_for_tables_that_are_flat(msg):
    raws = raws_of(msg.Kinds)
    nested, flat = msg.Kinds.to_arrow(raws), msg.Kinds.to_arrow(raws, flat=True)
    assert flat.column_names[-4:] == ["o", "p.stamp.sec", "p.stamp.nanosec", "p.frame_id"]
    assert flat["p.frame_id"].to_pylist() == [one["frame_id"] for one in nested["p"].to_pylist()]
    assert flat.num_rows == nested.num_rows == 30
    assert flat.schema.metadata == nested.schema.metadata
    times = msg.Kinds.to_arrow(raws, flat=True, datetimes=True, fields=["p.stamp", "a"])
    assert times.column_names == ["a", "p.stamp"]
    lists = msg.Lists.to_arrow(raws_of(msg.Lists), flat=True)
    assert lists.schema.field("j").type == pa.large_list(POINT)


def test_texts_as_a_dictionary(msg):
    raws = raws_of(msg.Lists)
    found, wanted = msg.Lists.to_arrow(raws, dictionary=True), msg.Lists.to_arrow(raws)
    text = pa.dictionary(pa.int32(), pa.large_string())
    assert found.schema.field("h").type == pa.large_list(text)
    found.validate(full=True)
    assert found.to_pylist() == wanted.to_pylist()


def test_what_the_metadata_says(msg, folder):
    metadata = {
        key.decode(): value.decode()
        for key, value in msg.Kinds.to_arrow([]).schema.metadata.items()
    }
    definition = metadata.pop("ros2.definition")
    hashes = generated.type_data(folder / "arrow_msgs")["hashes"]
    assert metadata == {
        "ros2.type": "arrow_msgs/msg/Kinds",
        "ros2.hash": hashes["arrow_msgs/msg/Kinds"],
    }
    line = "=" * 80
    top, header, time = definition.split(f"{line}\n")
    assert top == FILES["msg/Kinds.msg"]
    assert header == "MSG: arrow_msgs/Head\n" + FILES["msg/Head.msg"]
    assert time == "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    srv = __import__("arrow_msgs.srv").srv
    for kind, text in (
        (srv.Ask.Request, "arrow_msgs/Point[<=2] points\n"),
        (srv.Ask.Response, "string<=3[4] words\n"),
    ):
        definition = kind.to_arrow([]).schema.metadata[b"ros2.definition"].decode()
        assert definition.startswith(text)


def test_the_definition_is_one_that_rosbags_reads_by(msg):
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    name = "arrow_msgs/msg/Plain"
    message = messages_of(msg.Plain, random.Random(2), 1, 4)[0]
    metadata = msg.Plain.to_arrow([]).schema.metadata
    definition = metadata[b"ros2.definition"].decode()
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, name))
    read = store.deserialize_cdr(message.serialize(), name)
    assert [one.frame_id for one in read.headers] == [one.frame_id for one in message.headers]
    assert (read.points[2].y, read.text) == (message.points[2].y, message.text)
    assert store.hash_rihs01(name) == metadata[b"ros2.hash"].decode()


@pytest.mark.parametrize("name", ["Kinds", "Lists"])
def test_a_file_of_parquet_holds_the_same(msg, tmp_path, name):
    cls = getattr(msg, name)
    table = cls.to_arrow(raws_of(cls, 200), datetimes=True)
    pa.parquet.write_table(table, tmp_path / "file.parquet")
    read = pa.parquet.read_table(tmp_path / "file.parquet")
    assert read.schema.metadata == table.schema.metadata
    assert read.equals(table)


def test_messages_without_fields_have_rows(folder, tmp_path):
    generated.write_package(
        tmp_path, "none_msgs", {"msg/None.msg": "", "msg/In.msg": "None a\nint8 b\n"}
    )
    with generated.importable(tmp_path):
        none = generated.class_of("none_msgs/msg/None_")
        inside = generated.class_of("none_msgs/msg/In")
        assert none.to_arrow([none().serialize()] * 3).num_rows == 3
        assert none.to_arrow([none().serialize()] * 3, flat=True).num_rows == 3
        table = inside.to_arrow([inside(b=5).serialize()] * 2, flat=True)
        assert table.to_pylist() == [{"b": 5}] * 2


CODE = """
import json, sys
sys.path.insert(0, sys.argv[1])
from arrow_msgs.msg import Lists
raw = Lists().serialize()
before = {"numpy", "pyarrow"} & set(sys.modules)
if sys.argv[2:]:
    sys.modules["pyarrow"] = None
    try:
        Lists.to_arrow([raw])
    except ImportError as error:
        print(json.dumps([error.name, str(error)]))
else:
    Lists.to_columns([raw])
    between = {"pyarrow"} & set(sys.modules)
    Lists.to_arrow([raw])
    print(json.dumps([list(before), list(between), "pandas" in sys.modules]))
"""


def run(folder, *words):
    done = subprocess.run(
        [sys.executable, "-c", CODE, folder, *words], capture_output=True, text=True, check=False
    )
    assert not done.stderr
    return json.loads(done.stdout)


def test_nothing_is_imported_before_its_time(folder):
    before, between, pandas = run(folder)
    assert "pyarrow" not in before
    assert not between
    assert not pandas


def test_without_pyarrow_it_is_said_how_to_get_it(folder):
    name, text = run(folder, "without")
    assert name == "pyarrow"
    assert "pip install pyarrow" in text
