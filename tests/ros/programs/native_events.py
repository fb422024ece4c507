"""Events and feedback of idlc's nodes, seen through the library: native_events.py FAR

A node serves and calls, with introspection; a bridge that has nothing but the library carries what
it tells of that to the namespace FAR. What arrives there must be what arrives here. Then type
support is used and given back a hundred times.
"""

import sys
import time

import rclpy
from my_robot_controller.action import Countdown
from my_robot_controller.msg import RobotCommand
from my_robot_controller.srv import AddTwoInts
from native_bridge import carry, raw_type
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


def listen(node, start):
    """Return lists by topic that fill with what is received."""
    heard = {topic: [] for topic in TOPICS}
    for topic, (cls, _, qos) in TOPICS.items():
        node.create_subscription(cls, start + topic, heard[topic].append, qos)
    return heard


def wait(executor, done, what):
    end = time.monotonic() + PATIENCE
    while not done():
        if time.monotonic() > end:
            sys.exit(f"not in time: {what}")
        executor.spin_once(timeout_sec=0.1)


def add(request, response):
    response.sum = request.a + request.b
    return response


def count_down(handle):
    for left in range(CALLS):
        handle.publish_feedback(Countdown.Feedback(left))
    handle.succeed()
    return Countdown.Result()


def events(node, executor, far):
    """Compare what is heard here and there."""
    service = node.create_service(AddTwoInts, "add", add)
    client = node.create_client(AddTwoInts, "add")
    for each in (service, client):
        contents = ServiceIntrospectionState.CONTENTS
        each.configure_introspection(node.get_clock(), EVENTS, contents)
    server = ActionServer(node, Countdown, "count", count_down)
    goals = ActionClient(node, Countdown, "count")
    here, there = listen(node, ""), listen(node, far)
    for topic, (_, name, qos) in TOPICS.items():
        carry(node, name, topic, far + topic, qos)
    ready = lambda: (  # noqa: E731
        client.service_is_ready()
        and goals.server_is_ready()
        and node.count_subscribers(FEEDBACK) >= 2
        and node.count_publishers(far + FEEDBACK) == 1
        and node.count_subscribers(far + FEEDBACK) == 1
    )
    wait(executor, ready, "discovery")
    for number in range(CALLS):
        future = client.call_async(AddTwoInts.Request(number, 1 << 40))
        wait(executor, future.done, "a call")
    sent = goals.send_goal_async(Countdown.Goal())
    wait(executor, sent.done, "a goal")
    done = sent.result().get_result_async()
    wait(executor, done.done, "a result")
    told = {EVENT: 4 * CALLS, FEEDBACK: CALLS}
    enough = lambda: all(  # noqa: E731
        len(heard[topic]) >= count for heard in (here, there) for topic, count in told.items()
    )
    wait(executor, enough, "what was heard")
    for topic in TOPICS:
        # introspection has two publishers here, client and service, whose order is open
        texts = [sorted(str(message) for message in heard[topic]) for heard in (here, there)]
        assert texts[0] == texts[1], topic
        assert hashes(node, topic) == hashes(node, far + topic), topic
        assert len(hashes(node, topic)) == 1
    server.destroy()


def hashes(node, topic):
    found = node.get_publishers_info_by_topic(topic)
    return {(info.topic_type, str(info.topic_type_hash)) for info in found}


def cycles(node, executor, count):
    """Return how many messages arrived at type support that was made for each of them."""
    sent = RobotCommand()
    received = []
    for number in range(count):
        kind = raw_type("my_robot_controller/msg/RobotCommand")
        topic = f"cycle_{number}"
        publisher = node.create_publisher(kind, topic, 10)
        subscription = node.create_subscription(kind, topic, received.append, 10, raw=True)
        wait(executor, lambda own=publisher: own.get_subscription_count() == 1, "a subscription")
        publisher.publish(sent.serialize())
        wait(executor, lambda own=number: len(received) == own + 1, "a message")
        node.destroy_subscription(subscription)
        node.destroy_publisher(publisher)
    return sum(RobotCommand.deserialize(data) == sent for data in received)


def main(far):
    rclpy.init()
    node = rclpy.create_node("events")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    events(node, executor, far)
    print("cycles", cycles(node, executor, 100))
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main(*sys.argv[1:])
