"""A router on loopback, for each test a new one on a free port."""

import random
import socket
from contextlib import suppress

import pytest

from idlc.robot.errors import RobotError
from idlc.robot.session import open_router

#: Below the ports that systems give to programs that ask for any, so that no program gets one of
#: these between two tries.
PORTS = range(10_240, 32_768)
_random = random.SystemRandom()  # others begin at the same seed


def free_endpoint():
    pytest.importorskip("zenoh", reason="eclipse-zenoh has no wheel for this platform")
    for _ in range(100):
        port = _random.choice(PORTS)
        with suppress(OSError), socket.socket() as probe:
            probe.bind(("127.0.0.1", port))
            return f"tcp/127.0.0.1:{port}"
    raise AssertionError("no free port")


def start_router():
    """Return a router and its endpoint; another test can take a port before the router does."""
    for _ in range(20):
        endpoint = free_endpoint()
        with suppress(RobotError):
            return open_router([endpoint], environ={}), endpoint
    raise AssertionError("no free port")


@pytest.fixture
def router():
    """The endpoint of a running router."""
    session, endpoint = start_router()
    with session:
        yield endpoint
