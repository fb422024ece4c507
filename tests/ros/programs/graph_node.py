"""A node with the ends that are named: NAME, and then words such as `publisher:TYPE:TOPIC`.

`events` turns service introspection on; `mute` leaves out the service that describes types;
`busy` never answers; `dying` ends without a word once idlc looks.
"""

import os
import signal
import sys
import time
from importlib import import_module

import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_system_default
from rclpy.service_introspection import ServiceIntrospectionState


def main(name, *words):
    rclpy.init()
    mute = Parameter("start_type_description_service", value="mute" not in words)
    node = rclpy.create_node(name, parameter_overrides=[mute])
    kept = [make(node, *word.split(":")) for word in words if ":" in word]
    for one in kept if "events" in words else ():
        if hasattr(one, "configure_introspection"):
            one.configure_introspection(
                node.get_clock(), qos_profile_system_default, ServiceIntrospectionState.METADATA
            )
    print("ready", flush=True)
    while "busy" in words:
        time.sleep(1)
    if "dying" in words:
        die_when_seen(node)
    rclpy.spin(node)


def die_when_seen(node):
    while not any(name.startswith("_idlc_") for name in node.get_node_names()):
        time.sleep(0.1)
    time.sleep(1)
    os.kill(os.getpid(), signal.SIGKILL)


def make(node, role, type_, where):
    package, kind, name = type_.split("/")
    class_ = getattr(import_module(f"{package}.{kind}"), name)
    match role:
        case "publisher":
            return node.create_publisher(class_, where, 1)
        case "subscription":
            return node.create_subscription(class_, where, print, 1)
        case "server" if kind == "action":
            return ActionServer(node, class_, where, print)
        case "client" if kind == "action":
            return ActionClient(node, class_, where)
        case "server":
            return node.create_service(class_, where, lambda _, response: response)
        case "client":
            return node.create_client(class_, where)


if __name__ == "__main__":
    main(*sys.argv[1:])
