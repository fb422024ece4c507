"""Recordings written by those who usually write them: the mcap library and rosbags."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
IMU, JOINTS, IMAGE, TF = (
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/Image",
    "tf2_msgs/msg/TFMessage",
)
INDEX_TYPES = IndexType
COMPRESSIONS = {"": CompressionType.NONE, "zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4}
SECOND = 10**9
START = 1_700_000_000 * SECOND


class Recorded(NamedTuple):
    """One message of a recording."""

    topic: str
    type: str
    log_time: int
    publish_time: int
    data: bytes


def kind(name: str) -> Any:
    """Return rosbags' class of a type."""
    return STORE.types[name]


def header(rng: random.Random, time: int) -> Any:
    stamp = kind("builtin_interfaces/msg/Time")(time // SECOND, time % SECOND)
    return kind("std_msgs/msg/Header")(stamp, "frame" * rng.randrange(3))


def imu(rng: random.Random, time: int) -> Any:
    def vector() -> Any:
        return kind("geometry_msgs/msg/Vector3")(*(rng.random() for _ in range(3)))

    turn = kind("geometry_msgs/msg/Quaternion")(*(rng.random() for _ in range(4)))
    nine = [np.array([rng.random() for _ in range(9)]) for _ in range(3)]
    return kind(IMU)(header(rng, time), turn, nine[0], vector(), nine[1], vector(), nine[2])


def joints(rng: random.Random, time: int) -> Any:
    count = rng.randrange(5)
    names = ["joint" * rng.randrange(3) for _ in range(count)]
    arrays = [np.array([rng.random() for _ in range(count)]) for _ in range(3)]
    return kind(JOINTS)(header(rng, time), names, *arrays)


def image(rng: random.Random, time: int) -> Any:
    width, height = rng.randrange(1, 9), rng.randrange(1, 9)
    data = np.frombuffer(rng.randbytes(3 * width * height), np.uint8)
    return kind(IMAGE)(header(rng, time), height, width, "rgb8", 0, 3 * width, data)


MAKERS = {"/imu": (IMU, imu), "/joints": (JOINTS, joints), "/camera/image": (IMAGE, image)}


def messages(count: int = 60, seed: int = 1) -> list[Recorded]:
    """Return messages of all topics, one after the other as they would be recorded."""
    rng, found = random.Random(seed), []
    for index in range(count):
        topic = list(MAKERS)[index % len(MAKERS)]
        type_, make = MAKERS[topic]
        time = START + index * SECOND // 10
        data = bytes(STORE.serialize_cdr(make(rng, time - 5), type_))
        found.append(Recorded(topic, type_, time, time - 5, data))
    return found


def definition(name: str) -> str:
    """Return a type's definition with those that it refers to."""
    return STORE.generate_msgdef(name, ros_version=2)[0]


def by_mcap(
    path: Path, found: Iterable[Recorded], compression: str = "zstd", **options: Any
) -> Path:
    """Write an MCAP file as the mcap library does."""
    with path.open("wb") as file:
        writer = Writer(file, compression=COMPRESSIONS[compression], **options)
        writer.start(profile="ros2", library="test")
        schemas: dict[str, int] = {}
        channels: dict[str, int] = {}
        for index, one in enumerate(found):
            if one.topic not in channels:
                if one.type not in schemas:
                    text = definition(one.type).encode()
                    schemas[one.type] = writer.register_schema(one.type, "ros2msg", text)
                metadata = {"topic_type_hash": STORE.hash_rihs01(one.type)}
                channels[one.topic] = writer.register_channel(
                    one.topic, "cdr", schemas[one.type], metadata
                )
            writer.add_message(channels[one.topic], one.log_time, one.data, one.publish_time, index)
        writer.finish()
    return path


def by_rosbags(path: Path, found: Iterable[Recorded], storage: str, compression: str = "") -> Path:
    """Write a bag as rosbags does; `compression` is none, message or storage."""
    plugin = StoragePlugin.SQLITE3 if storage == "db3" else StoragePlugin.MCAP
    writer = BagWriter(path, version=9, storage_plugin=plugin)
    if compression:
        writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for one in found:
            if one.topic not in connections:
                connections[one.topic] = writer.add_connection(one.topic, one.type, typestore=STORE)
            writer.write(connections[one.topic], one.log_time, one.data)
    return path


def of_topic(found: Iterable[Recorded], topic: str) -> Iterator[Recorded]:
    """Yield the messages of one topic."""
    return (one for one in found if one.topic == topic)
