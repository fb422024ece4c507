"""Whole recordings after random edits of their types: each message is what JSON makes of it.

All else is as it was, byte for byte.
"""

import shutil
import sqlite3
from contextlib import closing

import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter

import idlc
from idlc.cli.main import main
from idlc.recordings.rewrite import Conversion
from idlc.tasks.upgrade.recordings import definition_of
from idlc.versions.classes import version_of
from tests.recordings import test_rewrite
from tests.support import recordings as made
from tests.support import upgrades
from tests.support.examples import given, settings, st

#: The topics of random types; /imu and /joints have others, of which the target knows nothing.
TOPICS = {"/top": "M0", "/inner": "M1"}
OTHERS = [each for each in made.messages(6) if each.topic != "/camera/image"]


class Versions:
    """The classes of both versions, and what the messages of each topic become."""

    def __init__(self, folder, pair):
        self.target = upgrades.package(folder / "new", pair.new)
        self.pair = pair
        self.old = idlc.load(upgrades.package(folder / "old", pair.old))
        self.new = idlc.load(self.target)
        self.wanted = {}

    def recorded(self, topic, values, time):
        """Return a message, and note what it becomes."""
        name = TOPICS[topic]
        data = getattr(self.old, name).from_dict(values).serialize()
        made_of_it = getattr(self.new, name).from_dict(upgrades.by_names(self.pair, name, values))
        self.wanted[topic, data] = made_of_it.serialize()
        return made.Recorded(topic, f"demo_msgs/msg/{name}", time, time + 1, data)

    def definition(self, kind):
        """Return the type, definition and hash of a class."""
        version = version_of(kind)
        return version.key.type, definition_of(version), version.key.hash

    @property
    def conversions(self):
        """The conversions of topics as JSON has them, to compare with."""
        result = {}
        for topic, name in TOPICS.items():
            before, after = (self.definition(getattr(each, name)) for each in (self.old, self.new))
            if before == after:
                continue
            type_, text, digest = after

            def convert(raws, _, topic=topic):
                return [self.wanted[topic, bytes(raw)] for raw in raws]

            result[topic] = Conversion(type_, "ros2msg", text, digest, convert)
        return result


@st.composite
def recordings(draw, folder):
    """Return versions, and recorded messages in their order."""
    versions = Versions(folder, draw(upgrades.pairs()))
    messages = []
    for topic, name in TOPICS.items():
        values = upgrades.messages(versions.pair.old, name)
        chosen = draw(st.lists(values, min_size=1, max_size=3))
        messages += [(topic, each) for each in chosen]
    order = draw(st.permutations([*messages, *OTHERS]))
    return versions, [
        entry._replace(log_time=100 + time, publish_time=200 + time)
        if isinstance(entry, made.Recorded)
        else versions.recorded(*entry, 100 + time)
        for time, entry in enumerate(order)
    ]


def definitions(versions):
    """Return the type, definition and hash of each recorded topic."""
    kinds = {topic: getattr(versions.old, name) for topic, name in TOPICS.items()}
    result = {topic: versions.definition(kind) for topic, kind in kinds.items()}
    for each in OTHERS:
        hash_ = made.STORE.hash_rihs01(each.type)
        result[each.topic] = each.type, made.definition(each.type), hash_
    return result


def write_mcap(path, versions, messages, compression, size):
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, chunk_size=size)
        writer.start("ros2", "test")
        channels = {}
        for topic, (type_, text, digest) in definitions(versions).items():
            schema = writer.register_schema(type_, "ros2msg", text.encode())
            metadata = {"topic_type_hash": digest, "offered_qos_profiles": "- depth: 1"}
            channels[topic] = writer.register_channel(topic, "cdr", schema, metadata)
        for number, each in enumerate(messages):
            channel = channels[each.topic]
            writer.add_message(channel, each.log_time, each.data, each.publish_time, number)
        writer.add_attachment(1, 2, "map", "text/plain", b"content")
        writer.finish()


def write_bag(path, versions, messages, plugin, mode):
    writer = BagWriter(path, version=9, storage_plugin=plugin)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {
            topic: writer.add_connection(topic, type_, msgdef=text, rihs01=digest)
            for topic, (type_, text, digest) in definitions(versions).items()
        }
        for each in messages:
            writer.write(connections[each.topic], each.log_time, each.data)
    (path / "notes.txt").write_text("mine", encoding="utf-8")


def upgraded(source, versions):
    """Run the command, and return the new recording."""
    before = contents(source)
    out = source.parent / "out"
    assert main(["upgrade", str(source), "--to", versions.target, "-o", str(out)]) == 0
    assert contents(source) == before
    name = source.name.replace(".db3", ".mcap")
    assert [path.name for path in out.iterdir()] == [name]
    return out / name


def contents(path):
    files = path.rglob("*") if path.is_dir() else [path]
    return {file: file.read_bytes() for file in files}


@settings(max_examples=12)
@given(
    data=st.data(),
    compression=st.sampled_from(CompressionType),
    size=st.sampled_from([1, 300, 1 << 20]),
)
def test_mcap_files(tmp_path_factory, data, compression, size):
    folder = tmp_path_factory.mktemp("mcap")
    versions, messages = data.draw(recordings(folder))
    source = folder / "source.mcap"
    write_mcap(source, versions, messages, compression, size)
    target = upgraded(source, versions)
    test_rewrite.check(source, target, versions.conversions)


def rows(path):
    """Return the rows of each table of a database."""
    with closing(sqlite3.connect(path)) as database:
        return {
            name: database.execute(f"SELECT * FROM {name}").fetchall()  # noqa: S608
            for name in ("schema", "metadata", "topics", "messages", "message_definitions")
        }


@pytest.mark.parametrize("is_bag", [True, False])
@settings(max_examples=6)
@given(data=st.data(), mode=st.sampled_from([None, CompressionMode.MESSAGE]))
def test_databases(tmp_path_factory, is_bag, data, mode):
    folder = tmp_path_factory.mktemp("db3")
    versions, messages = data.draw(recordings(folder))
    source = folder / "bag"
    write_bag(source, versions, messages, StoragePlugin.SQLITE3, mode)
    if not is_bag:
        source = source.rename(folder / "other") / "bag.db3"
    target = upgraded(source, versions)
    if is_bag:
        assert (target / "notes.txt").read_text(encoding="utf-8") == "mine"
        source, target = source / "bag.db3", target / "bag.mcap"
    old, conversions = rows(source), versions.conversions
    topics = {number: (name, *rest) for number, name, *rest in old["topics"]}
    texts = {type_: text for _, type_, _, text, *_ in old["message_definitions"]}
    with target.open("rb") as file:
        new = list(make_reader(file).iter_messages(log_time_order=False))
    for (_, topic, time, data_before), (schema, channel, message) in zip(
        old["messages"], new, strict=True
    ):
        name, type_, _, profiles, digest = topics[topic]
        before, conversion = plain(data_before), conversions.get(name)
        assert (channel.topic, message.log_time, message.publish_time) == (name, time, time)
        assert channel.metadata["offered_qos_profiles"] == profiles
        if conversion is None:
            assert message.data == before
            assert (schema.name, schema.data.decode()) == (type_, texts[type_])
            assert channel.metadata["topic_type_hash"] == digest
        else:
            assert [message.data] == conversion.convert([before], [0])
            assert (schema.name, schema.data.decode()) == conversion[:1] + conversion[2:3]
            assert channel.metadata["topic_type_hash"] == conversion.type_hash


def plain(data):
    """Return a payload that is not compressed."""
    if data[:4] != zstandard.MAGIC_NUMBER.to_bytes(4, "little"):
        return data
    return zstandard.ZstdDecompressor().decompress(data)


@settings(max_examples=6)
@given(data=st.data(), mode=st.sampled_from([None, CompressionMode.STORAGE]))
def test_bags_of_mcap_files(tmp_path_factory, data, mode):
    folder = tmp_path_factory.mktemp("bag")
    versions, messages = data.draw(recordings(folder))
    half = len(messages) // 2
    source = folder / "bag"
    write_bag(source, versions, messages[:half], StoragePlugin.MCAP, mode)
    write_bag(folder / "second", versions, messages[half:], StoragePlugin.MCAP, mode)
    shutil.move(folder / "second" / "second.mcap", source / "second.mcap")
    (source / "metadata.yaml").unlink()
    target = upgraded(source, versions)
    for name in ("bag.mcap", "second.mcap"):
        test_rewrite.check(source / name, target / name, versions.conversions)
