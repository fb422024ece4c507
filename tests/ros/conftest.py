"""Tests with the real ROS 2 from the wheels; `make test ROS=no` leaves them out."""

import os
import random
import socket
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items):
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.ros)


@pytest.fixture(scope="session")
def ros_environment() -> Iterator[dict[str, str]]:
    """Yield an environment in which DDS stays on this machine and meets no other run.

    A domain is held by a port, as the tests of scaffolded packages do it.
    """
    with socket.socket() as held:
        domain = next(filter(partial(_bound, held), random.sample(range(1, 101), 100)))
        yield {
            **os.environ,
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_DOMAIN_ID": str(domain),
            "PYTHONDONTWRITEBYTECODE": "1",
        }


def _bound(held: socket.socket, domain: int) -> bool:
    try:
        held.bind(("127.0.0.1", 22119 + domain))
    except OSError:
        return False
    return True
