"""Nodes of idlc.robot on DDS against those of rclpy on Fast DDS: run this module.

Each node is a program of its own, on loopback, and the node at the other end is rclpy's. Two
receivers get the same messages at the same time; senders and clients take turns.
"""

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib import import_module

from benchmarks.measure import IDLC
from benchmarks.report import amount

RCLPY = "rclpy"
ROUNDS = 3
DEPTH = 1000
#: Seconds without a message after which a receiver gives up.
PATIENCE = 15
STRING, IMAGE, IMU = "std_msgs/String", "sensor_msgs/Image", "sensor_msgs/Imu"
FIELDS = {STRING: {"data": "hello world"}, IMAGE: {"data": bytes(900_000)}}


class Program:
    """A node of one of the libraries, which have the same words."""

    def __init__(self, library: str, kind: str) -> None:
        names = ("idlc.robot",) * 3 if library == IDLC else (RCLPY, "rclpy.node", "rclpy.executors")
        ros, nodes, executors = map(import_module, names)
        ros.init(args=[])
        self.node = nodes.Node(f"node_{os.getpid()}")
        executor = executors.SingleThreadedExecutor()
        executor.add_node(self.node)
        self.spin_once = executor.spin_once
        package, name = kind.split("/")
        if library == IDLC:
            import idlc

            self.kind = getattr(idlc.load(f"{package}/msg/{name}"), name)
        else:
            self.kind = getattr(import_module(f"{package}.msg"), name)
        self.message = self.kind()
        for field, value in FIELDS.get(kind, {}).items():
            setattr(self.message, field, value)

    def receive(self, messages: int) -> Iterator[float]:
        """Yield the number of messages that came, and the CPU time for each after the first."""
        used: list[float] = []
        self.node.create_subscription(
            self.kind, "chatter", lambda _: used.append(time.process_time()), DEPTH
        )
        last, seen = time.monotonic() + PATIENCE, 0
        while len(used) < messages and time.monotonic() < last + PATIENCE:
            self.spin_once(timeout_sec=0.1)
            if len(used) > seen:
                last, seen = time.monotonic(), len(used)
        yield len(used)
        yield (used[-1] - used[0]) / (len(used) - 1)

    def publish(self, messages: int, at_once: int, pause: float, readers: int) -> Iterator[float]:
        """Publish some at once, after each pause; yield the CPU time for each message."""
        publisher = self.node.create_publisher(self.kind, "chatter", DEPTH)
        while publisher.get_subscription_count() < readers:
            self.spin_once(timeout_sec=0.1)
        time.sleep(0.5)
        due, begin = time.monotonic(), time.process_time()
        for _ in range(messages // at_once):
            for _ in range(at_once):
                publisher.publish(self.message)
            due += pause
            time.sleep(max(0.0, due - time.monotonic()))
        yield (time.process_time() - begin) / messages

    def echo(self) -> Iterator[float]:
        """Send back what comes, for ever."""
        publisher = self.node.create_publisher(self.kind, "pong", DEPTH)
        self.node.create_subscription(self.kind, "ping", publisher.publish, DEPTH)
        yield from ()
        while True:
            self.spin_once()

    def ping(self, messages: int) -> Iterator[float]:
        """Yield the median time until a message is back."""
        came: list[object] = []
        self.node.create_subscription(
            self.kind, "pong", lambda message: came.append(message), DEPTH
        )
        publisher = self.node.create_publisher(self.kind, "ping", DEPTH)
        while not came:
            publisher.publish(self.message)
            self.spin_once(timeout_sec=0.2)
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            self.spin_once(timeout_sec=0.1)
        times = []
        for _ in range(messages):
            came.clear()
            begin = time.perf_counter()
            publisher.publish(self.message)
            while not came:
                self.spin_once()
            times.append(time.perf_counter() - begin)
        yield statistics.median(times)


def start(library: str, kind: str, role: str, *words: object) -> subprocess.Popen[str]:
    """Start a program of a library."""
    command = [sys.executable, "-m", "benchmarks.dds", library, kind, role, *map(str, words)]
    domain = {"ROS_DOMAIN_ID": str(1 + os.getpid() % 100), "RMW_IMPLEMENTATION": ""}
    environment = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", **domain}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    return subprocess.Popen(command, env=environment, text=True, **pipes)


def results(program: subprocess.Popen[str]) -> list[float]:
    """Return what a program yielded."""
    output, _ = program.communicate()
    assert program.returncode == 0
    return [*map(float, output.split())]


def sent_by(library: str, kind: str, messages: int, pause: float) -> dict[str, list[float]]:
    """Return what receivers of both libraries yielded about the messages of one."""
    receivers = {each: start(each, kind, "receive", messages) for each in (IDLC, RCLPY)}
    sender = start(library, kind, "publish", messages, 1, pause, len(receivers))
    found = {each: results(receiver) for each, receiver in receivers.items()}
    results(sender)
    return found


def receiving(kind: str, messages: int, pause: float) -> dict[str, float]:
    found = sent_by(RCLPY, kind, messages, pause)
    assert found[IDLC][0] == messages, found  # rclpy loses some on a busy machine
    return {library: used for library, (_, used) in found.items()}


def publishing() -> dict[str, float]:
    found = {}
    for library in (IDLC, RCLPY):
        receiver = start(RCLPY, STRING, "receive", 4000)
        sender = start(library, STRING, "publish", 4000, 20, 0.02, 1)
        results(receiver)
        (found[library],) = results(sender)
    return found


def round_trip() -> dict[str, float]:
    echo = start(RCLPY, STRING, "echo")
    try:
        return {each: results(start(each, STRING, "ping", 2000))[0] for each in (IDLC, RCLPY)}
    finally:
        echo.kill()
        echo.communicate()


#: Each measurement, and the most that idlc shall take, as a multiple of what rclpy takes.
ROWS = {
    "CPU to receive a String": (lambda: receiving(STRING, 2000, 0.001), 1 / 3),
    "CPU to receive an Image of 0.9 MB": (lambda: receiving(IMAGE, 100, 0.03), 1),
    "CPU to publish a String": (publishing, 3),
    "a String there and back": (round_trip, 1),
}


def main() -> None:
    """Print each measurement, then what is lost of messages at 1 kHz for a minute."""
    for name, (measure, most) in ROWS.items():
        rounds = [measure() for _ in range(ROUNDS)]
        idlc, rclpy = (statistics.median(each[who] for each in rounds) for who in (IDLC, RCLPY))
        verdict = "ok  " if idlc <= most * rclpy else "MISS"
        print(f"{verdict} {name:34} {amount(idlc):>8}, rclpy {amount(rclpy):>8}", end="")
        print(f": {idlc / rclpy:.2f}x, at most {most:.2f}x", flush=True)
    for library in (IDLC, RCLPY):
        found = sent_by(library, IMU, 60_000, 0.001)
        numbers = {who: int(number) for who, (number, _) in found.items()}
        verdict = "ok  " if numbers[IDLC] == 60_000 else "MISS"
        print(f"{verdict} 60000 messages of Imu at 1 kHz from {library}: received {numbers}")


if __name__ == "__main__":
    if len(sys.argv) == 1:
        main()
    else:
        library, kind, role, *words = sys.argv[1:]
        numbers = [float(word) if "." in word else int(word) for word in words]
        for result in getattr(Program(library, kind), role)(*numbers):
            print(result, flush=True)
        # a sender stays until all is received
        sys.stdin.read()
        os._exit(0)
