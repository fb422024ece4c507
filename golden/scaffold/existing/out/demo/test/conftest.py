"""A fixture for tests of nodes: each test runs twice, and ends its node by another signal."""

from collections.abc import Callable, Iterator
import os
from pathlib import Path
from random import randint
import signal
from subprocess import Popen, STDOUT
import sys
import time

import pytest
import rclpy
from rclpy.node import Node


class Observer(Node):
    def start(self, module: str, log: Path) -> None:
        self.log = log
        self.process = Popen([sys.executable, '-um', module], stdout=log.open('w'), stderr=STDOUT)
        self.until(lambda: module.rpartition('.')[2] in self.get_node_names())

    def until(self, condition: Callable[[], object], seconds: float = 20.0) -> None:
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, self.log.read_text()
            rclpy.spin_once(self, timeout_sec=0.05)


@pytest.fixture(params=[signal.SIGINT, signal.SIGTERM])
def observer(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Observer]:
    os.environ.update(ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST', ROS_DOMAIN_ID=f'{randint(1, 99)}')
    rclpy.init()
    request.addfinalizer(rclpy.shutdown)
    node = Observer('observer')
    request.addfinalizer(lambda: node.process.kill())
    node.start(request.module.NODE, tmp_path / 'log')
    yield node
    node.process.send_signal(request.param)
    node.until(lambda: node.process.poll() == 0)
