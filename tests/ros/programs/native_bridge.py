"""Carries messages from topics to others in serialized form: native_bridge.py FILE

What it knows of their types it knows from the libraries along AMENT_PREFIX_PATH alone, as a C++
bridge does. FILE holds {"names": [...], "topics": [[type, source, target, how], ...]}, where how is
"kept" for what is there for who comes late, and "passing" for what is not. It ends with its
standard input, and then prints a line for each topic of which the graph says different things.
"""

import _ctypes
import ctypes
import json
import os
import sys
import threading
from ctypes import c_char_p, c_void_p, py_object
from functools import partial
from pathlib import Path

import rclpy
from peer import EVENTS
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from waiting import join

INDEX = "share/ament_index/resource_index/packages"
DISPATCH = "rosidl_typesupport_cpp"
HOW = {"kept": EVENTS, "passing": QoSProfile(depth=100)}
NEVER_CALLED = (
    "_CREATE_ROS_MESSAGE",
    "_DESTROY_ROS_MESSAGE",
    "_CONVERT_FROM_PY",
    "_CONVERT_TO_PY",
)


def handle_of(name, mode):
    """Return a message's type support, found as rclcpp finds it; it outlives the library."""
    package, kind, short = name.split("/")
    prefixes = map(Path, os.environ["AMENT_PREFIX_PATH"].split(":"))
    prefix = next(one for one in prefixes if (one / INDEX / package).exists())
    path = prefix / "lib" / f"lib{package}__{DISPATCH}.so"
    library = ctypes.CDLL(str(path), mode)
    symbol = f"{DISPATCH}__get_message_type_support_handle__{package}__{kind}__{short}"
    get = library[symbol]
    get.restype = c_void_p
    handle = get()
    _ctypes.dlclose(library._handle)
    return handle


def raw_type(name, mode=os.RTLD_LAZY):
    """Return a class of which rclpy learns nothing but its type support."""
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = py_object, (c_void_p, c_char_p, c_void_p)
    capsule = new(handle_of(name, mode), None, None)
    # rclpy wants to see these, and calls none for messages in serialized form
    never = dict.fromkeys(NEVER_CALLED, "never called")
    return type(name, (type,), {"_TYPE_SUPPORT": capsule, **never})("Raw", (), {})


class Bridge:
    """A node, and the pairs of topics that it connects."""

    def __init__(self):
        self.node = rclpy.create_node("bridge")
        self.pairs = []

    def carry(self, name, source, target, how):
        """Publish on one topic what is received on another."""
        kind = raw_type(name)
        publisher = self.node.create_publisher(kind, target, HOW[how])
        self.pairs.append((source, target))

        listen = partial(
            self.node.create_subscription, kind, source, publisher.publish, HOW[how], raw=True
        )
        if how == "kept":
            listen()
            return

        def wait_for_others():
            if publisher.get_subscription_count():
                timer.cancel()
                listen()

        timer = self.node.create_timer(0.02, wait_for_others)

    def complain(self):
        """Print where the graph has more than one type or hash."""
        asked = (self.node.get_publishers_info_by_topic, self.node.get_subscriptions_info_by_topic)
        for pair in self.pairs:
            infos = [info for ask in asked for topic in pair for info in ask(topic)]
            told = {(info.topic_type, str(info.topic_type_hash)) for info in infos}
            if len(told) != 1 or len(infos) < 4:
                print(f"{pair[0]}: the graph says {told} of {len(infos)}", flush=True)


def main(file):
    rclpy.init()
    bridge = Bridge()
    known = json.loads(Path(file).read_text(encoding="utf-8"))
    for topic in known["topics"]:
        bridge.carry(*topic)
    executor = SingleThreadedExecutor()
    executor.add_node(bridge.node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    print("looked at", len(known["names"]), flush=True)
    sys.stdin.read()
    bridge.complain()
    executor.shutdown()
    join(thread)
    rclpy.shutdown()


if __name__ == "__main__":
    main(*sys.argv[1:])
