"""Tests of the node add_two_ints_client."""

from typing import Any

from my_robot_controller.srv import AddTwoInts

NODE = 'my_robot_controller.add_two_ints_client'


def test_it_calls_add_two_ints(observer: Any) -> None:
    """The node calls add_two_ints, logs the response and ends."""
    observer.create_service(AddTwoInts, 'add_two_ints', lambda request, response: response)
    observer.until(lambda: 'Result: ' in observer.log.read_text())
    observer.until(lambda: observer.process.poll() == 0)


def test_it_waits_for_a_server(observer: Any) -> None:
    """The node can be stopped while it waits for a server."""
    observer.until(lambda: 'waiting for a server' in observer.log.read_text())
