"""A tour of what `idlc gen` wrote for examples/my_robot_controller; `make demo` runs it.

Needs the compiled packages on the path (the Makefile sees to it) and, from the third stop on,
rclpy: the real ROS 2 client library from the wheels, or `python -m idlc.robot examples/demo.py`,
which puts idlc in its place. The node at the other end is a process of its own.
"""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

# The messages of this demo stay on this machine and meet no other run.
os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

from my_robot_controller.action import Countdown
from my_robot_controller.msg import RobotCommand
from my_robot_controller.srv import AddTwoInts

if TYPE_CHECKING:
    from rclpy.node import Node

#: The argument of the other process.
OTHER = "other"


def stop(title: str) -> None:
    print()
    print(f"{title}\n{'-' * len(title)}")


def show(code: str, result: object) -> None:
    """Print an expression and what it gave."""
    print(f">>> {code}")
    print(result)


def a_class_with_documentation() -> None:
    stop("1  A message is a documented, typed dataclass")
    print(f"RobotCommand.__doc__:\n\n{inspect.getdoc(RobotCommand)}\n")
    show("RobotCommand()", RobotCommand())
    show(
        "RobotCommand(command_type=RobotCommand.MOVE, linear_velocity_x=0.5)",
        RobotCommand(command_type=RobotCommand.MOVE, linear_velocity_x=0.5),
    )
    show("AddTwoInts.Request(a=1, b=2)", AddTwoInts.Request(a=1, b=2))
    show("Countdown.Goal(target_count=3)", Countdown.Goal(target_count=3))


def the_wire_without_ros() -> None:
    stop("2  It reads and writes the wire format by itself")
    command = RobotCommand(command_type=RobotCommand.TURN, angular_velocity_z=1.5)
    data = command.serialize()
    show("command.serialize()", data.hex(" ", -4))
    show("RobotCommand.deserialize(data) == command", RobotCommand.deserialize(data) == command)
    show("'rclpy' in sys.modules", "rclpy" in sys.modules)


def publish_and_subscribe(node: Node) -> None:
    stop("3  Nodes publish and receive it: no CMake, no compiler, no colcon")
    received: list[RobotCommand] = []
    node.create_subscription(RobotCommand, "received", received.append, 10)
    publisher = node.create_publisher(RobotCommand, "command", 10)
    sent = RobotCommand(command_type=RobotCommand.TURN, angular_velocity_z=1.5)

    def is_back() -> bool:
        publisher.publish(sent)  # again, as nobody gets what is sent before the nodes meet
        return bool(received)

    wait_until(node, is_back)
    show("publisher.publish(command)  # and what the other process sent back", received[0])
    assert received[0] == sent


def call_a_service(node: Node) -> None:
    stop("4  Services")
    client = node.create_client(AddTwoInts, "add_two_ints")
    client.wait_for_service()
    answer = client.call_async(AddTwoInts.Request(a=40, b=2))
    wait_until(node, answer.done)
    show("client.call_async(AddTwoInts.Request(a=40, b=2))", answer.result())
    assert answer.result() == AddTwoInts.Response(sum=42)


def run_an_action(node: Node) -> None:
    stop("5  Actions, with feedback")
    from rclpy.action import ActionClient

    counts: list[int] = []
    client = ActionClient(node, Countdown, "countdown")
    client.wait_for_server()
    sending = client.send_goal_async(
        Countdown.Goal(target_count=3),
        feedback_callback=lambda message: counts.append(message.feedback.current_count),
    )
    wait_until(node, sending.done)
    getting = sending.result().get_result_async()
    wait_until(node, lambda: getting.done() and len(counts) == 3)
    show("client.send_goal_async(Countdown.Goal(target_count=3))  # feedback", counts)
    show("# result", getting.result().result)
    assert counts == [3, 2, 1]
    assert getting.result().result == Countdown.Result(final_count=0, success=True)
    client.destroy()


def be_the_other_node() -> None:
    """Send commands back, add, and count down, until the tour ends this process."""
    import rclpy
    from rclpy.action import ActionServer
    from rclpy.action.server import ServerGoalHandle
    from rclpy.executors import ExternalShutdownException

    def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        response.sum = request.a + request.b
        return response

    def count_down(goal: ServerGoalHandle) -> Countdown.Result:
        for count in range(goal.request.target_count, 0, -1):
            time.sleep(0.2)  # a client ignores feedback before it knows that its goal is accepted
            goal.publish_feedback(Countdown.Feedback(current_count=count))
        goal.succeed()
        return Countdown.Result(final_count=0, success=True)

    rclpy.init()
    node = rclpy.create_node("other")
    back = node.create_publisher(RobotCommand, "received", 10)
    node.create_subscription(RobotCommand, "command", lambda command: back.publish(command), 10)
    node.create_service(AddTwoInts, "add_two_ints", add)
    server = ActionServer(node, Countdown, "countdown", count_down)
    try:
        rclpy.spin(node)
    except ExternalShutdownException:
        server.destroy()


def meet_rosidl(node: Node) -> None:
    """Send a message of idlc's class to a subscription of rosidl's class, and back."""
    stop("6  Nodes that use rosidl's own classes understand it, and are understood")
    from std_msgs.msg import ColorRGBA as OfficialColor
    from std_msgs_by_idlc.msg import ColorRGBA

    received: list[object] = []
    node.create_subscription(OfficialColor, "colour", received.append, 10)
    node.create_subscription(OfficialColor, "colour", received.append, 10, raw=True)
    publisher = node.create_publisher(OfficialColor, "colour", 10)

    sent = ColorRGBA(r=1.0, g=0.5, b=0.25, a=1.0)
    publisher.publish(sent.serialize())
    wait_until(node, lambda: len(received) == 2)
    raw = next(message for message in received if isinstance(message, bytes))
    official = next(message for message in received if not isinstance(message, bytes))
    show("sent, of a class that idlc compiled from std_msgs", sent)
    show("received, as rosidl's class", official)
    show("received, as bytes, and read by idlc's class", ColorRGBA.deserialize(raw))
    assert ColorRGBA.deserialize(raw) == sent
    assert all(getattr(official, name) == getattr(sent, name) for name in "rgba")


def wait_until(node: Node, happened: Callable[[], bool]) -> None:
    """Let the node work until something has happened, for at most half a minute."""
    import rclpy

    end = time.monotonic() + 30
    while not happened():
        if time.monotonic() > end:
            raise TimeoutError("nothing arrived for half a minute")
        rclpy.spin_once(node, timeout_sec=0.1)


@contextmanager
def other_node() -> Iterator[None]:
    """Run the node at the other end, by the same command."""
    with subprocess.Popen([*sys.orig_argv, OTHER]) as process:  # noqa: S603 - which somebody started
        try:
            yield
        finally:
            process.terminate()


def with_rclpy(*stops: Callable[[Node], None]) -> None:
    """Run stops of the tour with a node of rclpy."""
    import rclpy

    rclpy.init()
    node = rclpy.create_node("demo")
    with other_node():
        for part in stops:
            part(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    if sys.argv[1:] == [OTHER]:
        be_the_other_node()
        sys.exit()
    a_class_with_documentation()
    the_wire_without_ros()
    rosidl = [meet_rosidl] if find_spec("std_msgs_by_idlc") else []
    with_rclpy(publish_and_subscribe, call_a_service, run_an_action, *rosidl)
    print("\nAll of it agreed. Look into build/demo to see what was written.")
