"""One of two processes that talk over DDS: peer.py STEP ME OTHER FILE

FILE holds {"names": [...], "shapes": {...}}. Both sides invent the same values from the name and
the sender, so each knows what the other must have sent. A step prints one line per disagreement,
then "looked at N"; it then goes on serving until its standard input ends.

messages  publish every message on a latched topic, and take what the other publishes
serve     offer every service and action
call      call each service and action of the other, with introspection of the services
"""

import json
import sys
import threading
import time
import zlib
from functools import partial
from pathlib import Path

import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.service_introspection import ServiceIntrospectionState
from rclpy.utilities import remove_ros_args
from trees import Values, class_of
from waiting import eventually, join

COUNT = 4
LATCHED = QoSProfile(depth=COUNT, durability=DurabilityPolicy.TRANSIENT_LOCAL)
EVENTS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PATIENCE = 90.0  # messages of some hundred types arrive at once
RESULT_STATUS = {"succeeded": 4, "canceled": 5}


def interface_of(name):
    package, kind, short = name.split("/")
    return class_of(package, kind, short)


class Peer:
    """What a side knows: names, expected values, complaints."""

    def __init__(self, me, other, file):
        known = json.loads(Path(file).read_text(encoding="utf-8"))
        self.me, self.other = me, other
        self.names, self.shapes = known["names"], known["shapes"]
        self.node = rclpy.create_node(me)
        self.looked_at = 0

    def trees(self, name, sender):
        values = Values(self.shapes, seed=zlib.crc32(f"{sender} {name}".encode()))
        return [values.invent(name) for _ in range(COUNT)]

    def build(self, name, tree):
        return Values(self.shapes).build(name, tree)

    def compare(self, name, what, message, expected):
        found = Values(self.shapes).plain(name, message)
        if found != expected:
            self.complain(name, f"{what}: {found!r} is not {expected!r}")
        if type(message) is not interface_of(name):
            self.complain(name, f"{what} is a {type(message)}")

    def complain(self, name, what):
        print(f"{name}: {what}"[:500], flush=True)

    def wait(self, executor, done, what):
        try:
            eventually(done, executor, limit=PATIENCE)
        except AssertionError:
            self.complain(what, "not in time")


def messages(peer):
    received = {name: [] for name in peer.names}
    publishers = []
    for name in peer.names:
        cls = interface_of(name)
        publisher = peer.node.create_publisher(cls, f"{peer.me}/{name}", LATCHED)
        for tree in peer.trees(name, peer.me):
            publisher.publish(peer.build(name, tree))
        publishers.append(publisher)
        topic = f"{peer.other}/{name}"
        peer.node.create_subscription(cls, topic, received[name].append, LATCHED)
    executor = SingleThreadedExecutor()
    executor.add_node(peer.node)
    complete = lambda: all(len(found) >= COUNT for found in received.values())  # noqa: E731
    peer.wait(executor, complete, "messages")
    for name, found in received.items():
        for message, tree in zip(found, peer.trees(name, peer.other), strict=False):
            peer.compare(name, "received", message, tree)
        if len(found) != COUNT:
            peer.complain(name, f"{len(found)} messages received")
        compare_graph(peer, name)
    peer.looked_at = len(received)


def compare_graph(peer, name):
    """Compare type name and hash as the graph tells them, of either side."""
    told = [
        [
            (info.topic_type, str(info.topic_type_hash))
            for info in peer.node.get_publishers_info_by_topic(f"{side}/{name}")
        ]
        for side in (peer.me, peer.other)
    ]
    if told[0] != told[1] or len(told[0]) != 1:
        peer.complain(name, f"the graph says {told}")


def serve(peer):
    """Answer from another thread; return what ends it."""
    executor = MultiThreadedExecutor(4)
    executor.add_node(peer.node)
    for name in peer.names:
        if "/srv/" in name:
            serve_service(peer, name)
        else:
            serve_action(peer, name)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    peer.looked_at = len(peer.names)

    def end():
        executor.shutdown()
        join(thread)

    return end


def serve_service(peer, name):
    requests = iter(peer.trees(f"{name}_Request", peer.other))
    responses = iter(peer.trees(f"{name}_Response", peer.me))

    def answer(request, response):
        peer.compare(f"{name}_Request", "request", request, next(requests))
        if type(response) is not interface_of(name).Response:
            peer.complain(name, f"the empty response is a {type(response)}")
        return peer.build(f"{name}_Response", next(responses))

    service = peer.node.create_service(interface_of(name), f"{peer.me}/{name}", answer)
    contents = ServiceIntrospectionState.CONTENTS
    service.configure_introspection(peer.node.get_clock(), EVENTS, contents)


def serve_action(peer, name):
    """Succeed at the first goal; wait at the second until it is cancelled."""
    goals = iter(peer.trees(f"{name}_Goal", peer.other))
    results = iter(peer.trees(f"{name}_Result", peer.me))

    def execute(handle, last):
        peer.compare(f"{name}_Goal", "goal", handle.request, next(goals))
        # rclpy knows the client as soon as its services match; feedback may be sent too early
        feedback = f"/{peer.me}/{name}/_action/feedback"
        eventually(lambda: peer.node.count_subscribers(feedback))
        time.sleep(0.1)
        for tree in peer.trees(f"{name}_Feedback", peer.me):
            handle.publish_feedback(peer.build(f"{name}_Feedback", tree))
        if last:
            eventually(lambda: handle.is_cancel_requested)
            handle.canceled()
        else:
            handle.succeed()
        return peer.build(f"{name}_Result", next(results))

    order = iter([False, True])
    ActionServer(
        peer.node,
        interface_of(name),
        f"{peer.me}/{name}",
        lambda handle: execute(handle, next(order)),
        cancel_callback=lambda _: CancelResponse.ACCEPT,
    )


def call(peer):
    executor = SingleThreadedExecutor()
    executor.add_node(peer.node)
    finish = partial(result_of, peer, executor)
    for name in peer.names:
        if "/srv/" in name:
            call_service(peer, name, finish)
        else:
            call_action(peer, name, finish)
        peer.looked_at += 1


def result_of(peer, executor, future, name):
    peer.wait(executor, future.done, name)
    return future.result()


class Collected:
    """A list that is done, as a future is, when it holds `count` items."""

    def __init__(self, count):
        self.items = []
        self.done = lambda: len(self.items) >= count
        self.result = lambda: self.items


def call_service(peer, name, finish):
    cls = interface_of(name)
    client = peer.node.create_client(cls, f"{peer.other}/{name}")
    contents = ServiceIntrospectionState.CONTENTS
    client.configure_introspection(peer.node.get_clock(), EVENTS, contents)
    # both sides tell two events of each call
    events = Collected(4 * COUNT)
    topic = f"{peer.other}/{name}/_service_event"
    peer.node.create_subscription(cls.Event, topic, events.items.append, EVENTS)
    if not client.wait_for_service(PATIENCE):
        peer.complain(name, "no service")
        return
    requests = peer.trees(f"{name}_Request", peer.me)
    responses = peer.trees(f"{name}_Response", peer.other)
    for request, response in zip(requests, responses, strict=True):
        future = client.call_async(peer.build(f"{name}_Request", request))
        peer.compare(f"{name}_Response", "response", finish(future, name), response)
    told = {"_Request": [], "_Response": []}
    for event in finish(events, f"{name}_Event"):
        told["_Request"] += event.request
        told["_Response"] += event.response
        if len(event.request) + len(event.response) != 1 or len(event.info.client_gid) != 16:
            peer.complain(name, f"the event {event}")
    for suffix, trees in (("_Request", requests), ("_Response", responses)):
        found = sorted(
            json.dumps(Values(peer.shapes).plain(name + suffix, m)) for m in told[suffix]
        )
        if found != sorted(json.dumps(tree) for tree in trees * 2):
            peer.complain(name + suffix, "the events tell something else")


def call_action(peer, name, finish):
    cls = interface_of(name)
    client = ActionClient(peer.node, cls, f"{peer.other}/{name}")
    if not client.wait_for_server(PATIENCE):
        peer.complain(name, "no action server")
        return
    goals = peer.trees(f"{name}_Goal", peer.me)
    results = peer.trees(f"{name}_Result", peer.other)
    for goal, result, end in zip(goals, results, RESULT_STATUS, strict=False):
        feedback = Collected(COUNT)
        sent = client.send_goal_async(
            peer.build(f"{name}_Goal", goal), feedback_callback=feedback.items.append
        )
        handle = finish(sent, name)
        for told, tree in zip(
            finish(feedback, name), peer.trees(f"{name}_Feedback", peer.other), strict=True
        ):
            peer.compare(f"{name}_Feedback", "feedback", told.feedback, tree)
        if end == "canceled":
            cancelled = finish(handle.cancel_goal_async(), name)
            if len(cancelled.goals_canceling) != 1:
                peer.complain(name, f"cancelling gave {cancelled}")
        final = finish(handle.get_result_async(), name)
        peer.compare(f"{name}_Result", "result", final.result, result)
        if not handle.accepted or final.status != RESULT_STATUS[end]:
            peer.complain(name, f"{end}: accepted {handle.accepted}, status {final.status}")


if __name__ == "__main__":
    step, *arguments = remove_ros_args(sys.argv)[1:]
    rclpy.init()
    peer = Peer(*arguments)
    end = {"messages": messages, "serve": serve, "call": call}[step](peer)
    print("looked at", peer.looked_at, flush=True)
    sys.stdin.read()
    if end:
        end()
    rclpy.shutdown()
