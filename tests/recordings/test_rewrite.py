"""MCAP files with topics of other types: the mcap library finds all else as it was."""

import random
from dataclasses import replace
from functools import partial
from struct import pack, unpack_from

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

import idlc
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.rewrite import Conversion, rewrite
from tests.recordings.test_mixed_mcap import DEFINED, SCHEMA, File, record, text
from tests.support import recordings as made
from tests.support.examples import given, settings, st
from tests.support.mcap_content import check_indexes, content
from tests.support.mcap_mutations import CHANNEL, MAGIC, joined, records
from tests.support.mcap_mutations import SCHEMA as SCHEMA_OP
from tests.support.rounds import SEED, rounds

NEW = Conversion("new_msgs/msg/New", "ros2msg", "int8 a\nint8 b\n", "RIHS01_new")


def longer(raws, times):
    """Return payloads that say what they were made of."""
    return [bytes(raw) + pack("<Q", time) for raw, time in zip(raws, times, strict=True)]


CONVERTED = NEW._replace(convert=longer)


def changed(message, conversion):
    if conversion is None or conversion.convert is None:
        return message.data
    (data,) = conversion.convert([message.data], [message.log_time])
    return data


def check(source, target, conversions, fate=None):
    """Fail unless `target` is `source` with conversions, byte for byte."""
    old, new = content(source), content(target)
    assert new.header == old.header
    assert new.others == old.others
    expected = [(one, conversions.get(old.topic(one))) for one in old.messages]
    for (was, conversion), now in zip(expected, new.messages, strict=True):
        assert now.data == changed(was, conversion)
        assert replace(now, data=was.data) == was
    assert [one[0] for one in new.chunks] == [one[0] for one in old.chunks]
    definitions = {}
    for number, channel in old.channels.items():
        conversion, now = conversions.get(channel.topic), new.channels[number]
        schema = new.schemas[now.schema_id]
        if conversion:
            found = schema.name, schema.encoding, schema.data.decode()
            assert found == (conversion.type, conversion.encoding, conversion.definition)
            assert now.metadata == {**channel.metadata, "topic_type_hash": conversion.type_hash}
        else:
            assert now == channel
            assert schema == old.schemas[channel.schema_id]
        key = schema.name, schema.encoding, schema.data
        assert definitions.setdefault(key, now.schema_id) == now.schema_id
    assert new.used() | (old.schemas.keys() - old.used()) == new.schemas.keys()
    check_indexes(target, new)
    if fate is not None:
        for topic, (count, size, converted) in fate.items():
            mine = [one for _, _, one in messages(target) if one.topic == topic]
            assert (count, size) == (len(mine), sum(len(one.data) for one in mine))
            conversion = conversions.get(topic)
            assert converted == bool(conversion and conversion.convert)
    with idlc.Recording(target, check=True) as recording:
        assert recording.notes == ()
        assert sum(topic.count for topic in recording.topics) == len(new.messages)


def messages(path):
    found = content(path)
    for one in found.messages:
        topic = found.channels[one.channel_id].topic
        yield None, None, made.Recorded(topic, "", one.log_time, one.publish_time, one.data)


def written(path, rng, topics, compression, options, count):
    """Write a file as the mcap library does, in an order and with other records at random."""
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, **options)
        writer.start(rng.choice(["ros2", ""]), rng.choice(["test", "ünï"]))
        schemas, channels = {}, {}
        for index in range(count):
            topic, kind = rng.choice(topics)
            if kind not in schemas:
                encoding = rng.choice(["ros2msg", "ros2idl"])
                schemas[kind] = writer.register_schema(kind, encoding, f"# {kind}".encode())
            if topic not in channels:
                metadata = rng.choice([{}, {"topic_type_hash": "RIHS01_x", "qos": "- a"}])
                channels[topic] = writer.register_channel(topic, "cdr", schemas[kind], metadata)
            time, data = rng.randrange(1 << 62), b"\0\1\0\0" + rng.randbytes(rng.randrange(60))
            writer.add_message(channels[topic], time, data, rng.randrange(1 << 62), index)
            match rng.randrange(20):
                case 0:
                    writer.add_attachment(1, 2, "à", "text/plain", rng.randbytes(9))
                case 1:
                    writer.add_metadata("one", {"key": "value"})
        writer.finish()


TOPICS = [("/a", "x/msg/A"), ("/b", "x/msg/A"), ("/c", "x/msg/C"), ("/d", "x/msg/D")]


@pytest.mark.rounds
@settings(max_examples=rounds(150), deadline=None)
@given(
    seed=st.integers(0, 1 << 32),
    compression=st.sampled_from(CompressionType),
    indexes=st.sampled_from([IndexType.ALL, IndexType.NONE, IndexType.CHUNK]),
    size=st.sampled_from([1, 100, 1000, 1 << 20]),
    flags=st.lists(st.booleans(), min_size=7, max_size=7),
    count=st.integers(0, 40),
    convert=st.sampled_from([None, longer]),
    mine=st.sets(st.sampled_from([topic for topic, _ in TOPICS])),
)
def test_all_that_is_not_of_a_changed_topic_stays(
    tmp_path_factory, seed, compression, indexes, size, flags, count, convert, mine
):
    folder = tmp_path_factory.mktemp("random")
    source, target = folder / "source.mcap", folder / "target.mcap"
    names = ("use_chunking", "use_statistics", "use_summary_offsets", "enable_crcs")
    names = (*names, "enable_data_crcs", "repeat_channels", "repeat_schemas")
    options = dict(zip(names, flags, strict=True), index_types=indexes, chunk_size=size)
    written(source, random.Random(seed), TOPICS, compression, options, count)
    before = source.read_bytes()
    conversions = dict.fromkeys(mine, NEW._replace(convert=convert))
    fate = rewrite(str(source), str(target), conversions).topics
    assert source.read_bytes() == before
    check(source, target, conversions, fate)
    if not mine and options["use_chunking"]:
        assert content(target).chunks == content(source).chunks
    assert sorted(path.name for path in folder.iterdir()) == ["source.mcap", "target.mcap"]


@pytest.mark.rounds
def test_files_that_are_put_together_in_any_way(tmp_path):
    """With records outside of chunks, repeated definitions, without indexes, and cut off."""
    rng = random.Random(SEED)
    source, target = tmp_path / "source.mcap", tmp_path / "target.mcap"
    for _ in range(rounds(300)):
        file = File(rng)
        source.write_bytes(file.finished())
        conversions = rng.choice([{}, {"/a": NEW}, {"/a": CONVERTED}, {"/b": CONVERTED}])
        rewrite(str(source), str(target), conversions, index=rng.random() < 0.7)
        expected = [
            (one.topic, one.log_time, changed(one, conversions.get(one.topic)))
            for one in sequential(source)
        ]
        found = content(target)
        assert [(found.topic(one), one.log_time, one.data) for one in found.messages] == expected
        assert len(expected) == len(file.times)
        check_indexes(target, found)
        with idlc.Recording(target, check=True) as recording:
            assert recording.notes == ()
        target.unlink()


def sequential(path):
    from tests.recordings.test_mixed_mcap import sequential

    return [made.Recorded(topic, "", time, 0, data) for topic, time, data in sequential(path)]


def put_together(path, *records):
    path.write_bytes(MAGIC + record(1, text(b"ros2") + text(b"")) + b"".join(records))
    return path


def message(channel, data=b"\0\1\0\0\0"):
    return record(5, pack("<HIQQ", channel, 7, 1, 2) + data)


def test_one_definition_for_all_channels_of_a_new_type(tmp_path):
    """Also if the recording has it already, and where another topic keeps the old type."""
    source = made.by_mcap(tmp_path / "a.mcap", made.messages(30), "zstd", chunk_size=500)
    joints = Conversion(
        *(made.JOINTS, "ros2msg", made.definition(made.JOINTS), made.STORE.hash_rihs01(made.JOINTS))
    )
    for number, conversions in enumerate(
        [{"/imu": joints}, {"/imu": joints, "/camera/image": joints}, {"/joints": joints}]
    ):
        target = tmp_path / f"{number}.mcap"
        rewrite(str(source), str(target), conversions)
        check(source, target, conversions)
    # the mcap library also says where groups are that are empty
    (end,) = unpack_from("<Q", source.read_bytes()[-20:])
    assert target.read_bytes()[:end] == source.read_bytes()[:end]


def test_other_readers_decode_the_new_type(tmp_path):
    found = made.messages(30)
    new = Conversion(
        *(made.IMAGE, "ros2msg", made.definition(made.IMAGE), made.STORE.hash_rihs01(made.IMAGE)),
        lambda raws, _: [found[2].data] * len(raws),
    )
    for compression in made.COMPRESSIONS:
        source = made.by_mcap(tmp_path / f"{compression}.mcap", found, compression, chunk_size=999)
        target = tmp_path / f"{compression}-new.mcap"
        rewrite(str(source), str(target), {"/imu": new})
        expected = made.STORE.deserialize_cdr(found[2].data, made.IMAGE)
        with target.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            decoded = [one for *_, one in reader.iter_decoded_messages(topics=["/imu"])]
        assert [made.plain(one) for one in decoded] == [made.plain(expected)] * 10
        with AnyReader([target]) as bag:
            mine = [one for one in bag.connections if one.topic == "/imu"]
            assert [raw for _, _, raw in bag.messages(mine)] == [found[2].data] * 10


def test_only_chunks_with_changes_are_compressed_anew(tmp_path):
    found = sorted(made.messages(60), key=lambda one: one.topic)
    source = made.by_mcap(tmp_path / "a.mcap", found, "zstd", chunk_size=700)
    rewrite(str(source), str(tmp_path / "b.mcap"), {"/imu": CONVERTED})
    check(source, tmp_path / "b.mcap", {"/imu": CONVERTED})
    pairs = zip(content(source).chunks, content(tmp_path / "b.mcap").chunks, strict=True)
    same = [old == new for old, new in pairs]
    assert True in same
    assert False in same


def test_messages_that_are_compressed_by_themselves_stay_so(tmp_path):
    import zstandard

    plain = made.messages(9)
    packed = [one._replace(data=zstandard.compress(one.data)) for one in plain]
    for name, found in (("plain", plain), ("packed", packed)):
        source = made.by_mcap(tmp_path / f"{name}.mcap", found, "")
        rewrite(str(source), str(tmp_path / f"{name}-new.mcap"), {"/imu": CONVERTED})
    new = [
        [one.data for _, _, one in messages(tmp_path / f"{name}-new.mcap")]
        for name in ("plain", "packed")
    ]
    assert list(map(zstandard.decompress, new[1])) == new[0]


def test_channels_without_a_definition_get_one(tmp_path):
    other = record(4, pack("<HH", 9, 0) + text(b"/x") + text(b"cdr") + text(b""))
    source = put_together(tmp_path / "a.mcap", DEFINED, message(1), other, message(9), message(1))
    rewrite(str(source), str(tmp_path / "b.mcap"), {"/x": CONVERTED})
    found = content(tmp_path / "b.mcap")
    assert found.schemas[found.channels[9].schema_id].name == NEW.type
    assert len(found.messages[1].data) == 13
    assert found.messages[0].data == message(1)[-5:]


def test_definitions_that_come_late_are_written_in_front(tmp_path):
    source = put_together(tmp_path / "a.mcap", message(1), DEFINED, message(2))
    rewrite(str(source), str(tmp_path / "b.mcap"), {"/b": CONVERTED})
    found = content(tmp_path / "b.mcap")
    assert [len(one.data) for one in found.messages] == [5, 13]
    check_indexes(tmp_path / "b.mcap", found)


def test_a_summary_need_not_list_channels_without_messages(tmp_path):
    """If a chunk defines a channel that the summary omits, a second pass reads the whole file."""
    path, target = tmp_path / "a.mcap", tmp_path / "b.mcap"
    with path.open("wb") as file:
        writer = Writer(file, enable_crcs=False)
        writer.start()
        channels = []
        for topic in ("/used", "/unused"):
            schema = writer.register_schema(f"a_msgs/msg/{topic[1:].title()}", "ros2msg", b"int8 a")
            channels.append(writer.register_channel(topic, "cdr", schema))
        writer.add_message(channels[0], 1, b"\0\1\0\0\7", 1)
        writer.finish()
    kept = [
        entry
        for entry in records(path.read_bytes()[:-8], 8)
        if entry.op not in (SCHEMA_OP, CHANNEL) or entry.content[:2] == pack("<H", 1)
    ]
    path.write_bytes(joined(kept, up_to_date=True))
    rewrite(str(path), str(target), {"/used": CONVERTED})
    check(path, target, {"/used": CONVERTED})


def test_one_conversion_is_not_for_two_types(tmp_path):
    other = SCHEMA.replace(b"int8", b"bool").replace(pack("<H", 1), pack("<H", 2), 1)
    channel = record(4, pack("<HH", 8, 2) + text(b"/a") + text(b"cdr") + text(b""))
    source = put_together(tmp_path / "a.mcap", DEFINED, other, channel, message(1), message(8))
    rewrite(str(source), str(tmp_path / "b.mcap"), {"/b": CONVERTED})
    (tmp_path / "b.mcap").unlink()
    with pytest.raises(RecordingError, match="`/a` is recorded with two different definitions"):
        rewrite(str(source), str(tmp_path / "b.mcap"), {"/a": CONVERTED})
    assert list(tmp_path.iterdir()) == [source]


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"\0\7\0\0\0", "encoded as PLAIN_CDR2"),
        (b"\x04\x22\x4d\x18\0", "compressed with lz4"),
        (b"\x28\xb5\x2f\xfd\0", "compressed message"),
    ],
)
def test_payloads_that_idlc_does_not_read_are_an_error(data, why, tmp_path):
    source = put_together(tmp_path / "a.mcap", DEFINED, message(1, data))
    with pytest.raises(RecordingError, match=why):
        rewrite(str(source), str(tmp_path / "b.mcap"), {"/a": CONVERTED})
    rewrite(str(source), str(tmp_path / "b.mcap"), {"/a": NEW})
    assert [one.data for one in content(tmp_path / "b.mcap").messages] == [data]


def test_other_encodings_than_cdr_are_an_error(tmp_path):
    defined = DEFINED.replace(text(b"cdr"), text(b"jso"))
    source = put_together(tmp_path / "a.mcap", defined, message(1))
    with pytest.raises(RecordingError, match="written as `jso`"):
        rewrite(str(source), str(tmp_path / "b.mcap"), {"/a": CONVERTED})


def test_a_checksum_of_a_chunk_that_changes_must_be_right(tmp_path):
    source = made.by_mcap(tmp_path / "a.mcap", made.messages(30), "")
    data = bytearray(source.read_bytes())
    data[data.index(made.messages(1)[0].data) + 9] ^= 1
    source.write_bytes(data)
    with pytest.raises(RecordingError, match="checksum of the chunk"):
        rewrite(str(source), str(tmp_path / "b.mcap"), {"/imu": CONVERTED}, strict=True)


def test_convert_gets_few_messages_of_one_topic_at_a_time(tmp_path, monkeypatch):
    monkeypatch.setattr("idlc.recordings.containers.conversion.BATCH", 2000)
    source = made.by_mcap(tmp_path / "a.mcap", made.messages(90), "")
    calls, progress = [], []

    def convert(raws, times):
        calls.append(sum(map(len, raws)))
        return longer(raws, times)

    conversions = {"/imu": NEW._replace(convert=convert)}
    done = partial(lambda *words: progress.append(words))
    rewrite(str(source), str(tmp_path / "b.mcap"), conversions, done)
    check(source, tmp_path / "b.mcap", {"/imu": CONVERTED})
    assert len(calls) > 3
    assert max(calls) < 2500
    assert progress[-1] == ("a.mcap", source.stat().st_size, source.stat().st_size)
    assert progress == sorted(progress)
