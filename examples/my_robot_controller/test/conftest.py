"""What the tests of nodes share: the node in a process, and a node that looks at it."""

# Only some of the functions of rclpy have types.
# mypy: disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable, Iterator
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest
import rclpy
from rclpy.node import Node


class Running:
    """A node in a process of its own."""

    def __init__(self, log: Path, *words: str) -> None:
        """Start the node; what it prints goes into a file."""
        self._log = log
        command = [sys.executable, '-u', '-m', *words]
        self.process = subprocess.Popen(command, stdout=log.open('w'), stderr=subprocess.STDOUT)

    @property
    def output(self) -> str:
        """Return what the node has printed up to now."""
        return self._log.read_text()

    def ended(self) -> bool:
        """Whether the process has ended by itself."""
        return self.process.poll() is not None

    def end(self, how: signal.Signals = signal.SIGINT) -> int:
        """Ask the node to end; return the status that it ends with."""
        self.process.send_signal(how)
        return self.process.wait(timeout=20)


@pytest.fixture
def start(tmp_path: Path, observer: Node) -> Iterator[Callable[..., Running]]:
    """Yield a function that starts a node beside the observer, to be ended with the test."""
    nodes: list[Running] = []

    def started(module: str, *words: str) -> Running:
        nodes.append(Running(tmp_path / f'{len(nodes)}.log', module, *words))
        return nodes[-1]

    yield started
    for node in nodes:
        node.process.kill()
        node.process.wait()


@pytest.fixture
def observer(monkeypatch: pytest.MonkeyPatch) -> Iterator[Node]:
    """Yield a node that looks at others; nothing that is sent leaves this machine."""
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    monkeypatch.setenv('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    rclpy.init()
    node = rclpy.create_node('observer')
    yield node
    node.destroy_node()
    rclpy.shutdown()


@pytest.fixture
def until(observer: Node) -> Callable[..., bool]:
    """Return a function that lets the observer work until a condition holds."""

    def holds(condition: Callable[[], bool], seconds: float = 20.0) -> bool:
        deadline = time.monotonic() + seconds
        while not condition() and time.monotonic() < deadline:
            rclpy.spin_once(observer, timeout_sec=0.05)
        return condition()

    return holds
