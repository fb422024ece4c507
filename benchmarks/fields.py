"""One field of serialized messages: `idlc.reader`, others that read lazily, and whole decoding.

Each candidate goes over the same buffers, no two of which are equal. Times are per message.
"""

import operator
import re
from collections.abc import Callable, Iterator
from functools import partial

import idlc
from benchmarks.batches import each
from benchmarks.measure import IDLC, Goal, Row
from benchmarks.messages import MESSAGES
from benchmarks.peers import installed
from benchmarks.work import Work

GROUP = "one field"
#: At most so many buffers, of so many bytes together.
COUNT, BYTES = 1000, 1 << 25
#: What is read, and how many times faster than `deserialize` that is to be.
FIELDS = {
    ("PoseStamped", "header.stamp.sec"): 6,
    ("PoseStamped", "pose.position.z"): 4,
    ("Imu", "linear_acceleration.z"): 4,
    ("LaserScan(720)", "ranges[100]"): 4,
    ("Image(640x480x3)", "width"): 4,
    ("Image(640x480x3)", "data[-1]"): 4,
    ("PointCloud2(100k)", "width"): 4,
    ("PointCloud2(100k)", "data[-1]"): 4,
    ("JointState(20)", "position[3]"): 1,
    ("TFMessage(50)", "transforms[49].header.stamp.sec"): 1,
    ("DiagnosticArray(20x10)", "status[19].message"): 1,
}
_STEP = re.compile(r"(\w+)|\[(-?\d+)\]")


def rows(work: Work) -> Iterator[Row]:
    for (name, path), times in FIELDS.items():
        goal = Goal(at_most=round(1 / times, 2), than="deserialize")
        rounds = 9 if MESSAGES[name].large else 21
        yield Row(GROUP, f"{name} {path}", partial(candidates, work, name, path), goal, rounds)


def candidates(work: Work, name: str, path: str):
    kind = work.implementations[IDLC].class_of(*MESSAGES[name].parts)
    buffers = different(work, kind, name)
    get = getter(path)
    expected = [get(kind.deserialize(buffer)) for buffer in buffers]
    functions = {IDLC: idlc.reader(kind, path)}
    for who, implementation in work.implementations.items():
        if work.message(who, name) is not None:
            label = "deserialize" if who == IDLC else who
            functions[label] = of_message(implementation.decode(name), get)
    if MESSAGES[name].large:
        functions["copy=False"] = lambda buffer: get(kind.deserialize(buffer, copy=False))
    functions |= edgefirst(name, path)
    for who, function in functions.items():
        assert list(map(function, buffers[:20])) == expected[:20], (who, name, path)
    return {who: over(function, buffers) for who, function in functions.items()}


def of_message(decode, get):
    return lambda buffer: get(decode(buffer))


def over(function, buffers: list[bytes]):
    return each(lambda: [function(buffer) for buffer in buffers], len(buffers))


def different(work: Work, kind, name: str) -> list[bytes]:
    """Return serialized messages whose first string and first number differ."""
    message = kind.deserialize(work.raw(name))
    count = max(10, min(COUNT, BYTES // len(work.raw(name))))
    header = message.transforms[0].header if hasattr(message, "transforms") else message.header
    buffers = []
    for number in range(count):
        header.stamp.sec, header.frame_id = number, "f" * (number % 16)
        buffers.append(message.serialize())
    return buffers


def getter(path: str) -> Callable[[object], object]:
    """Return a function that gets what is at a path of a message."""
    if "[" not in path:
        return operator.attrgetter(path)
    steps = [
        operator.attrgetter(name) if name else operator.itemgetter(int(index))
        for name, index in _STEP.findall(path)
    ]

    def get(value):
        for step in steps:
            value = step(value)
        return value

    return get


def edgefirst(name: str, path: str):
    """Return the function of edgefirst-schemas, whose Rust classes find a field when asked."""
    if not installed("edgefirst-schemas"):
        return {}
    from edgefirst.schemas import geometry_msgs, sensor_msgs

    pose, imu, image = geometry_msgs.PoseStamped, sensor_msgs.Imu, sensor_msgs.Image
    cloud = sensor_msgs.PointCloud2
    functions = {
        ("PoseStamped", "header.stamp.sec"): lambda raw: pose.from_cdr(raw).stamp.sec,
        ("PoseStamped", "pose.position.z"): lambda raw: pose.from_cdr(raw).pose.position.z,
        ("Imu", "linear_acceleration.z"): lambda raw: imu.from_cdr(raw).linear_acceleration.z,
        ("Image(640x480x3)", "width"): lambda raw: image.from_cdr(raw).width,
        ("Image(640x480x3)", "data[-1]"): lambda raw: memoryview(image.from_cdr(raw).data)[-1],
        ("PointCloud2(100k)", "width"): lambda raw: cloud.from_cdr(raw).width,
        ("PointCloud2(100k)", "data[-1]"): lambda raw: memoryview(cloud.from_cdr(raw).data)[-1],
    }
    function = functions.get((name, path))
    return {"edgefirst-schemas": function} if function else {}
