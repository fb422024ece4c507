"""Tests of the node translator, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from demo.translator_conversion import (
    NewAsk,
    NewDrive,
    OldAsk,
    OldDrive,
)
import pytest
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data

MODULE = 'demo.translator'
Start = Callable[..., Any]


def test_it_translates_drive(start: Start, observer: Node) -> None:
    """Messages on drive arrive in the new version."""
    received: list[NewDrive] = []
    observer.create_subscription(
        NewDrive,
        'drive_v2',
        received.append,
        qos_profile_sensor_data,
    )
    publisher = observer.create_publisher(
        OldDrive,
        'drive',
        qos_profile_sensor_data,
    )
    node = start(MODULE)

    def translated() -> bool:
        publisher.publish(OldDrive())
        return bool(received)

    node.until(translated)


def test_it_translates_ask(start: Start, observer: Node) -> None:
    """Requests to ask reach a server of the new version."""
    requests: list[object] = []

    def answer(request: object, response: object) -> object:
        requests.append(request)
        return response

    observer.create_service(
        NewAsk,
        'ask_v2',
        answer,
    )
    client = observer.create_client(
        OldAsk,
        'ask',
    )
    node = start(MODULE)
    node.until(client.service_is_ready)
    response = client.call_async(OldAsk.Request())
    node.until(response.done)
    assert isinstance(response.result(), OldAsk.Response)
    assert isinstance(requests[0], NewAsk.Request)


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until(lambda: 'translator' in observer.get_node_names())
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
