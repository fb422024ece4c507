"""A node of rclpy that echoes, serves and calls; it ends when its input does."""

import sys
import threading

import rclpy
from rclpy.action import ActionServer
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

LATCHED = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def serve(request, response):
    response.success, response.message = request.data, "rclpy"
    return response


def execute(goal):
    goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
    goal.succeed()
    return Fibonacci.Result(sequence=[0, 1, 1, 2][: goal.request.order])


rclpy.init()
node = rclpy.create_node("peer")
back = node.create_publisher(String, "back", 1000)
node.create_subscription(String, "words", back.publish, 1000)
images = node.create_publisher(Image, "images_back", 5)
node.create_subscription(Image, "images", images.publish, 5)
latched = node.create_publisher(String, "latched", LATCHED)
for number in range(5):
    latched.publish(String(data=str(number)))
node.create_service(SetBool, "theirs", serve)
client = node.create_client(SetBool, "ours")
ActionServer(node, Fibonacci, "count", execute)


def call():
    client.wait_for_service()
    future = client.call_async(SetBool.Request(data=True))
    future.add_done_callback(lambda done: print(done.result().message, flush=True))


threading.Thread(target=call, daemon=True).start()
threading.Thread(target=lambda: (sys.stdin.read(), rclpy.try_shutdown()), daemon=True).start()
rclpy.spin(node)
