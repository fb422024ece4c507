"""Tests of the node oracle, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from demo.srv import Ask
import pytest
from rclpy.node import Node

MODULE = 'demo.oracle'
Start = Callable[..., Any]


def test_it_answers_ask(start: Start, observer: Node) -> None:
    """Requests to ask are answered, one after the other."""
    client = observer.create_client(
        Ask,
        'ask',
    )
    node = start(MODULE)
    node.until(client.service_is_ready)
    for _ in range(2):
        answer = client.call_async(Ask.Request())
        node.until(answer.done)
    node.until(lambda: node.said('ask: request', 2))


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE)
    node.until_it_spins('oracle')
    assert node.end(how) == 0, node.output
    assert 'Traceback' not in node.output, node.output
