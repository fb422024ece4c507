"""Tests of the node caller."""

from typing import Any

from demo.srv import Ask

NODE = 'demo.caller'


def test_it_calls_ask(observer: Any) -> None:
    """The node calls ask, logs the response and ends."""
    observer.create_service(Ask, 'ask', lambda request, response: response)
    observer.until(lambda: 'ask: response' in observer.log.read_text())
    observer.until(lambda: observer.process.poll() == 0)


def test_it_waits_for_a_server(observer: Any) -> None:
    """The node can be stopped while it waits for a server."""
    observer.until(lambda: 'waiting for a server' in observer.log.read_text())
