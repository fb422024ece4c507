"""A node of zenoh-ros2-sdk: of_zenoh_ros2_sdk.py ENDPOINT NAME FOLDER. It is what ours.py is.

FOLDER has the definitions; what it lacks, the library would clone from a repository.
"""

import sys
from queue import SimpleQueue

from zenoh_ros2_sdk import (
    ROS2Publisher,
    ROS2ServiceClient,
    ROS2ServiceServer,
    ROS2Subscriber,
)
from zenoh_ros2_sdk.message_registry import get_registry
from zenoh_ros2_sdk.qos import QosDurability, QosProfile

JOINT_STATE, SET_BOOL, STRING = (
    "sensor_msgs/msg/JointState",
    "std_srvs/srv/SetBool",
    "std_msgs/msg/String",
)
LATCHED = QosProfile(history_depth=5, durability=QosDurability.TRANSIENT_LOCAL)

endpoint, name, folder = sys.argv[1:]
get_registry(folder)
host, _, port = endpoint.removeprefix("tcp/").partition(":")
own = {"node_name": name, "router_ip": host, "router_port": int(port)}

joints = ROS2Publisher("/joints", JOINT_STATE, **own)
seen = ROS2Publisher(f"/{name}/seen", JOINT_STATE, **own)
heard = ROS2Publisher(f"/{name}/heard", STRING, **own)
queue = SimpleQueue()  # callbacks run on Zenoh's thread, on which nothing can be awaited


def answer(request):
    return server.response_msg_class(success=request.data, message=f"set by {name}")


def ask(message):
    client = ROS2ServiceClient(message.data, SET_BOOL, timeout=25, **own)
    response = client.call(data=True)
    heard.publish(data=f"{response.success} {response.message}")
    client.close()


def join(message):
    ROS2Subscriber(
        message.data, STRING, lambda late: heard.publish(data=late.data), qos=LATCHED, **own
    )


subscriptions = [
    ROS2Subscriber(topic, kind, lambda message, handle=handle: queue.put((handle, message)), **own)
    for topic, kind, handle in (
        (f"/{name}/say", JOINT_STATE, lambda message: joints.publish(**vars(message))),
        ("/joints", JOINT_STATE, lambda message: seen.publish(**vars(message))),
        (f"/{name}/ask", STRING, ask),
        (f"/{name}/join", STRING, join),
    )
]
server = ROS2ServiceServer(f"/{name}/set", SET_BOOL, answer, **own)
while True:
    handle, message = queue.get()  # until the test ends this program
    handle(message)
