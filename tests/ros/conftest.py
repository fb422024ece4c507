"""Tests with the real ROS 2 from the wheels; `make test ROS=no` leaves them out."""

import os
from pathlib import Path

import pytest

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items):
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.ros)


@pytest.fixture(scope="session")
def ros_environment() -> dict[str, str]:
    """Return an environment in which DDS stays on this machine and meets no other run."""
    domain = str(1 + os.getpid() % 100)
    return {
        **os.environ,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": domain,
        "PYTHONDONTWRITEBYTECODE": "1",
    }
