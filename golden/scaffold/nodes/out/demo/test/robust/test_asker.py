"""Tests of the node asker, on the real rclpy."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any

from demo.srv import Ask
import pytest
from rclpy.node import Node

MODULE = 'demo.asker'
Start = Callable[..., Any]


def test_it_calls_ask(start: Start, observer: Node) -> None:
    """The node calls ask and logs the response."""
    requests: list[object] = []

    def answer(request: object, response: object) -> object:
        requests.append(request)
        return response

    observer.create_service(
        Ask,
        'ask',
        answer,
    )
    node = start(MODULE)
    node.until(lambda: bool(requests))
    node.until(lambda: node.said('ask: response'))
    node.until(node.ended)
    assert node.process.returncode == 0, node.output


def test_it_says_so_when_nobody_answers(start: Start) -> None:
    """Without a server the node logs an error and ends with status 1."""
    node = start(MODULE, '--server-timeout', '0.5')
    node.until(node.ended)
    assert node.process.returncode == 1, node.output
    assert 'gave up waiting for a server' in node.output, node.output
    assert 'Traceback' not in node.output, node.output


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_it_is_asked_to(start: Start, observer: Node, how: signal.Signals) -> None:
    """The node ends without a traceback on Ctrl-C and on SIGTERM."""
    node = start(MODULE, '--server-timeout', '1000')
    node.until_it_spins('asker')
    assert node.end(how) == 130, node.output
    assert 'Traceback' not in node.output, node.output
