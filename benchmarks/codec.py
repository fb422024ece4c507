"""Serialize and deserialize: idlc's generated codecs against rosbags, and rclpy where there is one.

Rounds are interleaved, so that whatever else the machine does meets all alike; times are medians
in microseconds, ratios say how many times idlc is faster. Name rows as arguments to see only them.
"""

import contextlib
import gc
import importlib
import io
import re
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_typestore

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from idlc.cli.main import main as idlc  # noqa: E402
from idlc.model import catalog  # noqa: E402

PACKAGES = (
    "builtin_interfaces",
    "std_msgs",
    "geometry_msgs",
    "sensor_msgs",
    "nav_msgs",
    "diagnostic_msgs",
)
#: The generated packages get names of their own, so that the official ones can be there, too.
PREFIX = "by_idlc_"
ROUNDS = 41
#: Seconds that one measurement of a round takes, about.
SLICE = 0.002


def generate(folder):
    """Compile the catalogue's interfaces with `idlc gen`, under their own package names."""
    names = [name for name in catalog.interfaces() if name.package in PACKAGES]
    for name in names:
        path = folder / "in" / f"{PREFIX}{name.package}" / name.kind / f"{name.name}.{name.kind}"
        path.parent.mkdir(parents=True, exist_ok=True)
        text = catalog.source(name).text
        path.write_text(re.sub(rf"\b({'|'.join(PACKAGES)})/", rf"{PREFIX}\1/", text))
    for package in PACKAGES:
        share = folder / "in" / f"{PREFIX}{package}"
        out = folder / "out" / share.name
        command = ["gen", share, "-o", out, "--package", share.name, "-I", folder / "in"]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            status = idlc([str(word) for word in command])
        assert status == 0, package
    sys.path.insert(0, str(folder / "out"))


def generated(package, name):
    return getattr(importlib.import_module(f"{PREFIX}{package}.msg"), name)


def official(package, name):
    return getattr(importlib.import_module(f"{package}.msg"), name)


class Maker:
    """Makes the messages of all rows, of one implementation's classes."""

    def __init__(self, class_of, octet):
        self.make = lambda package, type_, /, **fields: class_of(package, type_)(**fields)
        self.octet = octet

    def header(self):
        stamp = self.make("builtin_interfaces", "Time", sec=1_700_000_000, nanosec=123_456_789)
        return self.make("std_msgs", "Header", stamp=stamp, frame_id="base_link")

    def geometry(self, name, *values):
        return self.make("geometry_msgs", name, **dict(zip("xyzw", values, strict=False)))

    def pose_stamped(self):
        pose = self.make(
            "geometry_msgs",
            "Pose",
            position=self.geometry("Point", 1.0, 2.0, 3.0),
            orientation=self.geometry("Quaternion", 0.0, 0.0, 0.6, 0.8),
        )
        return self.make("geometry_msgs", "PoseStamped", header=self.header(), pose=pose)

    def imu(self):
        covariance = np.linspace(0, 1, 9)
        return self.make(
            "sensor_msgs",
            "Imu",
            header=self.header(),
            orientation=self.geometry("Quaternion", 0.0, 0.0, 0.6, 0.8),
            orientation_covariance=covariance,
            angular_velocity=self.geometry("Vector3", 0.1, 0.2, 0.3),
            angular_velocity_covariance=covariance,
            linear_acceleration=self.geometry("Vector3", 1.0, 2.0, 9.8),
            linear_acceleration_covariance=covariance,
        )

    def joint_state(self):
        names = [f"joint_{index}" for index in range(20)]
        values = np.linspace(-1, 1, 20)
        return self.make(
            "sensor_msgs",
            "JointState",
            header=self.header(),
            name=names,
            position=values,
            velocity=values,
            effort=values,
        )

    def laser_scan(self):
        limits = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time")
        ranges = np.linspace(0.1, 30, 720, dtype=np.float32)
        return self.make(
            "sensor_msgs",
            "LaserScan",
            header=self.header(),
            **dict.fromkeys((*limits, "range_min", "range_max"), 0.5),
            ranges=ranges,
            intensities=ranges,
        )

    def image(self):
        return self.make(
            "sensor_msgs",
            "Image",
            header=self.header(),
            height=480,
            width=640,
            encoding="rgb8",
            is_bigendian=0,
            step=1920,
            data=np.arange(480 * 1920).astype(np.uint8),
        )

    def point_cloud(self):
        fields = [
            self.make("sensor_msgs", "PointField", name=n, offset=4 * i, datatype=7, count=1)
            for i, n in enumerate("xyzi")
        ]
        return self.make(
            "sensor_msgs",
            "PointCloud2",
            header=self.header(),
            height=1,
            width=100_000,
            fields=fields,
            is_bigendian=False,
            point_step=16,
            row_step=1_600_000,
            data=np.arange(1_600_000).astype(np.uint8),
            is_dense=True,
        )

    def path(self):
        poses = [self.pose_stamped() for _ in range(1000)]
        return self.make("nav_msgs", "Path", header=self.header(), poses=poses)

    def diagnostics(self):
        status = [
            self.make(
                "diagnostic_msgs",
                "DiagnosticStatus",
                level=self.octet,
                name=f"motor {index}: temperature",
                message="all good",
                hardware_id=f"hw{index}",
                values=[
                    self.make("diagnostic_msgs", "KeyValue", key=f"key {key}", value=f"{key}.5")
                    for key in range(10)
                ],
            )
            for index in range(20)
        ]
        return self.make("diagnostic_msgs", "DiagnosticArray", header=self.header(), status=status)

    def rows(self):
        return {
            "String": self.make("std_msgs", "String", data="hello world"),
            "PoseStamped": self.pose_stamped(),
            "Imu": self.imu(),
            "JointState(20)": self.joint_state(),
            "LaserScan(720)": self.laser_scan(),
            "Image 640x480x3": self.image(),
            "PointCloud2(100k)": self.point_cloud(),
            "Path(1000)": self.path(),
            "DiagnosticArray(20x10)": self.diagnostics(),
        }


def measure(functions):
    """Return the median time of a call of each function, in microseconds."""
    calls = {}
    for name, function in functions.items():
        function()
        begin = time.perf_counter()
        function()
        calls[name] = max(1, int(SLICE / max(time.perf_counter() - begin, 1e-7)))
    times = {name: [] for name in functions}
    gc.collect()
    for _ in range(ROUNDS):
        for name, function in functions.items():
            repeat = range(calls[name])
            begin = time.perf_counter()
            for _ in repeat:
                function()
            times[name].append((time.perf_counter() - begin) / calls[name] * 1e6)
    return {name: statistics.median(found) for name, found in times.items()}


def peers(mine, theirs, rosbag, store):
    """Return the three operations of one row: operation to implementation to function."""
    kind, raw = type(mine), mine.serialize()
    name = rosbag.__msgtype__
    assert bytes(store.serialize_cdr(rosbag, name)) == raw, name
    assert kind.deserialize(raw) == mine, name
    write = {"idlc": mine.serialize, "rosbags": lambda: store.serialize_cdr(rosbag, name)}
    read = {
        "idlc": lambda: kind.deserialize(raw),
        "rosbags": lambda: store.deserialize_cdr(raw, name),
    }
    make = {"idlc": kind}
    if theirs is not None:
        from rclpy.serialization import deserialize_message, serialize_message

        cls = type(theirs)
        official_raw = serialize_message(theirs)
        assert kind.deserialize(official_raw) == mine, name
        write["rclpy"] = lambda: serialize_message(theirs)
        read["rclpy"] = lambda: deserialize_message(official_raw, cls)
        make["rclpy"] = cls
    return {"serialize": write, "deserialize": read, "construct": make}


def line(row, operation, times):
    cells = [f"{row:<23} {operation:<12}"]
    known = ("idlc", "rosbags", "rclpy")
    cells += [f"{times[name]:10.2f}" if name in times else f"{'-':>10}" for name in known]
    for name in ("rosbags", "rclpy"):
        ratio = f"{times[name] / times['idlc']:.2f}x" if name in times else "-"
        cells.append(f"{ratio:>9}")
    return " ".join(cells)


def main():
    store = get_typestore(Stores.ROS2_JAZZY)
    try:
        import rclpy  # noqa: F401

        their_rows = Maker(official, b"\0").rows()
    except ImportError:
        their_rows = {}
    with tempfile.TemporaryDirectory() as folder:
        generate(Path(folder))
        my_rows = Maker(generated, b"\0").rows()
        rosbag_rows = Maker(lambda p, n: store.types[f"{p}/msg/{n}"], 0).rows()
        print(f"Python {sys.version.split()[0]}, median of {ROUNDS} interleaved rounds, us")
        heads = f"{'idlc':>10} {'rosbags':>10} {'rclpy':>10} {'/rosbags':>9} {'/rclpy':>9}"
        print(f"{'message':<23} {'operation':<12} {heads}")
        for row, mine in my_rows.items():
            if sys.argv[1:] and not any(word in row for word in sys.argv[1:]):
                continue
            operations = peers(mine, their_rows.get(row), rosbag_rows[row], store)
            for operation, functions in operations.items():
                print(line(row, operation, measure(functions)), flush=True)


if __name__ == "__main__":
    main()
