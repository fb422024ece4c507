"""The messages that the rows are about, made of any implementation's classes."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np


class Maker:
    """Makes all messages of one implementation; `class_of(package, type)` gives its classes."""

    def __init__(self, class_of, octet):
        self.make = lambda package, type_, /, **fields: class_of(package, type_)(**fields)
        self.octet = octet

    def header(self):
        stamp = self.make("builtin_interfaces", "Time", sec=1_700_000_000, nanosec=123_456_789)
        return self.make("std_msgs", "Header", stamp=stamp, frame_id="base_link")

    def geometry(self, name, *values):
        return self.make("geometry_msgs", name, **dict(zip("xyzw", values, strict=False)))

    def string(self):
        return self.make("std_msgs", "String", data="hello world")

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

    def transforms(self):
        transforms = [
            self.make(
                "geometry_msgs",
                "TransformStamped",
                header=self.header(),
                child_frame_id=f"link_{index}",
                transform=self.make(
                    "geometry_msgs",
                    "Transform",
                    translation=self.geometry("Vector3", 0.1 * index, 2.0, 3.0),
                    rotation=self.geometry("Quaternion", 0.0, 0.0, 0.6, 0.8),
                ),
            )
            for index in range(50)
        ]
        return self.make("tf2_msgs", "TFMessage", transforms=transforms)

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


class Message(NamedTuple):
    """A row's message: its type, and the method of Maker that makes it."""

    type: str
    make: Callable[[Maker], object]
    large: bool = False

    @property
    def parts(self) -> tuple[str, str]:
        package, _, name = self.type.split("/")
        return package, name


MESSAGES = {
    "String": Message("std_msgs/msg/String", Maker.string),
    "PoseStamped": Message("geometry_msgs/msg/PoseStamped", Maker.pose_stamped),
    "Imu": Message("sensor_msgs/msg/Imu", Maker.imu),
    "JointState(20)": Message("sensor_msgs/msg/JointState", Maker.joint_state),
    "LaserScan(720)": Message("sensor_msgs/msg/LaserScan", Maker.laser_scan),
    "TFMessage(50)": Message("tf2_msgs/msg/TFMessage", Maker.transforms),
    "Path(1000)": Message("nav_msgs/msg/Path", Maker.path),
    "DiagnosticArray(20x10)": Message("diagnostic_msgs/msg/DiagnosticArray", Maker.diagnostics),
    "Image(640x480x3)": Message("sensor_msgs/msg/Image", Maker.image, large=True),
    "PointCloud2(100k)": Message("sensor_msgs/msg/PointCloud2", Maker.point_cloud, large=True),
}
PACKAGES = (
    "builtin_interfaces",
    "std_msgs",
    "geometry_msgs",
    "sensor_msgs",
    "nav_msgs",
    "diagnostic_msgs",
    "tf2_msgs",
)
