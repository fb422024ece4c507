"""Tests of the node talker, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from demo.msg import Command
import pytest
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import (
    DurabilityPolicy,
    qos_profile_sensor_data,
    QoSProfile,
)
from std_msgs.msg import String

MODULE = 'demo.talker'
Start = Callable[..., Any]
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PARAMETERS = {
    'speed': 0.5,
    'names': ['a', 'b'],
}


def test_it_publishes_command(start: Start, observer: Node) -> None:
    """Messages arrive on command, one after the other."""
    received: list[Command] = []
    observer.create_subscription(
        Command,
        'command',
        received.append,
        LATCHED,
    )
    node = start(MODULE)
    node.until(lambda: len(received) > 1, 20.3)


def test_it_receives_words(start: Start, observer: Node) -> None:
    """The node logs each message on ~/words."""
    publisher = observer.create_publisher(
        String,
        'talker/words',
        qos_profile_sensor_data,
    )
    node = start(MODULE)

    def heard() -> bool:
        publisher.publish(String())
        return bool(node.said('~/words: message', 2))

    node.until(heard)


def test_it_goes_on_with_tick(start: Start, observer: Node) -> None:
    """The timer tick calls its method repeatedly."""
    node = start(MODULE)
    node.until(lambda: node.said('tick\n', 2), 20.8)


def test_it_has_its_parameters(start: Start, observer: Node) -> None:
    """The parameters are declared, with their defaults."""
    client = observer.create_client(GetParameters, 'talker/get_parameters')
    node = start(MODULE)
    node.until(client.service_is_ready)
    answer = client.call_async(GetParameters.Request(names=list(PARAMETERS)))
    node.until(answer.done)
    values = [parameter_value_to_python(value) for value in answer.result().values]
    assert values == list(PARAMETERS.values()), node.output


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('talker')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
