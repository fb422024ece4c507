"""Rewriting a recording against doing so with the mcap library: python -m benchmarks.rewriting.

CPU seconds of a whole file. The mcap library copies messages without decoding them, and changes
nothing. idlc changes the definition of a topic, or its messages, too.
"""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from benchmarks.measure import IDLC, Candidate, Goal, Row, measure
from benchmarks.recordings import MCAP, written
from benchmarks.report import line
from benchmarks.work import Work, in_memory

GROUP = "rewriting"
TYPE = "sensor_msgs/msg/Imu"
PEER = "mcap"


def by_idlc(source: Path, target: Path, converts: bool) -> None:
    from rosbags.typesys import Stores, get_typestore

    from idlc.recordings.rewrite import Conversion, rewrite

    text = get_typestore(Stores.ROS2_JAZZY).generate_msgdef(TYPE, ros_version=2)[0]
    convert = (lambda raws, _: list(map(bytes, raws))) if converts else None
    new = Conversion(TYPE, "ros2msg", f"# another comment\n{text}", "RIHS01_", convert)
    rewrite(str(source), str(target), {"/imu": new})


def by_mcap(source: Path, target: Path, label: str) -> None:
    from mcap.reader import make_reader
    from mcap.writer import CompressionType, Writer

    with source.open("rb") as file, target.open("wb") as output:
        writer = Writer(output, compression=CompressionType[label.upper()])
        writer.start(profile="ros2")
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            if channel.id not in channels:
                if schema.id not in schemas:
                    number = writer.register_schema(schema.name, schema.encoding, schema.data)
                    schemas[schema.id] = number
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id], channel.metadata
                )
            times = message.log_time, message.data, message.publish_time
            writer.add_message(channels[channel.id], *times, message.sequence)
        writer.finish()


def rows(work: Work) -> Iterator[Row]:
    """Yield a row for each compression; the goal is to be three times as fast.

    Messages that are converted are compressed anew, by the same libraries.
    """
    for label in MCAP:
        for name, converts, times in (("definition", False, 3), ("messages", True, 1)):
            prepare = partial(writers, work, label, converts)
            yield Row(f"{GROUP} {label}", name, prepare, Goal(times=times), rounds=5)


def writers(work: Work, label: str, converts: bool) -> dict[str, Candidate]:
    folder = work.folder / GROUP
    folder.mkdir(exist_ok=True)
    source = written(folder, label, 100 if work.quick else 1)
    functions: dict[str, Callable[[Path], None]] = {
        IDLC: partial(by_idlc, source, converts=converts),
        PEER: partial(by_mcap, source, label=label),
    }
    return {who: partial(timed, function, folder) for who, function in functions.items()}


def timed(function: Callable[[Path], None], folder: Path) -> float:
    """Return the CPU seconds of writing a file, which is removed."""
    target = folder / "target.mcap"
    begin = process_time()
    function(target)
    taken = process_time() - begin
    target.unlink()
    return taken


if __name__ == "__main__":
    with TemporaryDirectory(dir=in_memory()) as name:
        for row in rows(Work(Path(name), quick=False)):
            print(line(measure(row, None)))
