"""Upgrading messages; rosbags only reads and writes them: python -m benchmarks.upgrading.

The new version has another field in the middle and a wider one at the end.
"""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measure import IDLC, Candidate, Goal, Repeated, Row, measure
from benchmarks.messages import Maker
from benchmarks.report import line
from benchmarks.work import in_memory

GROUP = "upgrading"
PEER = "rosbags"
MESSAGES = {"Imu": "imu", "JointState": "joint_state"}
BATCH = 100


def candidates(folder: Path, name: str) -> dict[str, Candidate]:
    from rosbags.typesys import Stores, get_typestore

    import idlc
    from idlc.model import catalog, ir

    source = catalog.source(ir.TypeName("sensor_msgs", "msg", name))
    assert source is not None
    file = folder / name / "sensor_msgs" / "msg" / f"{name}.msg"
    file.parent.mkdir(parents=True)
    header = "std_msgs/Header header\n"
    assert header in source.text
    changed = source.text.replace(header, f"{header}float32[] added\n") + "\nint32 wider 3\n"
    file.write_text(changed, encoding="utf-8")
    old = idlc.load("sensor_msgs")
    maker = Maker(lambda package, type_: old[f"{package}/msg/{type_}"], None)
    message = getattr(maker, MESSAGES[name])()
    payloads = [message.serialize()] * BATCH
    upgrade = idlc.upgrade(type(message), getattr(idlc.load(str(file)), name))
    store, type_ = get_typestore(Stores.ROS2_JAZZY), f"sensor_msgs/msg/{name}"

    def by_rosbags() -> None:
        for payload in payloads:
            store.serialize_cdr(store.deserialize_cdr(payload, type_), type_)

    functions: dict[str, Callable[[], object]] = {
        IDLC: partial(upgrade.many, payloads),
        PEER: by_rosbags,
    }
    return {who: Repeated(function) for who, function in functions.items()}


def rows(folder: Path) -> Iterator[Row]:
    """Yield a row for each message; the goal is to be twice as fast."""
    for name in MESSAGES:
        yield Row(GROUP, name, partial(candidates, folder, name), Goal(times=2))


if __name__ == "__main__":
    with TemporaryDirectory(dir=in_memory()) as place:
        for row in rows(Path(place)):
            print(line(measure(row, None)))
