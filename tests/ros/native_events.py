"""Events and feedback of idlc's nodes, seen through the library: native_events.py FAR

A node serves and calls, with introspection; a bridge that has nothing but the library carries what
it tells of that to a domain that is FAR away. What arrives there must be what arrives here. Then
type support is used and given back a hundred times.
"""

import os
import sys
import time

import rclpy
from my_robot_controller.action import Countdown
from my_robot_controller.msg import RobotCommand
from my_robot_controller.srv import AddTwoInts
from native_bridge import carry, node_in, raw_type
from peer import EVENTS
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rclpy.service_introspection import ServiceIntrospectionState

PATIENCE = 60.0
EVENT, FEEDBACK = "/add/_service_event", "/count/_action/feedback"
#: Class, name and quality of service by topic.
TOPICS = {
    EVENT: (AddTwoInts.Event, "my_robot_controller/srv/AddTwoInts_Event", EVENTS),
    FEEDBACK: (
        Countdown.Impl.FeedbackMessage,
        "my_robot_controller/action/Countdown_FeedbackMessage",
        QoSProfile(depth=10),
    ),
}
CALLS = 5


class Domain:
    """A node in a domain of its own."""

    def __init__(self, number):
        self.node = node_in(number)
        self.executor = SingleThreadedExecutor(context=self.node.context)
        self.executor.add_node(self.node)

    def listen(self):
        """Return lists by topic that fill with what is received."""
        heard = {topic: [] for topic in TOPICS}
        for topic, (cls, _, qos) in TOPICS.items():
            self.node.create_subscription(cls, topic, heard[topic].append, qos)
        return heard


def wait(domains, done, what):
    end = time.monotonic() + PATIENCE
    while not done():
        if time.monotonic() > end:
            sys.exit(f"not in time: {what}")
        for domain in domains:
            domain.executor.spin_once(timeout_sec=0.01)


def add(request, response):
    response.sum = request.a + request.b
    return response


def count_down(handle):
    for left in range(CALLS):
        handle.publish_feedback(Countdown.Feedback(left))
    handle.succeed()
    return Countdown.Result()


def events(one, two):
    """Compare what is heard in each domain."""
    node = one.node
    service = node.create_service(AddTwoInts, "add", add)
    client = node.create_client(AddTwoInts, "add")
    for each in (service, client):
        contents = ServiceIntrospectionState.CONTENTS
        each.configure_introspection(node.get_clock(), EVENTS, contents)
    server = ActionServer(node, Countdown, "count", count_down)
    goals = ActionClient(node, Countdown, "count")
    here, there = one.listen(), two.listen()
    for topic, (_, name, qos) in TOPICS.items():
        carry(node, two.node, name, topic, qos)
    ready = lambda: (  # noqa: E731
        client.service_is_ready()
        and goals.server_is_ready()
        and node.count_subscribers(FEEDBACK) >= 2
        and two.node.count_publishers(FEEDBACK) == 1
        and two.node.count_subscribers(FEEDBACK) == 1
    )
    wait((one, two), ready, "discovery")
    for number in range(CALLS):
        future = client.call_async(AddTwoInts.Request(number, 1 << 40))
        wait((one, two), future.done, "a call")
    sent = goals.send_goal_async(Countdown.Goal())
    wait((one, two), sent.done, "a goal")
    done = sent.result().get_result_async()
    wait((one, two), done.done, "a result")
    told = {EVENT: 4 * CALLS, FEEDBACK: CALLS}
    enough = lambda: all(  # noqa: E731
        len(heard[topic]) >= count for heard in (here, there) for topic, count in told.items()
    )
    wait((one, two), enough, "what was heard")
    for topic in TOPICS:
        # introspection has two publishers here, client and service, whose order is open
        texts = [sorted(str(message) for message in heard[topic]) for heard in (here, there)]
        assert texts[0] == texts[1], topic
        assert hashes(one, topic) == hashes(two, topic), topic
        assert len(hashes(one, topic)) == 1
    server.destroy()


def hashes(domain, topic):
    found = domain.node.get_publishers_info_by_topic(topic)
    return {(info.topic_type, str(info.topic_type_hash)) for info in found}


def cycles(one, count):
    """Return how many messages arrived at type support that was made for each of them."""
    sent = RobotCommand()
    received = []
    for number in range(count):
        kind = raw_type("my_robot_controller/msg/RobotCommand")
        topic = f"cycle_{number}"
        publisher = one.node.create_publisher(kind, topic, 10)
        subscription = one.node.create_subscription(kind, topic, received.append, 10, raw=True)
        wait((one,), lambda own=publisher: own.get_subscription_count() == 1, "a subscription")
        publisher.publish(sent.serialize())
        wait((one,), lambda own=number: len(received) == own + 1, "a message")
        one.node.destroy_subscription(subscription)
        one.node.destroy_publisher(publisher)
    return sum(RobotCommand.deserialize(data) == sent for data in received)


def main(far):
    number = int(os.environ["ROS_DOMAIN_ID"])
    one, two = Domain(number), Domain(number + int(far))
    events(one, two)
    print("cycles", cycles(one, 100))
    for domain in (one, two):
        domain.node.destroy_node()
        rclpy.shutdown(context=domain.node.context)


if __name__ == "__main__":
    main(*sys.argv[1:])
