"""One topic of a recording → a table of Arrow, or what a reader has instead.

CPU seconds from opening the file. Each reader has a process of its own, in which it has read the
file once when the clock begins. What cannot be faster, whoever reads, stands beside it: one copy of
the messages to memory that nobody had yet, or decompressing the chunks into memory that is there.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from benchmarks.measure import IDLC, Candidate, Goal, Row
from benchmarks.work import Work

TOPICS = {"/imu": "Imu", "/scan": "LaserScan", "/image": "Image"}
LABELS = ("none", "zstd", "lz4", "db3")
GROUP = "recording"
#: What readers make their tables of at once, about.
PIECE = 1 << 24
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


@lru_cache
def written(folder: Path, label: str, share: int) -> Path:
    """Write the recording in a compression of MCAP, or as .db3."""
    if label == "db3":
        return written_db3(folder / label, share)
    from mcap.writer import CompressionType, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    path = folder / f"{label}.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType[label.upper()])
        writer.start(profile="ros2")
        channels: dict[str, int] = {}
        for time_, topic, name, raw in messages(share):
            if topic not in channels:
                text = store.generate_msgdef(name, ros_version=2)[0].encode()
                schema = writer.register_schema(name, "ros2msg", text)
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], time_, raw, time_)
        writer.finish()
    return path


def written_db3(path: Path, share: int) -> Path:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
        connections = {
            topic: bag.add_connection(topic, f"sensor_msgs/msg/{name}", typestore=store)
            for topic, name in TOPICS.items()
        }
        for time_, topic, _, raw in messages(share):
            bag.write(connections[topic], time_, raw)
    return path


# who reads it: each returns how many messages it found


def by_idlc(path: str, topic: str) -> int:
    from idlc.api.recording import Recording

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


# what nobody can do without


@lru_cache
def payload(path: str, topic: str) -> np.ndarray:
    """Return the bytes of all messages of a topic."""
    from rosbags.highlevel import AnyReader

    with AnyReader([Path(path)]) as reader:
        wanted = [one for one in reader.connections if one.topic == topic]
        raws = [bytes(raw) for _, _, raw in reader.messages(connections=wanted)]
    return np.frombuffer(b"".join(raws), np.uint8)


def copy(path: str, topic: str) -> int:
    """Copy them to memory that is asked for piece by piece, as readers do."""
    whole = payload(path, topic)
    return sum(map(len, [whole[at : at + PIECE].copy() for at in range(0, len(whole), PIECE)]))


@lru_cache
def compressed(path: str) -> list:
    """Return the chunks of a file, all of which have messages of each topic."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    np.ones(PIECE, np.uint8)  # once it is free, malloc has memory at hand for each chunk
    with Path(path).open("rb") as file:
        records = StreamReader(file, emit_chunks=True).records
        return [one for one in records if isinstance(one, Chunk)]


def decompression(path: str, _topic: str) -> int:
    """Decompress one chunk after the other, of which none is kept."""
    import zstandard
    from lz4 import frame

    whole = zstandard.ZstdDecompressor()
    functions = {"zstd": whole.decompress, "lz4": frame.decompress}
    return sum(len(functions[one.compression](one.data)) for one in compressed(path))


#: Each reader, the module that it needs, and what it reads.
MCAP = ("none", "zstd", "lz4")
READERS: dict[str, tuple[Callable[[str, str], int], str, tuple[str, ...]]] = {
    IDLC: (by_idlc, "pyarrow", LABELS),
    "rerun-sdk": (rerun, "rerun", MCAP),
    "roboto-mcap-codec": (roboto, "mcap_codec", MCAP),
    "rosbags": (rosbags, "rosbags", LABELS),
    "mcap-ros2": (mcap_ros2, "mcap_ros2", MCAP),
    "copy": (copy, "rosbags", LABELS),
    "decompression": (decompression, "mcap", ("zstd", "lz4")),
}


# rows


def rows(work: Work) -> Iterator[Row]:
    """Yield a row for each file and topic.

    The goal is to be five times as fast as rosbags; a .db3 file is read by SQLite, whoever asks.
    """
    for label in LABELS:
        goal = Goal(times=1) if label == "db3" else Goal(at_most=0.2, than="rosbags")
        for topic, name in TOPICS.items():
            yield Row(
                f"{GROUP} {label}", name, partial(readers, work, label, topic), goal, rounds=3
            )


def readers(work: Work, label: str, topic: str) -> dict[str, Candidate]:
    folder = work.folder / GROUP
    folder.mkdir(exist_ok=True)
    path = written(folder, label, 100 if work.quick else 1)
    return {
        who: Process(who, path, topic)
        for who, (_, module, labels) in READERS.items()
        if label in labels and find_spec(module)
    }


class Process:
    """The candidate that reads in a process of its own, which has done so once before."""

    def __init__(self, who: str, path: Path, topic: str) -> None:
        words = [sys.executable, "-m", "benchmarks.recordings", who, str(path), topic]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True)
        self()

    def __call__(self) -> float:
        print(file=self._process.stdin, flush=True)
        return float(self._process.stdout.readline())

    def __del__(self) -> None:
        self._process.communicate()


def main(who: str, path: str, topic: str) -> None:
    """Read whenever there is a line of input, and print the seconds that it took."""
    output = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # where readers may print whatever they want
    for _ in sys.stdin:
        begin = time.process_time()
        count = READERS[who][0](path, topic)
        print(time.process_time() - begin, file=output, flush=True)
        assert count


if __name__ == "__main__":
    main(*sys.argv[1:])
