"""A tour of what `idlc gen` wrote for examples/my_robot_controller; `make demo` runs it.

Needs the compiled packages on the path (the Makefile sees to it) and, from the third stop on,
the real ROS 2 client library from the wheels.
"""

import inspect
import os
import sys

# The messages of this demo stay on this machine and meet no other run.
os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

from my_robot_controller.action import Countdown
from my_robot_controller.msg import RobotCommand
from my_robot_controller.srv import AddTwoInts
from rich.console import Console
from rich.panel import Panel
from rich.text import Text

console = Console(highlight=False, width=min(100, Console().width))


def stop(title: str) -> None:
    console.print()
    console.rule(f"[bold]{title}", align="left")


def show(code: str, result: object) -> None:
    """Print an expression and what it gave."""
    console.print(Text(f">>> {code}", "cyan"))
    console.print(Text(str(result)), soft_wrap=True)


def a_class_with_documentation() -> None:
    stop("1  A message is a documented, typed dataclass")
    documentation = Text(inspect.getdoc(RobotCommand) or "")
    console.print(Panel(documentation, title="RobotCommand.__doc__", expand=False))
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


def the_real_rclpy() -> None:
    """Send a message of idlc's through a real publisher to a real subscription, and back."""
    stop("3  The real rclpy agrees")
    import rclpy
    from rclpy.node import Node
    from std_msgs.msg import ColorRGBA as OfficialColor
    from std_msgs_by_idlc.msg import ColorRGBA

    rclpy.init()
    node = Node("demo")
    received: list[object] = []
    node.create_subscription(OfficialColor, "colour", received.append, 10)
    node.create_subscription(OfficialColor, "colour", received.append, 10, raw=True)
    publisher = node.create_publisher(OfficialColor, "colour", 10)

    sent = ColorRGBA(r=1.0, g=0.5, b=0.25, a=1.0)
    publisher.publish(sent.serialize())
    while len(received) < 2:
        rclpy.spin_once(node, timeout_sec=10)
    raw = next(message for message in received if isinstance(message, bytes))
    official = next(message for message in received if not isinstance(message, bytes))
    node.destroy_node()
    rclpy.shutdown()

    show("publisher.publish(sent.serialize())  # idlc's class, rclpy's publisher", sent)
    show("# what rclpy's subscription received, as rosidl's class", official)
    show("# the raw bytes received, read by idlc's class", ColorRGBA.deserialize(raw))
    assert ColorRGBA.deserialize(raw) == sent
    for name in ("r", "g", "b", "a"):
        assert getattr(official, name) == getattr(sent, name)


#: The stops of the tour, in order.
TOUR = (a_class_with_documentation, the_wire_without_ros, the_real_rclpy)


if __name__ == "__main__":
    for part in TOUR:
        part()
    console.print("\n[green]All of it agreed.[/] Look into build/demo to see what was written.")
