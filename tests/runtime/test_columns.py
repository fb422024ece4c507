"""Columns of any messages hold what the messages hold, and refuse what these refuse."""

import random
import struct
from contextlib import suppress
from copy import deepcopy

import numpy as np
import pytest

from idlc.model import catalog
from tests.support import generated, values
from tests.support.columns import (
    batch_of,
    buffers_of,
    check,
    dotted,
    make_even,
    messages_of,
    selected,
)
from tests.support.examples import given, settings, st
from tests.support.layouts import random_package
from tests.support.rounds import rounds

FILES = {
    "msg/Point.msg": "float64 x\nfloat64 y\nfloat64 z\n",
    "msg/Odd.msg": "uint8 a\nuint16 b\nuint8 c\n",
    "msg/Gaps.msg": "uint8 a\nfloat64 b\nuint16 c\nint32 d\nbool e\n",
    "msg/Byte.msg": "uint8 a\n",
    "msg/Empty.msg": "",
    "msg/Header.msg": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "msg/Joints.msg": "Header header\nstring[] name\nfloat64[] position\nbool[] moving\n",
    "msg/Deep.msg": (
        "Joints[] joints\nGaps[] gaps\nOdd[3] odds\nstring[2] pair\n"
        "Point[2] points\nPoint[] path\nEmpty[] empty\nuint8[] data\nbyte[4] four\nbool end\n"
    ),
    "msg/Deeper.msg": "uint8 n\nDeep[<=9] deep\nGaps[2] gaps\nEmpty empty\nint16 last\n",
    "msg/Wide.msg": "wstring[] wide\nuint8 n\nOdd[2] odds\nwstring<=9 text\nbool end\n",
    "msg/Image.msg": "Header header\nuint32 width\nuint8[] data\nfloat32[] gains\nbool last\n",
    "msg/Times.msg": (
        "builtin_interfaces/Time at\nbuiltin_interfaces/Duration[] after\n"
        "builtin_interfaces/Time[2] two\nHeader header\n"
    ),
}
NAMES = [path[4:-4] for path in FILES]
SEEDS = range(100, 112)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, standard_folder):
    folder = tmp_path_factory.mktemp("columns")
    generated.write_package(folder, "column_msgs", FILES)
    for seed in SEEDS:
        files, _ = random_package(random.Random(seed))
        generated.write_package(folder, f"p{seed}_msgs", files)
    (folder / "builtin_interfaces").symlink_to(standard_folder / "builtin_interfaces")
    with generated.importable(folder):
        yield folder


def class_of(name):
    return generated.class_of(f"column_msgs/msg/{name}")


@pytest.fixture
def msg(folder):
    return __import__("column_msgs.msg").msg


@pytest.fixture
def error(folder):
    return __import__("column_msgs._idlc")._idlc.DecodeError


# what the columns hold


@settings(max_examples=150)
@given(
    st.sampled_from(NAMES),
    st.integers(0, 40),
    st.sampled_from([1, 2, 4, 30]),
    st.sampled_from([("little",), ("big",), ("little", "big")]),
    st.booleans(),
    st.integers(0, 1 << 30),
)
def test_columns_hold_what_the_messages_hold(folder, name, count, longest, orders, even, seed):
    rng = random.Random(seed)
    cls = class_of(name)
    messages = messages_of(cls, rng, count, longest if name != "Deeper" else 4)
    if even and count:
        make_even(messages[0].to_dict(), messages)
    check(cls, buffers_of(messages, rng, orders), rng)


@pytest.mark.parametrize("seed", SEEDS)
def test_columns_of_any_layout(folder, seed):
    rng = random.Random(seed)
    for number in range(6):
        cls = generated.class_of(f"p{seed}_msgs/msg/T{number}")
        for count in (1, 3, 25):
            check(cls, buffers_of(messages_of(cls, rng, count, 4), rng), rng)


@pytest.mark.usefixtures("standard")
@pytest.mark.parametrize("name", catalog.interfaces(), ids=str)
def test_columns_of_every_interface(name):
    rng = random.Random(str(name))
    for full_name in generated.structures(name):
        cls = generated.class_of(full_name)
        check(cls, buffers_of(messages_of(cls, rng, 14, 4), rng), rng)


@pytest.mark.parametrize("name", NAMES)
def test_only_what_is_wanted_is_read(folder, name):
    rng = random.Random(name)
    cls = class_of(name)
    whole = [values.randomized(cls(), rng, 5) for _ in range(20)]
    buffers = buffers_of(whole, rng)
    for _ in range(15):
        message = rng.choice(whole).to_dict()
        names = list(dotted(message, rng))
        wanted = [selected(one.to_dict(), names) for one in whole]
        columns = cls.to_columns(buffers, fields=iter(names))
        assert repr(columns.to_list()) == repr(wanted)
        if names:
            assert cls.to_arrow(buffers, fields=names).column_names == list(wanted[0])


def test_what_comes_after_the_last_wanted_field_is_not_looked_at(msg, error):
    raw = msg.Image(width=7, data=[1, 2]).serialize()[:-6]
    assert msg.Image.to_columns([raw], fields="width")["width"].tolist() == [7]
    with pytest.raises(error, match=r"^\[0\]\.gains: "):
        msg.Image.to_columns([raw])


def test_a_field_that_there_is_not(msg):
    for names, hint in (
        (["widht"], "column_msgs/msg/Image has no field 'widht'; did you mean 'width'"),
        (["header.stamp.second"], "has no field 'header.stamp.second'; did you mean 'sec'"),
        (["header", "header.id"], "no field 'header.id'"),
        (["data.x"], "no field 'data.x'"),
        ([""], "no field ''"),
    ):
        for read in (msg.Image.to_columns, msg.Image.to_arrow):
            with pytest.raises(ValueError, match=hint):
                read([], fields=names)


def test_large_messages(msg):
    rng = random.Random(3)
    messages = messages_of(msg.Image, rng, 5, 5)
    for message in messages:
        message.data = rng.randbytes(rng.randrange(40_000, 90_000))
    check(msg.Image, buffers_of(messages, rng), rng)
    for message in messages:
        message.data = rng.randbytes(70_000)
    check(msg.Image, buffers_of(messages, rng, ["big"]), rng)


def test_large_messages_with_small_ones_and_long_texts_among_them(msg, error):
    rng = random.Random(4)
    messages = messages_of(msg.Image, rng, 40, 5)
    for message in messages:
        message.header.frame_id = "x" * rng.choice([0, 3, 480, rng.randrange(470, 520), 900])
        message.data = rng.randbytes(rng.choice([0, 1, 200_000, 450_000]))
    raws = buffers_of(messages, rng)
    assert sum(map(len, raws)) > 1 << 22
    check(msg.Image, raws, rng)
    small = min(range(40), key=lambda index: len(raws[index]))
    for wrong in (raws[small][:17], raws[small][:25]):
        with pytest.raises(error, match=rf"^\[{small}\]"):
            msg.Image.to_columns([*raws[:small], wrong, *raws[small + 1 :]])


@pytest.mark.parametrize("name", ["Joints", "Deep", "Deeper", "Wide"])
def test_many_messages_of_a_few_layouts(folder, error, name):
    rng = random.Random(name)
    cls = class_of(name)
    kinds = messages_of(cls, rng, 3, 4)
    numbers = [field for field in ("n", "end", "last", "moving") if hasattr(kinds[0], field)]
    messages = [deepcopy(kinds[min(rng.randrange(6), 2)]) for _ in range(200)]
    for message, other in zip(messages, messages_of(cls, rng, 200, 3), strict=True):
        for field in numbers:
            if not isinstance(getattr(message, field), list):
                setattr(message, field, getattr(other, field))
    raws = buffers_of(messages, rng)
    check(cls, raws, rng)
    for wrong in (0, 150):
        broken = [*raws[:wrong], raws[wrong][:9], *raws[wrong + 1 :]]
        with pytest.raises(error, match=rf"^\[{wrong}\]"):
            cls.to_columns(batch_of(broken, rng))


def test_one_long_sequence_among_short_ones(msg):
    rng = random.Random(4)
    messages = messages_of(msg.Deep, rng, 30, 3)
    messages[7].joints = messages_of(msg.Joints, rng, 300, 4)
    messages[8].gaps = messages_of(msg.Gaps, rng, 300, 4)
    check(msg.Deep, buffers_of(messages, rng), rng)
    check(msg.Deep, buffers_of(messages[7:9], rng, ["little"]), rng)


def test_texts_that_are_no_utf_8(msg):
    texts = [b"", b"\0", b"abc", b"abc\0", b"a\0\0", b"\xff\0", b"\xc3\0", b"\xa9\0", b"\xe4\xb8\0"]
    texts += ["é\0".encode(), b"\xed\xa0\x80\0", b"x" * 40 + b"\x80\0"]
    head = b"\0\1\0\0" + bytes(8)
    raws = [head + struct.pack("<I", len(text)) + text for text in texts]
    for buffers in (raws, raws[:4], raws[6:8], raws[8:]):
        wanted = [msg.Header.deserialize(raw).frame_id for raw in buffers]
        columns = msg.Header.to_columns(buffers)
        assert columns["frame_id"].to_list() == list(columns["frame_id"]) == wanted
        assert msg.Header.to_arrow(buffers)["frame_id"].to_pylist() == wanted


def test_any_byte_but_zero_is_true(msg):
    raw = bytearray(msg.Joints(moving=[True, False]).serialize())
    raw[-2] = 77
    assert msg.Joints.to_columns([raw])["moving"].to_list() == [[True, False]]
    assert msg.Joints.to_arrow([raw])["moving"].to_pylist() == [[True, False]]


# structured arrays


def test_the_structured_array_of_messages_that_are_alike(msg):
    messages = [msg.Joints(name=["a", "bc"], position=[n, 2]) for n in range(3000)]
    raws = msg.Joints.serialize_many(messages)
    rows = msg.Joints.to_columns(map(memoryview, raws)).structured()
    assert rows.shape == (3000,)
    assert rows["header"]["stamp"]["sec"].dtype == np.int32
    assert rows["position"][:, 0].tolist() == list(range(3000))
    assert rows["name"][0].tolist() == [b"a", b"bc"]
    nothing = msg.Joints.to_columns([]).structured()
    assert nothing.dtype.names == ("header", "name", "position", "moving")
    empty = msg.Empty.serialize_many([msg.Empty()] * 3)
    assert msg.Empty.to_columns(empty).structured().shape == (3,)
    wide = msg.Wide.to_columns([msg.Wide(wide=["é"]).serialize()]).structured()
    assert wide["wide"].tolist() == [["é".encode()]]


def test_what_a_structured_array_cannot_hold(msg):
    uneven = [msg.Joints(position=[1.0] * count).serialize() for count in (2, 2, 3)]
    columns = msg.Joints.to_columns(uneven)
    with pytest.raises(ValueError, match=r"^\[2\]\.position: has 3 elements and 2 before"):
        columns.structured()
    joints = [msg.Joints(position=[1.0] * count) for count in (1, 2)]
    columns = msg.Deep.to_columns([msg.Deep(joints=joints).serialize()])
    with pytest.raises(ValueError, match=r"^joints\.position: has 2 elements and 1 before"):
        columns.structured()


# Columns, Texts and Ragged


def test_columns_are_used_like_lists_and_by_name(msg):
    messages = [msg.Joints(name=["a"] * n, position=range(n)) for n in (2, 0, 3)]
    columns = msg.Joints.to_columns(msg.Joints.serialize_many(messages))
    plain = [message.to_dict() for message in messages]
    assert columns.keys() == ["header", "name", "position", "moving"]
    assert "name" in columns
    assert "names" not in columns
    assert (columns[-1], columns[1:].to_list(), list(columns)) == (plain[2], plain[1:], plain)
    assert list(columns.flat()) == [
        *("header.stamp.sec", "header.stamp.nanosec", "header.frame_id"),
        *("name", "position", "moving"),
    ]
    assert dict(columns).keys() == set(columns.keys())
    with pytest.raises(KeyError, match="no column 'nme', but header, name"):
        columns["nme"]
    with pytest.raises(IndexError):
        columns[3]
    names, positions = columns["name"], columns["position"]
    assert [list(one) for one in names] == [["a", "a"], [], ["a", "a", "a"]]
    assert (names[-1][0], names.values[4], names[1:].to_list()) == ("a", "a", [[], ["a"] * 3])
    assert np.asarray(names.values).tolist() == ["a"] * 5
    assert positions[2].tolist() == [0, 1, 2]
    assert np.shares_memory(positions[2], positions.values)
    assert positions[2:].stacked().tolist() == [[0, 1, 2]]
    assert positions[:0].stacked().shape == (0, 0)
    with pytest.raises(ValueError, match=r"\[1\] has 0 elements and \[0\] has 2"):
        positions.stacked()
    with pytest.raises(TypeError, match="only numbers"):
        names.stacked()
    with pytest.raises(ValueError, match="step"):
        names[::2]
    assert repr(positions) == "<Ragged of 3: [0.0, 1.0], [], [0.0, 1.0, 2.0]>"
    assert repr(names.values) == "<Texts of 5: 'a', 'a', 'a', ...>"
    assert repr(columns[:1]).startswith("<Columns of 1: {'header': {'stamp': ")


# a batch


def test_a_file_in_memory_is_read_in_place(msg, tmp_path):
    import mmap

    rng = random.Random(5)
    messages = messages_of(msg.Image, rng, 40, 6)
    buffers = buffers_of(messages, rng)
    batch = batch_of(buffers, rng)
    path = tmp_path / "recording"
    path.write_bytes(batch.buffer)
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as memory:
        batch.buffer = memory
        assert msg.Image.deserialize_many(batch) == messages
        columns = msg.Image.to_columns(batch)
        table = msg.Image.to_arrow(batch)
    # nothing keeps the map, or it could not have been closed
    assert columns.to_list() == [message.to_dict() for message in messages]
    assert table["width"].to_pylist() == [message.width for message in messages]


@pytest.mark.parametrize("count", [1, 2, 20])
def test_columns_share_nothing_with_the_buffers(msg, count):
    for cls in (msg.Point, msg.Image, msg.Deep):
        raws = cls.serialize_many(messages_of(cls, random.Random(1), count, 9)) * 2
        batch = batch_of(raws, random.Random(1))
        memory = batch.buffer
        columns = cls.to_columns(batch)
        before = repr(columns[:])
        memory[:] = b"\x55" * len(memory)
        assert repr(columns[:]) == before


def test_columns_of_messages_within_each_other_share_nothing_either(msg):
    memory = bytearray(40)
    kind = type(batch_of([bytes(5)], random.Random(1)))
    columns = msg.Byte.to_columns(kind(memory, np.arange(30), np.arange(5, 35)))
    memory[:] = b"\1" * 40
    assert columns["a"].tolist() == [0] * 30


def test_a_batch_that_is_none(msg):
    raw = msg.Point().serialize()
    kind = type(batch_of([raw], random.Random(1)))
    for starts, stops in (([0], [29]), ([-1], [4]), ([5], [4]), ([30], [30])):
        with pytest.raises(ValueError, match="not within its buffer"):
            msg.Point.to_columns(kind(raw, starts, stops))
    with pytest.raises(ValueError, match="as many"):
        msg.Point.to_columns(kind(raw, [0, 0], [28]))
    assert len(msg.Point.to_columns(kind(raw, [0, 0], [28, 28]))) == 2
    assert len(msg.Point.to_columns(kind(b"", [], []))) == 0


# what is refused


def mutated(raw, rng):
    raw = bytearray(raw)
    for _ in range(rng.choice([0, 1, 1, 3])):
        at = rng.randrange(len(raw))
        match rng.randrange(3):
            case 0:
                raw[at] = rng.choice([0, 1, 5, 127, 255, rng.randrange(256)])
            case 1:
                del raw[rng.randrange(len(raw)) :]
                raw += b"\0" * (not raw)
            case _:
                at -= at % 4
                raw[at : at + 4] = rng.choice([b"\xff" * 4, b"\0\0\0\1", b"\1\0\0\0", b"\7\0\0\0"])
    return bytes(raw)


@pytest.mark.rounds
@pytest.mark.parametrize("name", NAMES)
def test_the_verdict_is_that_of_deserialize(folder, error, name):
    rng = random.Random(name)
    cls = class_of(name)
    for _ in range(rounds(60)):
        count = rng.choice([1, 2, 15])
        raws = buffers_of(messages_of(cls, rng, count, rng.choice([3, 6])), rng)
        wrong = rng.randrange(count)
        raws[wrong] = mutated(raws[wrong], rng)
        try:
            cls.deserialize(raws[wrong])
        except error as caught:
            where = f"[{wrong}].{caught.path}" if caught.path else f"[{wrong}]"
            wanted = (where, caught.problem, caught.offset)
            for read in (cls.to_columns, cls.to_arrow):
                with pytest.raises(error) as found:
                    read(batch_of(raws, rng))
                assert (found.value.path, found.value.problem, found.value.offset) == wanted
        else:
            check(cls, raws, rng)


@pytest.mark.parametrize("name", NAMES)
def test_garbage_ends_in_columns_or_in_decode_error(folder, error, name):
    rng = random.Random(name)
    cls = class_of(name)
    for _ in range(100):
        raws = [rng.choice([b"\0\1\0\0", b"\0\0\0\0"]) + rng.randbytes(rng.randrange(60))]
        raws *= rng.choice([1, 20])
        with suppress(error):
            check(cls, raws, rng)


# times


def test_times_as_times_of_numpy_and_arrow(msg):
    import pyarrow as pa

    time = __import__("builtin_interfaces.msg").msg.Time
    duration = __import__("builtin_interfaces.msg").msg.Duration
    instants = [
        (0, 0),
        (-1, 500_000_000),
        (1, 1_500_000_000),
        (-(2**31), 0),
        (2**31 - 1, 2**32 - 1),
    ]
    wanted = [seconds * 10**9 + nanoseconds for seconds, nanoseconds in instants]
    messages = [
        msg.Times(
            at=time(sec=a, nanosec=b),
            after=[duration(sec=a, nanosec=b)] * index,
            two=[time(sec=a, nanosec=b), time()],
        )
        for index, (a, b) in enumerate(instants)
    ]
    for order in ("little", "big"):
        raws = msg.Times.serialize_many(messages, byteorder=order)
        columns = msg.Times.to_columns(raws, datetimes=True)
        assert columns["at"].dtype == "M8[ns]"
        assert columns["at"].view(np.int64).tolist() == wanted
        assert columns["after"].values.dtype == "m8[ns]"
        assert columns["after"][4].view(np.int64).tolist() == [wanted[4]] * 4
        assert columns["two"].stacked()[:, 0].view(np.int64).tolist() == wanted
        columns = msg.Times.to_columns(raws, datetimes=True, fields=["two", "header"])
        rows = columns.structured()
        assert rows["two"][:, 0].view(np.int64).tolist() == wanted
        assert rows["header"]["stamp"].dtype == "M8[ns]"
        table = msg.Times.to_arrow(raws, datetimes=True)
        assert table.schema.field("at").type == pa.timestamp("ns")
        assert table.schema.field("after").type == pa.large_list(pa.duration("ns"))
        assert table["at"].cast(pa.int64()).to_pylist() == wanted
    columns = msg.Times.to_columns(raws, datetimes=True, fields=["at.sec", "two"])
    assert columns["at"]["sec"].tolist() == [seconds for seconds, _ in instants]
    stamps = time.to_columns([time(sec=5, nanosec=6).serialize()], datetimes=True)
    assert stamps.structured().tolist() == [(5, 6)]
