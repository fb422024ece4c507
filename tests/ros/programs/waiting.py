"""Waits of programs, which give up before the tests that started them."""

import inspect
import time
from threading import Thread

import rclpy

#: Seconds that a program waits for one thing; tests wait for programs a little longer.
PATIENCE = 25.0


def eventually(condition, node=None, *, limit=PATIENCE):
    """Return when a condition holds; spin a node or an executor meanwhile."""
    end = time.monotonic() + limit
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"waited {limit} s in vain for {inspect.getsource(condition)}")
        if node is None:
            time.sleep(0.002)
        elif hasattr(node, "spin_once"):
            node.spin_once(timeout_sec=0.1)
        else:
            rclpy.spin_once(node, timeout_sec=0.1)


def join(*threads: Thread) -> None:
    """Wait for the ends of threads."""
    for thread in threads:
        thread.join(PATIENCE)
        assert not thread.is_alive(), f"waited {PATIENCE} s in vain for {thread}"
