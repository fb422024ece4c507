"""A node of rclpy that echoes, serves and calls, and prints what it saw; it ends with its input."""

import json
import sys
import threading
from contextlib import suppress

import rclpy
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.service_introspection import ServiceIntrospectionState
from sensor_msgs.msg import Image
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci
from type_description_interfaces.srv import GetTypeDescription

LATCHED = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LIMIT = 60


def serve(request, response):
    response.success, response.message = request.data, "theirs"
    return response


def execute(goal):
    goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
    goal.succeed()
    return Fibonacci.Result(sequence=[0, 1, 1, 2][: goal.request.order])


rclpy.init()
node = rclpy.create_node("peer")
node.declare_parameter("rate", 1.5)
back = node.create_publisher(String, "back", 1000)
node.create_subscription(String, "words", back.publish, 1000)
images = node.create_publisher(Image, "images_back", 5)
node.create_subscription(Image, "images", images.publish, 5)
latched = node.create_publisher(String, "latched", LATCHED)
for number in range(5):
    latched.publish(String(data=str(number)))
service = node.create_service(SetBool, "theirs", serve)
clock, contents = node.get_clock(), ServiceIntrospectionState.CONTENTS
service.configure_introspection(clock, LATCHED, contents)
server = ActionServer(node, Fibonacci, "count", execute)
cycle = LifecycleNode("their_cycle")

client = node.create_client(SetBool, "ours")
client.configure_introspection(clock, LATCHED, ServiceIntrospectionState.METADATA)
events = []
parameters = {
    kind: node.create_client(kind, f"ours/{name}_parameters")
    for name, kind in (("get", GetParameters), ("set", SetParameters))
}
change = node.create_client(ChangeState, "our_cycle/change_state")
state = node.create_client(GetState, "our_cycle/get_state")
types = node.create_client(GetTypeDescription, "ours/get_type_description")
action = ActionClient(node, Fibonacci, "our_count")


def keep(event):
    data = [each.data for each in event.request] + [each.message for each in event.response]
    events.append([event.info.event_type, event.info.sequence_number, data])
    if len(events) == 4:
        report("events", sorted(events))


every = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
node.create_subscription(SetBool.Event, "ours/_service_event", keep, every)


def done(future):
    ended = threading.Event()
    future.add_done_callback(lambda _: ended.set())
    assert ended.wait(LIMIT)
    return future.result()


def ask(client, request):
    assert client.wait_for_service(LIMIT)
    return done(client.call_async(request))


def report(name, value):
    print(json.dumps([name, value]), flush=True)


def work():
    report("service", ask(client, SetBool.Request(data=True)).message)
    value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=2.5)
    rate = [Parameter(name="rate", value=value)]
    (result,) = ask(parameters[SetParameters], SetParameters.Request(parameters=rate)).results
    (value,) = ask(parameters[GetParameters], GetParameters.Request(names=["rate"])).values
    report("parameters", [result.successful, value.double_value])
    described = ask(types, GetTypeDescription.Request(type_name="std_msgs/msg/String"))
    fields = described.type_description.type_description.fields
    report("types", [described.successful, [field.name for field in fields]])
    request = ChangeState.Request()
    request.transition.id = 1
    is_changed = ask(change, request).success
    report("lifecycle", [is_changed, ask(state, GetState.Request()).current_state.label])
    assert action.wait_for_server(LIMIT)
    steps = []
    goal = done(
        action.send_goal_async(
            Fibonacci.Goal(order=3), lambda message: steps.append([*message.feedback.sequence])
        )
    )
    result = done(goal.get_result_async()).result
    report("action", [[*result.sequence], steps])
    topics, services = node.get_topic_names_and_types(), node.get_service_names_and_types()
    report("graph", [node.get_node_names(), dict(topics), dict(services)])
    if hasattr(node, "get_publishers_info_by_topic"):
        (info,) = node.get_publishers_info_by_topic("words")
        report("publisher", [info.node_name, str(info.topic_type_hash), info.qos_profile.depth])


threading.Thread(target=work, daemon=True).start()
threading.Thread(target=lambda: (sys.stdin.read(), rclpy.try_shutdown()), daemon=True).start()
executor = SingleThreadedExecutor()
executor.add_node(node)
executor.add_node(cycle)
with suppress(ExternalShutdownException):
    executor.spin()
