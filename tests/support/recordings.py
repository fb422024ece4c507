"""Recordings written by those who usually write them: the mcap library and rosbags."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.interfaces import Nodetype
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


#: Types of every shape, of which rosbags can make messages.
KINDS = (
    "builtin_interfaces/msg/Duration",
    "sensor_msgs/msg/MultiEchoLaserScan",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "nav_msgs/msg/OccupancyGrid",
    "nav_msgs/msg/Path",
    "sensor_msgs/msg/BatteryState",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/PointCloud2",
    "std_msgs/msg/Bool",
    "std_msgs/msg/Char",
    "std_msgs/msg/Empty",
    "std_msgs/msg/Int64MultiArray",
    "std_msgs/msg/String",
    "stereo_msgs/msg/DisparityImage",
    "tf2_msgs/msg/TFMessage",
    "trajectory_msgs/msg/JointTrajectory",
    "visualization_msgs/msg/MarkerArray",
)
#: What rosbags and others add to a message without fields.
DUMMY = "structure_needs_at_least_one_member"
#: What rosbags writes these as.
NUMPY = {"octet": "uint8", "byte": "uint8", "char": "uint8"}


def invented(name: str, rng: random.Random) -> Any:
    """Return a message of any type, with sequences of any size."""
    _, wanted = STORE.fielddefs[name]
    return kind(name)(*(_value(one, rng) for _, one in wanted))


def _value(wanted: Any, rng: random.Random) -> Any:
    form, inner = wanted
    if form == Nodetype.BASE:
        return _number(inner[0], rng)
    if form == Nodetype.NAME:
        return invented(inner, rng)
    element, size = inner
    count = size if form == Nodetype.ARRAY else rng.randrange(4)
    values = [_value(element, rng) for _ in range(count)]
    number = element[0] == Nodetype.BASE and element[1][0] != "string"
    if not number:
        return values
    return np.array(values, NUMPY.get(element[1][0], element[1][0]))


def _number(name: str, rng: random.Random) -> Any:
    if name == "string":
        return "".join(rng.choice("aé€𝄞 z") for _ in range(rng.randrange(6)))
    if name == "bool":
        return rng.random() < 0.5
    if name.startswith("float"):
        return float(np.dtype(name).type(rng.uniform(-1e6, 1e6)))
    limits = np.iinfo(NUMPY.get(name, name))
    return rng.randint(int(limits.min), int(limits.max))


def varied(count: int = 5, seed: int = 3) -> list[Recorded]:
    """Return some messages of each of many types, on topics that are called like these."""
    rng, found = random.Random(seed), []
    for index in range(count * len(KINDS)):
        name = KINDS[index % len(KINDS)]
        data = bytes(STORE.serialize_cdr(invented(name, rng), name))
        time = START + index * SECOND // 100
        found.append(Recorded(f"/{name.rpartition('/')[2]}", name, time, time, data))
    return found


def plain(value: Any) -> Any:
    """Return a value of any reader as those of Python: dictionaries, lists, numbers and texts."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (bytes, bytearray, memoryview)):
        return list(bytes(value))
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if isinstance(value, dict):
        return {name: plain(one) for name, one in value.items()}
    if is_dataclass(value):
        names = [one.name for one in fields(value) if one.name != DUMMY]
        return {name: plain(getattr(value, name)) for name in names if name[0].islower()}
    if hasattr(value, "__slots__"):
        names = [name for name in value.__slots__ if name != DUMMY]
        return {name: plain(getattr(value, name)) for name in names}
    return value
