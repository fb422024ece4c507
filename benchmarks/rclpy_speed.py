"""Speed on the real rclpy: idlc's type support in Python against rosidl's, built in C.

    python benchmarks/rclpy_speed.py [ROUNDS]

One process has both kinds of classes (idlc's packages are generated under names of their own), and
takes turns between them. Times are microseconds per operation: the median of all rounds, and the
CPU time of publish + take. A ratio below 1 means that idlc's type is faster.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from array import array
from functools import partial
from importlib import import_module
from pathlib import Path

SHARE = Path(sys.prefix) / "share"
PACKAGES = ("std_msgs", "geometry_msgs", "sensor_msgs", "std_srvs")
SUFFIX = "_by_idlc"


def joint_state(message):
    message.header.frame_id = "base_link"
    message.name = [f"joint_{i}" for i in range(20)]
    for field in ("position", "velocity", "effort"):
        setattr(message, field, array("d", range(20)))


def image(message):
    message.header.frame_id = "camera"
    message.height, message.width, message.step = 480, 640, 1920
    message.encoding = "rgb8"
    message.data = array("B", bytes(640 * 480 * 3))


def point_cloud(message):
    message.header.frame_id = "lidar"
    message.height, message.width = 1, 100_000
    message.point_step, message.row_step = 16, 1_600_000
    message.data = array("B", bytes(1_600_000))


def text(message):
    message.data = "hello world"


def pose(message):
    message.header.frame_id = "map"
    message.pose.position.x, message.pose.orientation.w = 1.5, 1.0


#: Package, type, what fills it, operations in one round.
ROWS = (
    ("std_msgs", "String", text, 4000),
    ("geometry_msgs", "PoseStamped", pose, 2000),
    ("sensor_msgs", "JointState", joint_state, 1000),
    ("sensor_msgs", "Image", image, 60),
    ("sensor_msgs", "PointCloud2", point_cloud, 40),
)
COLUMNS = ("serialize", "deserialize", "publish", "publish + take", "the same, p50")


def cpu(function, count):
    """Return the CPU time of one call."""
    start = time.process_time()
    for _ in range(count):
        function()
    return (time.process_time() - start) / count * 1e6


def p50(function, count):
    """Return the median time of a call by the clock."""
    times = []
    for _ in range(count):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times) * 1e6


class Candidate:
    """One class with a publisher and a subscription of its own."""

    def __init__(self, node, cls, fill):
        from rclpy.serialization import serialize_message

        self.cls = cls
        self.message = cls()
        fill(self.message)
        self.data = serialize_message(self.message)
        topic = cls.__module__.replace(".", "_") + "_" + cls.__name__
        self.publisher = node.create_publisher(cls, topic, 1)
        self.subscription = node.create_subscription(cls, topic, lambda _: None, 1)
        while not self.publisher.get_subscription_count():
            time.sleep(0.01)

    def publish_and_take(self):
        self.publisher.publish(self.message)
        while self.subscription.handle.take_message(self.cls, False) is None:
            pass

    def round(self, count):
        from rclpy.serialization import deserialize_message, serialize_message

        return (
            cpu(lambda: serialize_message(self.message), count),
            cpu(lambda: deserialize_message(self.data, self.cls), count),
            cpu(lambda: self.publisher.publish(self.message), count),
            cpu(self.publish_and_take, count),
            p50(self.publish_and_take, count),
        )


def message_rows(node, rounds):
    for package, name, fill, count in ROWS:
        pair = [
            Candidate(node, getattr(import_module(f"{place}.msg"), name), fill)
            for place in (package, package + SUFFIX)
        ]
        results = ([], [])
        for _ in range(rounds):
            for candidate, result in zip(pair, results, strict=True):
                result.append(candidate.round(count))
        medians = [map(statistics.median, zip(*result, strict=True)) for result in results]
        yield name, list(zip(*medians, strict=True))


def round_trip(client, service, kind, request):
    """Call a service without executor: send, take, answer, take."""
    client.handle.send_request(request)
    header = None
    while header is None:
        _, header = service.handle.service_take_request(kind.Request)
    service.send_response(kind.Response(success=True), header)
    header = None
    while header is None:
        header, _ = client.handle.take_response(kind.Response)


def service_row(node, rounds):
    calls = []
    for place in ("std_srvs", "std_srvs" + SUFFIX):
        kind = import_module(f"{place}.srv").SetBool
        service = node.create_service(kind, place, print)
        client = node.create_client(kind, place)
        client.wait_for_service()
        calls.append(partial(round_trip, client, service, kind, kind.Request(data=True)))
    results = ([], [])
    for _ in range(rounds):
        for call, result in zip(calls, results, strict=True):
            result.append((cpu(call, 1000), p50(call, 1000)))
    medians = [map(statistics.median, zip(*result, strict=True)) for result in results]
    return "SetBool call", list(zip(*medians, strict=True))


def show(name, pairs):
    cells = [f"{official:7.1f} {own:7.1f} {own / official:5.2f}" for official, own in pairs]
    print(f"{name:17} " + " | ".join(cells), flush=True)


def main(rounds):
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    with tempfile.TemporaryDirectory() as folder:
        for package in PACKAGES:
            out = Path(folder) / (package + SUFFIX)
            command = [sys.executable, "-m", "idlc", "gen", SHARE / package, "-o", out]
            command += ["--package", out.name]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        sys.path.insert(0, folder)
        import rclpy

        rclpy.init()
        node = rclpy.create_node("rclpy_speed")
        print("rosidl, idlc (µs), ratio")
        print(f"{'':17} " + " | ".join(f"{column:21}" for column in COLUMNS))
        for row in message_rows(node, rounds):
            show(*row)
        print(f"\n{'':17} call and answer       | the same, p50")
        show(*service_row(node, rounds))
        node.destroy_node()
        rclpy.shutdown()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 7)
