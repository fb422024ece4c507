"""Publish and take on the real rclpy: idlc's type support in Python against rosidl's, built in C.

One process has both kinds of classes, and takes turns between them. idlc's are generated under
names of their own, from the files that the wheels installed; what these hold of other packages is
rosidl's, as in a node of somebody whose own package alone is idlc's.
"""

import os
import sys
import sysconfig
import time
from collections.abc import Iterator
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path

import numpy as np

from benchmarks.measure import IDLC, Goal, Repeated, Row
from benchmarks.peers import installed, run_idlc
from benchmarks.work import Work

SHARE = Path(sysconfig.get_path("data")) / "share"
PACKAGES = ("std_msgs", "geometry_msgs", "sensor_msgs", "std_srvs")
SUFFIX = "_by_idlc"
PLACES = {IDLC: SUFFIX, "rclpy": ""}


def text(message):
    message.data = "hello world"


def pose(message):
    message.header.frame_id = "map"
    message.pose.position.x, message.pose.orientation.w = 1.5, 1.0


def joint_state(message):
    message.header.frame_id = "base_link"
    message.name = [f"joint_{i}" for i in range(20)]
    for field in ("position", "velocity", "effort"):
        setattr(message, field, np.linspace(-1, 1, 20))


def image(message):
    message.header.frame_id = "camera"
    message.height, message.width, message.step = 480, 640, 1920
    message.encoding = "rgb8"
    message.data = np.zeros(640 * 480 * 3, dtype=np.uint8)


def point_cloud(message):
    message.header.frame_id = "lidar"
    message.height, message.width = 1, 100_000
    message.point_step, message.row_step = 16, 1_600_000
    message.data = np.zeros(1_600_000, dtype=np.uint8)


#: Package, type, what fills it.
MESSAGES = (
    ("std_msgs", "String", text),
    ("geometry_msgs", "PoseStamped", pose),
    ("sensor_msgs", "JointState", joint_state),
    ("sensor_msgs", "Image", image),
    ("sensor_msgs", "PointCloud2", point_cloud),
)


def rows(work: Work) -> Iterator[Row]:
    if not installed("rclpy"):
        return
    node, ahead = Node(work), Goal(times=1)
    for package, name, fill in MESSAGES:
        for group in ("publish", "publish + take"):
            prepare = partial(publishing, node, package, name, fill, group)
            yield Row(group, name, prepare, ahead, rounds=15)
    yield Row("call + answer", "SetBool", partial(calling, node), ahead, rounds=15)


class Node:
    """A node of rclpy, and packages that idlc generated; both made on first use."""

    def __init__(self, work: Work) -> None:
        self.folder = work.folder / "topics"

    @cached_property
    def node(self):
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
        for package in PACKAGES:
            out = self.folder / (package + SUFFIX)
            run_idlc("gen", SHARE / package, "-o", out, "--package", out.name)
        sys.path.insert(0, str(self.folder))
        import rclpy

        rclpy.init()
        return rclpy.create_node("idlc_benchmarks")


def unheard(*_: object) -> None:
    """Stand in for a callback; rclpy asks what a callback takes, which builtins do not tell."""


def publishing(node: Node, package: str, name: str, fill, group: str):
    found = {}
    for who, suffix in PLACES.items():
        node_ = node.node
        kind = getattr(import_module(f"{package}{suffix}.msg"), name)
        message = kind()
        fill(message)
        topic = f"{package}{suffix}_{name}_{len(group)}"
        publisher = node_.create_publisher(kind, topic, 1)
        subscription = node_.create_subscription(kind, topic, unheard, 1)
        while not publisher.get_subscription_count():
            time.sleep(0.01)
        publish = partial(publisher.publish, message)
        take = partial(subscription.handle.take_message, kind, False)
        both = partial(publish_and_take, publish, take)
        found[who] = Repeated(both if "take" in group else publish, time.process_time)
    return found


def publish_and_take(publish, take) -> None:
    publish()
    while take() is None:
        pass


def calling(node: Node):
    found = {}
    for who, suffix in PLACES.items():
        kind = import_module(f"std_srvs{suffix}.srv").SetBool
        service = node.node.create_service(kind, f"call{suffix}", unheard)
        client = node.node.create_client(kind, f"call{suffix}")
        client.wait_for_service()
        trip = partial(round_trip, client, service, kind, kind.Request(data=True))
        found[who] = Repeated(trip, time.process_time)
    return found


def round_trip(client, service, kind, request) -> None:
    """Call a service without executor: send, take, answer, take."""
    client.handle.send_request(request)
    header = None
    while header is None:
        _, header = service.handle.service_take_request(kind.Request)
    service.send_response(kind.Response(success=True), header)
    header = None
    while header is None:
        header, _ = client.handle.take_response(kind.Response)
