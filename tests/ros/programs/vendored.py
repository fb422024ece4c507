"""Messages of a library that comes with the types that it uses, on the real rclpy: vendored.py WHAT

installed  where std_msgs is installed
copied     where it is not, but for rclpy's own dependencies
"""

import pickle
import sys
from threading import Event

import rclpy

copied = sys.argv[1] == "copied"
for package in ("std_msgs", "geometry_msgs") if copied else ():
    sys.modules[package] = None  # importing it fails, as if it were not installed

from lib.ros.msg import Track  # noqa: E402 (what is importable is decided)
from lib.ros.vendor.builtin_interfaces.msg import Time  # noqa: E402
from lib.ros.vendor.geometry_msgs.msg import Point  # noqa: E402
from lib.ros.vendor.std_msgs.msg import Header  # noqa: E402
from other.msg import Bee  # noqa: E402


def passed(node, kind, message):
    """Return a message after it was published."""
    received, arrived = [], Event()

    def receive(message):
        received.append(message)
        arrived.set()

    name = kind.__name__.lower()
    node.create_subscription(kind, name, receive, 10)
    publisher = node.create_publisher(kind, name, 10)
    while not received:
        publisher.publish(message)
        rclpy.spin_once(node, timeout_sec=0.1)
    (about,) = node.get_publishers_info_by_topic(f"/{name}")
    print(about.topic_type, about.topic_type_hash)
    assert type(received[0]) is kind
    return received[0]


assert Header.__module__.startswith("lib.ros.vendor." if copied else "std_msgs.")
assert Time.__module__.startswith("builtin_interfaces.")
rclpy.init()
node = rclpy.create_node("vendored")
header = Header(stamp=Time(sec=1, nanosec=2), frame_id="map")
track = Track(header=header, points=[Point(x=1.0), Point(y=2.0)])
assert passed(node, Track, track) == track
assert passed(node, Header, header) == header
bee = Bee(headers=[header, track.header], check_fields=True)
assert passed(node, Bee, bee) == bee
assert pickle.loads(pickle.dumps((track, bee))) == (track, bee)
assert Header.SLOT_TYPES[0].namespaces == ["builtin_interfaces", "msg"]
assert Track.SLOT_TYPES[0].namespaces == ["std_msgs", "msg"]
rclpy.shutdown()
