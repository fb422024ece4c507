"""What a busy and hostile system does to idlc's classes, each a function.

load.py NAME [ARGUMENT...]. The package `same` on PYTHONPATH is idlc's; its `Thing` holds every kind
of field, and other ones on the attacker's side. A function fails by raising; it prints what the
test looks at.
"""

import array
import contextlib
import itertools
import logging
import os
import random
import struct
import sys
import threading
import time
from functools import cache
from pathlib import Path

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.qos import QoSProfile
from same.msg import Thing
from trees import Values, class_of, shape_of
from waiting import PATIENCE, eventually, join

SIDES = 8
QOS = QoSProfile(depth=400)
#: Messages on their way at once, so that none is dropped where nobody dies.
WINDOW = 200
#: A message of the type that is called like the victim's and means something else.
OTHER = b"\0\1\0\0" + struct.pack("<dI8II6s", -1.5, 2**32 - 1, *range(8), 6, b"other")


def resident():
    """Return the resident memory in megabytes."""
    words = Path("/proc/self/statm").read_text("ascii").split()
    return int(words[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


KINDS = ("Arrays", "BoundedSequences", "Everything", "Inner", "Scalars", "Sequences")


@cache
def every_kind(number):
    """Return a message that holds every kind of field, some of the type in sequences."""
    names = [f"same/msg/{kind}" for kind in KINDS]
    values = Values({name: shape_of(class_of(*name.split("/"))) for name in names}, seed=number)
    return values.build("same/msg/Everything", values.invent("same/msg/Everything"))


def thing(sender, number):
    return Thing(
        name=f"{sender} {number}",
        numbers=array.array("i", [sender, number, sender ^ number]),
        words=[str(number)] * (number % 5),
        rest=[every_kind(index) for index in range(number % 8 - 5)],
    )


class Listener:
    """A subscription that checks each message; it may end at any moment and begin anew."""

    def __init__(self, node, group):
        self.node, self.group = node, group
        self.received = self.deaths = 0
        self.problems = []
        self.begin()

    def begin(self):
        self.subscription = self.node.create_subscription(
            Thing, "things", self.check, QOS, callback_group=self.group
        )

    def die(self):
        self.node.destroy_subscription(self.subscription)
        self.deaths += 1
        self.begin()

    def check(self, message):
        sender, number = map(int, message.name.split())
        # bytes, because a number that is none is not equal to itself
        if message.serialize() != thing(sender, number).serialize():
            self.problems.append(message)
        self.received += 1


def eight_by_eight(count):
    """Publish from eight threads, receive in eight subscriptions, some of which keep dying.

    Threads take turns as often as they can, so that one that waits for another while it holds
    the interpreter's lock is found out within a few messages.
    """
    sys.setswitchinterval(1e-5)
    rclpy.init()
    node = rclpy.create_node("load")
    executor = MultiThreadedExecutor(SIDES)
    executor.add_node(node)
    group = ReentrantCallbackGroup()
    listeners = [Listener(node, group) for _ in range(SIDES)]
    steady = listeners[: SIDES // 2]
    publishers = [node.create_publisher(Thing, "things", QOS) for _ in range(SIDES)]
    for publisher in publishers:
        eventually(lambda one=publisher: one.get_subscription_count() >= SIDES)
    over = threading.Event()
    spinning = threading.Thread(target=spin_on, args=(executor, over))
    spinning.start()
    chance = random.Random(1)
    total = int(count)
    published = [0] * SIDES

    def publish(sender, until):
        for number in range(published[sender], until):
            eventually(lambda: sum(published) - min(one.received for one in steady) < WINDOW)
            publishers[sender].publish(thing(sender, number))
            published[sender] += 1

    def send(until, deadly):
        threads = [threading.Thread(target=publish, args=(one, until)) for one in range(SIDES)]
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            if deadly:
                chance.choice(listeners[SIDES // 2 :]).die()
            time.sleep(chance.random() / 20)

    # until the test, which kills subscribers in processes of their own, has had enough of it
    enough = threading.Event()
    threading.Thread(target=lambda: sys.stdin.readline() and enough.set(), daemon=True).start()
    for portion in itertools.count(1):
        send(total * portion // 10 // SIDES, deadly=True)
        if portion >= 5 and enough.is_set():
            break
    # who dies leaves traces in rclpy and in the middleware, so memory is compared without
    memory = []
    for last in range(portion + 1, portion + 6):
        memory.append(resident())
        send(total * last // 10 // SIDES, deadly=False)
    eventually(lambda: all(one.received == sum(published) for one in steady))
    assert not any(one.problems for one in listeners)
    over.set()
    join(spinning)
    executor.shutdown()
    deaths = sum(one.deaths for one in listeners)
    print(sum(published), deaths, memory[1], resident(), flush=True)


def spin_on(executor, over):
    """Spin until `over`; rclpy's executor stumbles over what is destroyed while it looks for work.

    It does so with rosidl's classes, too.
    """
    while not over.is_set():
        try:
            executor.spin_once(timeout_sec=0.5)
        except InvalidHandle:
            continue


def doomed():
    """Receive, in a process of its own, until it is killed."""
    rclpy.init()
    node = rclpy.create_node("doomed")
    node.create_subscription(Thing, "things", lambda _: print("one", flush=True), QOS)
    print("ready", flush=True)
    rclpy.spin(node)


def ends_within_a_callback(how):
    """Let the interpreter end while other threads convert messages and are in callbacks."""
    rclpy.init()
    node = rclpy.create_node("ending")
    executor = SingleThreadedExecutor()  # its callbacks run in the thread that spins
    executor.add_node(node)
    inside = threading.Event()

    def slow(message):
        inside.set()
        for _ in range(10**7):
            Thing.deserialize(message.serialize())

    node.create_subscription(Thing, "things", slow, QOS)
    publisher = node.create_publisher(Thing, "things", QOS)

    def flood():
        for number in range(10**6):
            publisher.publish(thing(1, number))

    threading.Thread(target=executor.spin, daemon=True).start()
    threading.Thread(target=flood, daemon=True).start()
    assert inside.wait(PATIENCE)
    if how == "exit":
        sys.exit(0)
    if how == "shutdown":
        rclpy.shutdown()
    if how == "raise":
        raise SystemExit(0)


def victim():
    """Count the sound messages among what anybody sends, until the input ends."""
    logging.disable()
    rclpy.init()
    node = rclpy.create_node("victim")
    sound = {"": 0}

    def check(message):
        if message.name == "sound" and message.words == ["a", "b"]:
            sound[""] += 1
        repr(message), message.serialize()

    node.create_subscription(Thing, "things", check, QoSProfile(depth=2000))
    executor = MultiThreadedExecutor(2)
    executor.add_node(node)
    spinning = threading.Thread(target=spin, args=(executor,))
    spinning.start()
    print("ready", flush=True)
    for _ in sys.stdin:
        print(sound[""], flush=True)
    rclpy.shutdown()
    # an interpreter that ends while rclpy's C++ waits for its lock ends with std::terminate
    join(spinning)
    executor.shutdown()


def spin(executor):
    with contextlib.suppress(ExternalShutdownException):
        executor.spin()


def attacker(count):
    """Send, under the name of the victim's type, messages of another one, and raw garbage."""
    rclpy.init()
    node = rclpy.create_node("attacker")
    publisher = node.create_publisher(Thing, "things", QoSProfile(depth=2000))
    eventually(lambda: node.get_subscriptions_info_by_topic("/things"))
    time.sleep(1)  # what is found is connected by then, if it ever is
    chance = random.Random(3)
    for number in range(int(count)):
        if number % 3 == 0:
            publisher.publish(OTHER)
            continue
        data = bytearray(OTHER)
        for _ in range(chance.randrange(8)):
            data[chance.randrange(len(data))] = chance.choice([0, 1, 255, chance.randrange(256)])
        publisher.publish(bytes(data[: chance.randrange(1, len(data) + 1)]))
    print("done", publisher.get_subscription_count(), flush=True)
    sys.stdin.read()
    rclpy.shutdown()


def friend(count):
    """Send sound messages."""
    rclpy.init()
    node = rclpy.create_node("friend")
    publisher = node.create_publisher(Thing, "things", QoSProfile(depth=2000))
    eventually(lambda: publisher.get_subscription_count() > 0)
    for _ in range(int(count)):
        publisher.publish(Thing(name="sound", words=["a", "b"]))
    print("done", publisher.get_subscription_count(), flush=True)
    sys.stdin.read()
    rclpy.shutdown()


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
