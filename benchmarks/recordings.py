"""One topic of a recording → a table of Arrow: python -m benchmarks.recordings.

CPU seconds of a process from opening the file, the best of some rounds. Each reader
has a process of its own, in which it has read the file once when the clock begins. The goals: ahead
of rerun without compression, within 1.2 of its time with zstd, and five times as fast as rosbags.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np

TOPICS = {"/imu": "Imu", "/scan": "LaserScan", "/image": "Image"}
LABELS = ("none", "zstd", "lz4", "db3")
START = 1_700_000_000 * 10**9
#: How many messages of each topic there are, and how far apart: about 220 MB.
COUNTS = {"/imu": (60_000, 5_000_000), "/scan": (6_000, 50_000_000), "/image": (180, 1_666_666_667)}


# what is read


def messages(share: int) -> Iterator[tuple[int, str, str, bytes]]:
    """Yield time, topic, type and bytes of all messages, or of one in `share`, in their order."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    numbers = np.random.default_rng(0)

    def made(name: str, *values: object) -> object:
        return store.types[name](*values)

    def header(time_: int, frame: str) -> object:
        stamp = made("builtin_interfaces/msg/Time", time_ // 10**9, time_ % 10**9)
        return made("std_msgs/msg/Header", stamp, frame)

    def imu(time_: int) -> tuple[object, ...]:
        def vector() -> object:
            return made("geometry_msgs/msg/Vector3", *numbers.random(3).tolist())

        turn = made("geometry_msgs/msg/Quaternion", *numbers.random(4).tolist())
        nine = numbers.random((3, 9))
        return header(time_, "imu_link"), turn, nine[0], vector(), nine[1], vector(), nine[2]

    def scan(time_: int) -> tuple[object, ...]:
        rays = numbers.random((2, 720), np.float32)
        return header(time_, "laser"), -1.5, 1.5, 0.004, 0.0, 0.1, 0.1, 30.0, rays[0], rays[1]

    pattern = (np.arange(640 * 480 * 3) // 7 % 256).astype(np.uint8)

    def image(time_: int) -> tuple[object, ...]:
        pixels = pattern ^ numbers.integers(0, 16, len(pattern), np.uint8)
        return header(time_, "camera"), 480, 640, "rgb8", 0, 1920, pixels

    makers = {"/imu": imu, "/scan": scan, "/image": image}
    order = sorted(
        (START + index * step, topic)
        for topic, (count, step) in COUNTS.items()
        for index in range(count // share)
    )
    for time_, topic in order:
        name = f"sensor_msgs/msg/{TOPICS[topic]}"
        raw = store.serialize_cdr(made(name, *makers[topic](time_)), name)
        yield time_, topic, name, bytes(raw)


def write(folder: Path, share: int, labels: Sequence[str]) -> dict[str, Path]:
    """Write the recording in each compression of MCAP, and as .db3."""
    from mcap.writer import CompressionType, Writer
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as BagWriter
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    found = list(messages(share))
    paths = {}
    for label in labels[:3]:
        paths[label] = folder / f"{label}.mcap"
        with paths[label].open("wb") as file:
            writer = Writer(file, compression=CompressionType[label.upper()])
            writer.start(profile="ros2")
            channels: dict[str, int] = {}
            for time_, topic, name, raw in found:
                if topic not in channels:
                    text = store.generate_msgdef(name, ros_version=2)[0].encode()
                    schema = writer.register_schema(name, "ros2msg", text)
                    channels[topic] = writer.register_channel(topic, "cdr", schema)
                writer.add_message(channels[topic], time_, raw, time_)
            writer.finish()
    if "db3" not in labels:
        return paths
    paths["db3"] = folder / "bag"
    with BagWriter(paths["db3"], version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
        connections = {
            topic: bag.add_connection(topic, f"sensor_msgs/msg/{name}", typestore=store)
            for topic, name in TOPICS.items()
        }
        for time_, topic, _, raw in found:
            bag.write(connections[topic], time_, raw)
    return paths


# who reads it: each returns how many messages it found


def idlc(path: str, topic: str) -> int:
    from idlc import Recording

    with Recording(path) as recording:
        return recording[topic].to_arrow().num_rows


def rerun(path: str, topic: str) -> int:
    from rerun.chunk import McapReader

    # its other decoders leave out fields
    reader = McapReader(path, decoders=["ros2_reflection"], include_topic_regex=[f"^{topic}$"])
    return sum(chunk.to_record_batch().num_rows for chunk in list(reader.stream()))


def roboto(path: str, topic: str) -> int:
    from mcap_codec import TimestampSource, TopicName, open_mcap_file  # roboto-mcap-codec

    with Path(path).open("rb") as file:

        def read_bytes(offset: int, length: int) -> bytes:
            file.seek(offset)
            return file.read(length)

        size = Path(path).stat().st_size
        times = TimestampSource("message_log_time")
        found = open_mcap_file(read_bytes, size, timestamp=times, channel=TopicName(topic))
        return sum(batch.num_rows for batch in list(found))


def rosbags(path: str, topic: str) -> int:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([Path(path)], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        wanted = [one for one in reader.connections if one.topic == topic]
        found = [
            reader.deserialize(raw, connection.msgtype)
            for connection, _, raw in reader.messages(connections=wanted)
        ]
    return len(found)


def mcap_ros2(path: str, topic: str) -> int:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with Path(path).open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return len(list(reader.iter_decoded_messages(topics=[topic])))


#: Each reader, the module that it needs, and what it cannot read.
READERS: dict[str, tuple[Callable[[str, str], int], str, tuple[str, ...]]] = {
    "idlc": (idlc, "pyarrow", ()),
    "rerun-sdk": (rerun, "rerun", ("db3",)),
    "roboto-mcap-codec": (roboto, "mcap_codec", ("db3",)),
    "rosbags": (rosbags, "rosbags", ()),
    "mcap-ros2-support": (mcap_ros2, "mcap_ros2", ("db3",)),
}


def measured(who: str, path: Path, topic: str, rounds: int) -> float:
    """Return the CPU seconds that a reader takes, in a process of its own."""
    words = ["-m", "benchmarks.recordings", "--one", who, str(path), topic, str(rounds)]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return float(json.loads(done.stdout.splitlines()[-1]))


def one(who: str, path: str, topic: str, rounds: int) -> float:
    """Return the best of some rounds, after one that imports and compiles."""
    read = READERS[who][0]
    read(path, topic)
    best = float("inf")
    for _ in range(rounds):
        begin = time.process_time()
        count = read(path, topic)
        best = min(best, time.process_time() - begin)
        assert count
    return best


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recordings", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one row of few messages, once")
    parser.add_argument("--one", nargs=4, metavar="WORD", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        who, path, topic, rounds = given.one
        print(json.dumps(one(who, path, topic, int(rounds))))
        return
    readers = [who for who, (_, module, _) in READERS.items() if find_spec(module)]
    print("| | " + " | ".join(readers) + " |")
    print("|---|" + "---:|" * len(readers))
    with tempfile.TemporaryDirectory(prefix="idlc-recordings-") as folder:
        labels = LABELS[: 1 if given.quick else None]
        topics = list(TOPICS.items())[: 1 if given.quick else None]
        for label, path in write(Path(folder), 100 if given.quick else 1, labels).items():
            for topic, name in topics:
                cells = [
                    ""
                    if label in READERS[who][2]
                    else f"{measured(who, path, topic, 1 if given.quick else 5):.3f}"
                    for who in readers
                ]
                print(f"| {label} {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
