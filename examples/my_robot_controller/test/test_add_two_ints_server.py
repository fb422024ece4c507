"""Tests of the node add_two_ints_server."""

from typing import Any

from my_robot_controller.srv import AddTwoInts

NODE = 'my_robot_controller.add_two_ints_server'


def test_it_answers_add_two_ints(observer: Any) -> None:
    """Requests to add_two_ints are answered, one after the other."""
    client = observer.create_client(AddTwoInts, 'add_two_ints')
    observer.until(client.service_is_ready)
    for _ in range(2):
        answer = client.call_async(AddTwoInts.Request())
        observer.until(answer.done)
    assert 'add_two_ints: request' in observer.log.read_text()
