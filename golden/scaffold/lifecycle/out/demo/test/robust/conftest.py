"""Fixtures for tests of nodes: the node in its own process, and an observer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
import random
import signal
import socket
import subprocess
import sys
import time
from typing import Any

import pytest
from rcl_interfaces.srv import GetParameters
import rclpy
from rclpy.node import Node

#: Seconds to wait for an event.
PATIENCE = 20.0


class Running:
    """A node that runs in its own process."""

    def __init__(self, observer: Node, log: Path, *words: str) -> None:
        """Start the node, with its output in a file."""
        self._observer = observer
        self._log = log
        command = [sys.executable, '-u', '-m', *words]
        with log.open('w') as output:
            self.process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)

    @property
    def output(self) -> str:
        """Return what the node has printed so far."""
        return self._log.read_text()

    def said(self, text: str, times: int = 1) -> bool:
        """Return whether at least this many lines of the log start with the text."""
        return self.output.count(f']: {text}') >= times

    def ended(self) -> bool:
        """Return whether the process has ended by itself."""
        return self.process.poll() is not None

    def until(self, condition: Callable[[], bool], seconds: float = PATIENCE) -> None:
        """Spin the observer until a condition holds; fail after a timeout."""
        __tracebackhide__ = True
        why = f'this did not happen within {seconds} seconds'
        deadline = time.monotonic() + seconds
        ended = False
        while not condition():
            if not ended and self.ended():
                ended = True
                why = f'the node ended with status {self.process.returncode} before this'
                # its last messages may still arrive
                deadline = min(deadline, time.monotonic() + 1.0)
            if time.monotonic() > deadline:
                pytest.fail(f'{why}; it printed:\n{self.output}')
            rclpy.spin_once(self._observer, timeout_sec=0.05)

    def until_it_spins(self, name: str) -> None:
        """Spin the observer until the node answers; a signal would break its imports before."""
        client = self._observer.create_client(GetParameters, f'{name}/get_parameters')
        # a node that has not discovered the observer yet drops its response: ask again
        answers: list[Any] = []
        timer = self._observer.create_timer(
            0.2,
            lambda: answers.append(client.call_async(GetParameters.Request())),
        )
        self.until(lambda: any(answer.done() for answer in answers))
        self._observer.destroy_timer(timer)

    def leave(self) -> None:
        """Terminate the node; others would see a killed node for some time."""
        self.process.terminate()
        try:
            self.process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def end(self, how: signal.Signals = signal.SIGINT) -> int:
        """Ask the node to end; return its exit status."""
        self.process.send_signal(how)
        self.until(self.ended)
        return self.process.returncode


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Give the test its own ROS domain, and keep its traffic on this machine."""
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    monkeypatch.setenv('RCUTILS_CONSOLE_OUTPUT_FORMAT', '[{severity}] [{name}]: {message}')
    monkeypatch.setenv('RCUTILS_COLORIZED_OUTPUT', '0')
    with socket.socket() as held:  # a port for each domain, which only one test can have
        for number in random.sample(range(1, 101), 100):
            try:
                held.bind(('127.0.0.1', 22119 + number))
            except OSError:
                continue
            monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
            break
        yield


@pytest.fixture
def observer(domain: None) -> Iterator[Node]:
    """Yield a node that observes others."""
    rclpy.init()
    node = rclpy.create_node('observer')
    yield node
    node.destroy_node()
    rclpy.shutdown()


@pytest.fixture
def start(tmp_path: Path, observer: Node) -> Iterator[Callable[..., Running]]:
    """Yield a function that starts a node, which ends with the test."""
    nodes: list[Running] = []

    def started(module: str, *words: str) -> Running:
        nodes.append(Running(observer, tmp_path / f'{len(nodes)}.log', module, *words))
        return nodes[-1]

    yield started
    for node in nodes:
        node.leave()
