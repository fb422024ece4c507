"""A node of idlc.robot: ours.py ENDPOINT NAME FOLDER. test_peers.py tells of its names."""

import sys

import idlc
from idlc.robot import DurabilityPolicy, Node, QoSProfile, ReentrantCallbackGroup, init, spin

JointState = idlc.load("sensor_msgs/msg/JointState").JointState
SetBool = idlc.load("std_srvs/srv/SetBool").SetBool
String = idlc.load("std_msgs/msg/String").String
LATCHED = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Peer(Node):
    def __init__(self, name):
        super().__init__(name)
        self.joints = self.create_publisher(JointState, "/joints", 10)
        self.seen = self.create_publisher(JointState, "~/seen", 10)
        self.heard = self.create_publisher(String, "~/heard", 10)
        self.create_subscription(JointState, "~/say", self.joints.publish, 10)
        self.create_subscription(JointState, "/joints", self.seen.publish, 10)
        self.group = ReentrantCallbackGroup()
        self.create_subscription(String, "~/ask", self.ask, 10, callback_group=self.group)
        self.create_subscription(String, "~/join", self.join, 10)
        self.create_service(SetBool, "~/set", self.set)

    def set(self, request, response):
        response.success = request.data
        response.message = f"set by {self.get_name()}"
        return response

    async def ask(self, message):
        client = self.create_client(SetBool, message.data, callback_group=self.group)
        response = await client.call_async(SetBool.Request(data=True))
        self.heard.publish(String(data=f"{response.success} {response.message}"))
        self.destroy_client(client)

    def join(self, message):
        self.create_subscription(String, message.data, self.heard.publish, LATCHED)


with init(args=[], address=sys.argv[1]):
    spin(Peer(sys.argv[2]))
