"""Type support from the library, used and given back a hundred times: native_cycles.py"""

import os
from itertools import cycle, islice

import rclpy
from my_robot_controller.msg import RobotCommand
from native_bridge import raw_type
from rclpy.executors import SingleThreadedExecutor
from waiting import eventually

COUNT = 100
#: The ways to open a library, each in turn.
MODES = (
    os.RTLD_LAZY,
    os.RTLD_NOW,
    os.RTLD_LAZY | os.RTLD_GLOBAL,
    os.RTLD_NOW | os.RTLD_GLOBAL,
)


def main():
    rclpy.init()
    node = rclpy.create_node("cycles")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    sent = RobotCommand()
    received = []
    for number, mode in enumerate(islice(cycle(MODES), COUNT)):
        kind = raw_type("my_robot_controller/msg/RobotCommand", mode)
        topic = f"cycle_{number}"
        publisher = node.create_publisher(kind, topic, 10)
        subscription = node.create_subscription(kind, topic, received.append, 10, raw=True)
        eventually(lambda own=publisher: own.get_subscription_count() == 1, executor)
        publisher.publish(sent.serialize())
        eventually(lambda own=number: len(received) == own + 1, executor)
        node.destroy_subscription(subscription)
        node.destroy_publisher(publisher)
    print("cycles", sum(RobotCommand.deserialize(data) == sent for data in received))
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
