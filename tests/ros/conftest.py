"""Tests with the real ROS 2 from the wheels; `make test ROS=no` leaves them out."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

from tests.support.domains import held_domain
from tests.support.installed import SHARE, generate, interfaces, interfaces_in, names_in
from tests.support.paths import PROGRAMS
from tests.support.sides import OURS


def pytest_collection_modifyitems(items):
    for item in items:
        if item.nodeid.startswith("tests/ros/"):
            item.add_marker(pytest.mark.ros)


@contextmanager
def domain_of_its_own() -> Iterator[dict[str, str]]:
    """Yield an environment in which DDS stays on this machine and meets no other run."""
    with held_domain() as domain:
        yield {
            **os.environ,
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_DOMAIN_ID": str(domain),
            "PYTHONDONTWRITEBYTECODE": "1",
        }


@pytest.fixture(scope="session")
def ros_environment() -> Iterator[dict[str, str]]:
    """Yield the environment that tests share."""
    with domain_of_its_own() as environment:
        yield environment


@pytest.fixture
def lonely_environment() -> Iterator[dict[str, str]]:
    """Yield an environment for one test, which sees no nodes of others, dead ones included."""
    with domain_of_its_own() as environment:
        yield environment


@pytest.fixture
def program(ros_environment):
    """Start a file of programs/, with idlc's classes on PYTHONPATH; it ends with the test."""
    processes = []

    def start(name: str, *words: object, path: Path) -> subprocess.Popen:
        process = subprocess.Popen(
            [sys.executable, str(PROGRAMS / name), *map(str, words)],
            env={**ros_environment, "PYTHONPATH": str(path)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        processes.append(process)
        return process

    yield start
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture(scope="session")
def path_of(tmp_path_factory):
    """Return the PYTHONPATH on which `packages` are idlc's, each in a folder of its own."""
    folder = tmp_path_factory.mktemp("classes")

    @cache
    def classes(package: str) -> str:
        generate(OURS.get(package, SHARE / package), folder / package / package)
        return str(folder / package)

    def path(*packages: str) -> str:
        return ":".join([str(PROGRAMS), *map(classes, packages)])

    return path


@pytest.fixture(scope="session")
def shapes(path_of, ros_environment):
    """Return the shape of every message, and the names of messages of idlc's own packages."""
    own_names = names_in(OURS, interfaces_in(OURS.values()))
    names = [*names_in(interfaces(), interfaces()), *own_names]
    done = subprocess.run(
        [sys.executable, str(PROGRAMS / "shapes.py"), *names],
        env={**ros_environment, "PYTHONPATH": path_of(*OURS)},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout), own_names
