"""Middlewares on loopback: for each test a new router on a free port, or a domain of its own."""

import random
import socket
from contextlib import suppress

import pytest

from idlc.robot.errors import RobotError
from idlc.robot.session import open_router
from tests.support.domains import held_domain

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


def environ_of(address):
    """Return the variables by which programs without an address use this one."""
    if address.startswith("dds:"):
        domain = address.removeprefix("dds:")
        return {"ROS_DOMAIN_ID": domain, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    return {"ZENOH_CONFIG_OVERRIDE": f'connect/endpoints=["{address}"]'}


@pytest.fixture(params=["dds", "zenoh"])
def address(request):
    """The address of each middleware, where no other test is."""
    if request.param == "zenoh":
        yield request.getfixturevalue("router")
        return
    with held_domain() as domain:
        yield f"dds:{domain}"
