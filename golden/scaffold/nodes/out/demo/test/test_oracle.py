"""Tests of the node oracle."""

from typing import Any

from demo.srv import Ask

NODE = 'demo.oracle'


def test_it_answers_ask(observer: Any) -> None:
    """Requests to ask are answered, one after the other."""
    client = observer.create_client(Ask, 'ask')
    observer.until(client.service_is_ready)
    for _ in range(2):
        answer = client.call_async(Ask.Request())
        observer.until(answer.done)
    assert 'ask: request' in observer.log.read_text()
