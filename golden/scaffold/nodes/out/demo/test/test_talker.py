"""Tests of the node talker."""

from typing import Any

from demo.msg import Command
from rcl_interfaces.srv import GetParameters
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import DurabilityPolicy, qos_profile_sensor_data, QoSProfile
from std_msgs.msg import String

NODE = 'demo.talker'
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_it_publishes_command(observer: Any) -> None:
    """Messages arrive on command, one after the other."""
    received: list[Command] = []
    observer.create_subscription(Command, 'command', received.append, LATCHED)
    observer.until(lambda: len(received) > 1, 20.3)


def test_it_receives_words(observer: Any) -> None:
    """The node logs the messages on ~/words."""
    publisher = observer.create_publisher(String, 'talker/words', qos_profile_sensor_data)
    observer.create_timer(0.1, lambda: publisher.publish(String()))
    observer.until(lambda: observer.log.read_text().count('~/words: message') > 1)


def test_it_repeats_tick(observer: Any) -> None:
    """The timer calls its method again and again."""
    observer.until(lambda: observer.log.read_text().count(': tick\n') > 1, 20.8)


def test_parameters(observer: Any) -> None:
    """The node declares its parameters, with their defaults."""
    client = observer.create_client(GetParameters, 'talker/get_parameters')
    parameters = {'speed': 0.5, 'names': ['a', 'b']}
    observer.until(client.service_is_ready)
    answer = client.call_async(GetParameters.Request(names=list(parameters)))
    observer.until(answer.done)
    values = [parameter_value_to_python(value) for value in answer.result().values]
    assert values == list(parameters.values()), observer.log.read_text()
