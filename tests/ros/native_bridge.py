"""Carries messages between two domains in serialized form: native_bridge.py ONE TWO FILE

What it knows of their types it knows from the libraries along AMENT_PREFIX_PATH alone, as a C++
bridge does. FILE holds {"names": [...]}: what the peer "one" publishes in domain ONE reaches domain
TWO, and the other way. It ends with its standard input.
"""

import contextlib
import ctypes
import json
import os
import sys
import threading
from ctypes import c_char_p, c_void_p, py_object
from pathlib import Path

import rclpy
from peer import LATCHED
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

INDEX = "share/ament_index/resource_index/packages"
DISPATCH = "rosidl_typesupport_cpp"
NEVER_CALLED = (
    "_CREATE_ROS_MESSAGE",
    "_DESTROY_ROS_MESSAGE",
    "_CONVERT_FROM_PY",
    "_CONVERT_TO_PY",
)


def handle_of(name):
    """Return a message's type support, found as rclcpp finds it."""
    package, kind, short = name.split("/")
    prefixes = map(Path, os.environ["AMENT_PREFIX_PATH"].split(":"))
    prefix = next(one for one in prefixes if (one / INDEX / package).exists())
    library = ctypes.CDLL(str(prefix / "lib" / f"lib{package}__{DISPATCH}.so"))
    symbol = f"{DISPATCH}__get_message_type_support_handle__{package}__{kind}__{short}"
    get = library[symbol]
    get.restype = c_void_p
    return get()


def raw_type(name):
    """Return a class of which rclpy learns nothing but its type support."""
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = py_object, (c_void_p, c_char_p, c_void_p)
    capsule = new(handle_of(name), None, None)
    # rclpy wants to see these, and calls none for messages in serialized form
    never = dict.fromkeys(NEVER_CALLED, "never called")
    return type(name, (type,), {"_TYPE_SUPPORT": capsule, **never})("Raw", (), {})


def carry(source, target, name, topic, qos=LATCHED):
    """Publish in one node what another one receives."""
    kind = raw_type(name)
    publisher = target.create_publisher(kind, topic, qos)
    return source.create_subscription(kind, topic, publisher.publish, qos, raw=True)


def node_in(domain):
    context = Context()
    rclpy.init(context=context, domain_id=int(domain))
    return rclpy.create_node(f"bridge_{domain}", context=context, enable_rosout=False)


def spin(node):
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    with contextlib.suppress(ExternalShutdownException):
        executor.spin()


def main(one, two, file):
    nodes = {"one": node_in(one), "two": node_in(two)}
    names = json.loads(Path(file).read_text(encoding="utf-8"))["names"]
    for name in names:
        for me, other in (("one", "two"), ("two", "one")):
            carry(nodes[me], nodes[other], name, f"{me}/{name}")
    threads = [threading.Thread(target=spin, args=(node,)) for node in nodes.values()]
    for thread in threads:
        thread.start()
    print("looked at", len(names), flush=True)
    sys.stdin.read()
    for node in nodes.values():
        node.context.try_shutdown()
    for thread in threads:
        thread.join()


if __name__ == "__main__":
    main(*sys.argv[1:])
