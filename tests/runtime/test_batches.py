"""Many messages at once: lists of buffers, streams; and views instead of copies."""

import pickle
import random
from copy import deepcopy

import numpy as np
import pytest

from idlc import delimited, split_delimited, split_mcap_chunk
from tests.support import generated, values

FILES = {
    "msg/Point.msg": "float64 x\nfloat64 y\nfloat64 z\n",
    "msg/Odd.msg": "uint8 a\nuint16 b\nuint8 c\n",
    "msg/Empty.msg": "",
    "msg/Stamp.msg": "int32 sec\nuint32 nanosec\n",
    "msg/Header.msg": "Stamp stamp\nstring frame_id\n",
    "msg/Sample.msg": "Header header\nbool valid\nbyte state\nPoint position\nfloat32[4] weights\n",
    "msg/Joints.msg": "Header header\nstring[] name\nfloat64[] position\nbool[] moving\n",
    "msg/Marks.msg": "uint8 n\nPoint[] points\nOdd[3] odds\nHeader[<=4] headers\nEmpty empty\n",
    "msg/Wide.msg": "wstring text\n",
    "msg/Blocks.msg": "string text\nfloat64[2] a\nuint8 n\nint16[3] b\nfloat64[4] c\nint16[1] d\n",
    "msg/Image.msg": "uint32 width\nuint8[] data\nfloat32[300] gains\nint16[] more\n",
}


@pytest.fixture(scope="module")
def msg(tmp_path_factory):
    folder = tmp_path_factory.mktemp("batches")
    generated.write_package(folder, "batch_msgs", FILES)
    with generated.importable(folder):
        import batch_msgs.msg

        yield batch_msgs.msg


@pytest.fixture(scope="module")
def runtime(msg):
    import batch_msgs._idlc

    return batch_msgs._idlc


def many(cls, count=20, seed=1):
    rng = random.Random(seed)
    return [values.randomized(cls(), rng) for _ in range(count)]


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("name", ["Point", "Sample", "Joints", "Marks", "Wide", "Image", "Empty"])
def test_a_batch_is_what_its_messages_are(msg, name, order):
    cls = getattr(msg, name)
    messages = many(cls)
    buffers = cls.serialize_many(iter(messages), byteorder=order)
    assert buffers == [message.serialize(byteorder=order) for message in messages]
    assert cls.deserialize_many(iter(buffers)) == messages
    mixed = [memoryview(raw) if n % 2 else bytearray(raw) for n, raw in enumerate(buffers)]
    assert cls.deserialize_many(mixed) == messages
    assert cls.deserialize_many(buffers, copy=False) == messages


def test_a_batch_names_the_message_that_is_wrong(msg, runtime):
    messages = many(msg.Odd, 4)
    messages[2].b = 70_000
    with pytest.raises(runtime.ValidationError, match=r"^\[2\]\.b: must be an integer from 0"):
        msg.Odd.serialize_many(messages)
    buffers = msg.Header.serialize_many(many(msg.Header, 4))
    buffers[3] = buffers[3][:10]
    with pytest.raises(runtime.DecodeError, match=r"^\[3\]\.stamp\.nanosec: 4 bytes expected"):
        msg.Header.deserialize_many(buffers)
    with pytest.raises(runtime.DecodeError, match=r"^\[0\]: the encapsulation header"):
        msg.Header.deserialize_many([b""])
    with pytest.raises(ValueError, match="byteorder must be"):
        msg.Header.serialize_many([], byteorder="middle")


def test_a_batch_mends_what_one_message_would(msg):
    raw = bytearray(msg.Header(frame_id="abc").serialize())
    raw[16:19] = b"\xff\xff\xff"
    assert msg.Header.deserialize_many([raw]) == [msg.Header.deserialize(raw)]


def test_a_batch_of_a_users_subclass(msg):
    class Mine(msg.Point):
        pass

    found = Mine.deserialize_many(msg.Point.serialize_many(many(msg.Point)))
    assert {type(message) for message in found} == {Mine}


def test_a_stream_of_sizes_and_messages(msg):
    messages = many(msg.Joints)
    stream = delimited(msg.Joints.serialize_many(messages))
    assert msg.Joints.deserialize_many(split_delimited(stream)) == messages
    assert list(split_delimited(b"")) == []
    for size in (1, 3, 4, 10, len(stream) - 1):
        with pytest.raises(ValueError, match="ends within a message"):
            list(split_delimited(stream[:size]))


def test_the_chunks_of_an_mcap_file(msg, tmp_path):
    """The file is written by the mcap project's own library."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader
    from mcap.writer import CompressionType, Writer

    points, odds = many(msg.Point, 500), many(msg.Odd, 500, 2)
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=4096, compression=CompressionType.NONE)
        writer.start()
        channels = {}
        for name in ("Point", "Odd"):
            schema = writer.register_schema(f"batch_msgs/msg/{name}", "ros2msg", b"")
            channels[name] = writer.register_channel(f"/{name}", "cdr", schema)
        for time, pair in enumerate(zip(points, odds, strict=True)):
            for message in pair:
                channel = channels[type(message).__name__]
                writer.add_message(channel, time, message.serialize(), time)
        writer.finish()
    with path.open("rb") as file:
        records = StreamReader(file, emit_chunks=True).records
        chunks = [record.data for record in records if isinstance(record, Chunk)]
    assert len(chunks) > 3
    for cls, messages in ((msg.Point, points), (msg.Odd, odds)):
        number = channels[cls.__name__]
        split = [part for c in chunks for part in split_mcap_chunk(c, number)]
        assert cls.deserialize_many(split) == messages
        assert len(cls.to_columns(split)) == len(messages)
    for size in (1, 8, 9, 20, len(chunks[0]) - 1):
        with pytest.raises(ValueError, match="ends within a record"):
            list(split_mcap_chunk(chunks[0][:size], channels["Point"]))


# views


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("wrap", [bytes, bytearray, memoryview, np.frombuffer])
def test_views_share_the_buffers_memory(msg, wrap, order):
    made = msg.Image(width=3, data=range(200), more=[-1, 2], gains=np.arange(300))
    raw = made.serialize(byteorder=order)
    raw = np.frombuffer(raw, np.uint8) if wrap is np.frombuffer else wrap(raw)
    read = msg.Image.deserialize(raw, copy=False)
    everything = np.frombuffer(raw, np.uint8)
    for field in ("data", "gains", "more"):
        view = getattr(read, field)
        assert np.shares_memory(view, everything), field
        assert not view.flags.writeable
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 1
    assert read == made == msg.Image.deserialize(raw)
    assert read.to_dict() == made.to_dict()
    read.validate()
    assert read.serialize(byteorder=order) == bytes(raw)
    assert deepcopy(read) == made
    assert pickle.loads(pickle.dumps(read)) == made


def test_a_view_of_nothing(msg):
    read = msg.Image.deserialize(msg.Image().serialize(), copy=False)
    assert (read.data.shape, read.data.dtype) == ((0,), np.uint8)
    assert read == msg.Image()


def test_a_copy_shares_nothing(msg):
    raw = bytearray(msg.Image(data=range(200)).serialize())
    read = msg.Image.deserialize(raw)
    raw[:] = bytes(len(raw))
    assert list(read.data) == list(range(200))


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("text", ["", "odd", "longer"])
def test_arrays_that_are_read_together_share_no_number(msg, text, order):
    made = msg.Blocks(text=text, a=[1, 2], n=3, b=[4, 5, 6], c=[7, 8, 9, 10], d=[11])
    raw = made.serialize(byteorder=order)
    assert msg.Blocks.deserialize(raw, copy=False) == made
    for changed in "abcd":
        read, expected = msg.Blocks.deserialize(raw), deepcopy(made)
        getattr(read, changed)[:] = 0
        setattr(expected, changed, np.zeros_like(getattr(made, changed)))
        assert read == expected
        assert getattr(read, changed).flags.aligned


# strings that repeat from message to message


def test_arrays_of_strings_are_independent_of_each_other(msg):
    one = msg.Joints(name=["a", "b"]).serialize()
    two = msg.Joints(name=["a", "c"]).serialize()
    for _ in range(3):
        first = msg.Joints.deserialize(one)
        first.name.append("mine")
        first.name[0] = "changed"
        assert msg.Joints.deserialize(one).name == ["a", "b"]
        assert msg.Joints.deserialize(two).name == ["a", "c"]
        assert msg.Joints.deserialize(memoryview(two)).name == ["a", "c"]
        assert msg.Joints.deserialize(msg.Joints(name=["a"]).serialize()).name == ["a"]
        assert msg.Joints.deserialize(msg.Joints().serialize()).name == []


def test_arrays_of_strings_are_written_as_they_are_now(msg):
    joints = msg.Joints(name=["a", "b"])
    for names in (["a", "b"], ["a", "c"], [], ["a"], ("a", "b"), ["é" * 5, ""], ["a", "b"]):
        joints.name = names
        assert msg.Joints.deserialize(joints.serialize()).name == list(names)
    joints.name = names = ["a", "b"]
    joints.serialize()
    names[0] = "changed in place"
    assert msg.Joints.deserialize(joints.serialize()).name == names
    joints.name = ["x", "y"]
    assert joints.serialize() == msg.Joints(name=["x", "y"]).serialize()
