"""What rclpy and its tools do with names that Python or messages need themselves.

`hiding_msgs` on PYTHONPATH is idlc's; its fields have the names of methods, and its messages those
of Python's constants. Fails by raising.
"""

import importlib
import inspect
import pydoc
import unittest.mock

import rclpy
import rclpy.action
import rosidl_parser.definition as definition
from hiding_msgs.action import False_
from hiding_msgs.msg import Hiding, None_, Part, True_
from hiding_msgs.srv import None_ as NoneService
from rclpy.serialization import deserialize_message, serialize_message
from structs_side import Memory
from waiting import eventually

HIDING = Hiding(1, 2, [3.5], "4", [5, 6, 7], True, [False], [Part(1, 2)], Part(6), 8, 9)
TRUE = True_(None_(1), [None_(2)], [None_(3), None_(4)])


def check_tools():
    for cls in (Hiding, None_, True_, Part):
        for one in (cls, cls()):
            assert len(one.SLOT_TYPES) == len(cls.__slots__)
            assert dict(inspect.getmembers(one))["SLOT_TYPES"] == cls.SLOT_TYPES
            assert pydoc.render_doc(one)
        assert unittest.mock.create_autospec(cls)().SLOT_TYPES is not None
    assert isinstance(Hiding.SLOT_TYPES[2], definition.UnboundedSequence)
    assert True_.SLOT_TYPES[0].name == "None"
    # as ROS's tools look for types
    assert getattr(importlib.import_module("hiding_msgs.msg"), "None") is None_
    assert getattr(importlib.import_module("hiding_msgs.srv"), "None") is NoneService
    assert getattr(importlib.import_module("hiding_msgs.action"), "False") is False_


def check_serialization():
    for message in (HIDING, TRUE):
        data = serialize_message(message)
        assert data == type(message).__mro__[1].serialize(message)
        assert deserialize_message(data, type(message)) == message


def check_structs():
    """As Cyclone DDS would: through C structures."""
    from hiding_msgs._idlc import structs, typeinfo

    for message in (HIDING, TRUE):
        memory = Memory(structs.message(type(message), typeinfo.structure_of(type(message))))
        place = memory.create()
        assert memory.store(message, place)
        assert memory.fetch(place) == message
        memory.destroy(place)


def check_communication(node):
    received = []
    publishers = [node.create_publisher(type(m), f"t{i}", 1) for i, m in enumerate((HIDING, TRUE))]
    for index, message in enumerate((HIDING, TRUE)):
        node.create_subscription(type(message), f"t{index}", received.append, 1)
    eventually(lambda: all(publisher.get_subscription_count() for publisher in publishers), node)
    for publisher, message in zip(publishers, (HIDING, TRUE), strict=True):
        publisher.publish(message)
    eventually(lambda: len(received) == 2, node)
    assert HIDING in received
    assert TRUE in received

    node.create_service(NoneService, "s", lambda _request, _response: NoneService.Response(b=TRUE))
    client = node.create_client(NoneService, "s")
    eventually(client.service_is_ready, node)
    answer = client.call_async(NoneService.Request(a=None_(5)))
    eventually(answer.done, node)
    assert answer.result().b == TRUE

    def execute(goal):
        goal.succeed()
        return False_.Result(b=goal.request.a.a)

    server = rclpy.action.ActionServer(node, False_, "a", execute)
    client = rclpy.action.ActionClient(node, False_, "a")
    eventually(client.server_is_ready, node)
    sent = client.send_goal_async(False_.Goal(a=None_(7)))
    eventually(sent.done, node)
    result = sent.result().get_result_async()
    eventually(result.done, node)
    assert result.result().result.b == 7
    server.destroy()


check_tools()
check_serialization()
check_structs()
rclpy.init()
a_node = rclpy.create_node("citizens")
check_communication(a_node)
a_node.destroy_node()
rclpy.shutdown()
