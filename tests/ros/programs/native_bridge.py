"""Carries messages between two namespaces in serialized form: native_bridge.py FAR FILE

What it knows of their types it knows from the libraries along AMENT_PREFIX_PATH alone, as a C++
bridge does. FILE holds {"names": [...]}: what the peer "one" publishes reaches the namespace FAR,
and what "two" publishes there comes from it. It ends with its standard input.
"""

import ctypes
import json
import os
import sys
import threading
from ctypes import c_char_p, c_void_p, py_object
from pathlib import Path

import rclpy
from peer import LATCHED
from rclpy.executors import SingleThreadedExecutor

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


def carry(node, name, source, target, qos=LATCHED):
    """Publish on one topic what is received on another."""
    kind = raw_type(name)
    publisher = node.create_publisher(kind, target, qos)
    return node.create_subscription(kind, source, publisher.publish, qos, raw=True)


def main(far, file):
    rclpy.init()
    node = rclpy.create_node("bridge")
    names = json.loads(Path(file).read_text(encoding="utf-8"))["names"]
    for name in names:
        carry(node, name, f"/one/{name}", f"{far}/one/{name}")
        carry(node, name, f"{far}/two/{name}", f"/two/{name}")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    print("looked at", len(names), flush=True)
    sys.stdin.read()
    executor.shutdown()
    thread.join()
    rclpy.shutdown()


if __name__ == "__main__":
    main(*sys.argv[1:])
