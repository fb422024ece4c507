"""Nodes of one version of my_msgs: versions_side.py old|new.

old  publishes on drive and calls ask, until a server answers that it has received a message
new  listens to drive_v2 and serves ask_v2, until the test ends it
"""

import sys
import time

import rclpy
from my_msgs.msg import Drive
from my_msgs.srv import Ask

#: Seconds for which it waits for a response.
PATIENCE = 5.0
received = []


def receive(message):
    received.append(message)
    if len(received) == 1:
        print("message:", message.velocity, round(message.angle, 6), message.gear, flush=True)


def answer(request, response):
    response.count, response.why = int(bool(received)), f"{request.name}!"
    return response


rclpy.init()
node = rclpy.create_node(sys.argv[1])
if sys.argv[1] == "new":
    node.create_subscription(Drive, "drive_v2", receive, 10)
    node.create_service(Ask, "ask_v2", answer)
    print("ready", flush=True)
    rclpy.spin(node)
publisher = node.create_publisher(Drive, "drive", 10)
client = node.create_client(Ask, "ask")
message = Drive(speed=3, angle=180.0)
response, count = None, 0
while not count:
    client.wait_for_service()
    future = client.call_async(Ask.Request(name="Ada"))
    end = time.monotonic() + PATIENCE
    while not future.done() and time.monotonic() < end:
        publisher.publish(message)
        rclpy.spin_once(node, timeout_sec=0.05)
    # the response is lost if the server has not discovered the client: then it asks again
    response = future.result()
    count = response.count if response else 0
print("response:", response.to_dict())
(info,) = node.get_subscriptions_info_by_topic("/drive")
(own,) = node.get_publishers_info_by_topic("/drive")
print(info.topic_type, info.topic_type_hash == own.topic_type_hash)
(info,) = node.get_publishers_info_by_topic("/drive_v2")
print(info.topic_type, info.topic_type_hash == own.topic_type_hash)
rclpy.shutdown()
