"""The executor: one thread that runs all callbacks of its nodes, one at a time.

Threads of the transport only append to bounded queues and wake it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from queue import Empty, SimpleQueue
from threading import RLock
from typing import Any, Protocol

from idlc.robot.nodes.context import Context, get_default_context
from idlc.robot.nodes.tasks import Future, Task

#: On Windows, a signal does not interrupt a wait, so that no wait is longer than these seconds.
_TICK = 0.5


class ExternalShutdownException(Exception):  # noqa: N818 - rclpy's name
    """The context was shut down, for example by SIGTERM, while an executor waited."""


class CallbackGroup:
    """Decides which callbacks may run while a coroutine of the group waits."""

    #: True if no callback starts before the last coroutine has ended.
    is_exclusive = False

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget coroutines of another executor."""
        self.is_busy = False
        self.waiting: list[Ready] = []


class MutuallyExclusiveCallbackGroup(CallbackGroup):
    """One callback at a time, coroutines included; each node has such a group as the default."""

    is_exclusive = True


class ReentrantCallbackGroup(CallbackGroup):
    """Callbacks run while coroutines of the group wait."""


class Ready:
    """Something that has callbacks to run, such as a subscription with its queue."""

    def __init__(self, group: CallbackGroup | None) -> None:
        self.callback_group = group
        self._executor: Executor | None = None
        self._is_queued = False

    def wake(self) -> None:
        """Have the executor take from this soon; for any thread."""
        executor = self._executor
        if executor is not None and not self._is_queued:
            self._is_queued = True
            executor.schedule(self)

    def attach(self, executor: Executor | None) -> None:
        """Run in this executor from now on."""
        self._executor, self._is_queued = executor, False
        self.wake()

    def runs_in(self, executor: Executor) -> bool:
        """Return whether this is the executor that runs the callbacks."""
        return self._executor is executor

    def begin(self) -> None:
        """Leave the executor's queue; `wake` may queue it again from now on."""
        self._is_queued = False

    def take(self) -> Callable[[], Any] | None:
        """Return the next callback, `None` if there is none."""
        raise NotImplementedError


class Owner(Protocol):
    """The part of a Node that executors use; the class Node itself imports this module."""

    timers: Any

    @property
    def executor(self) -> Executor | None:
        """The executor that runs the callbacks."""
        ...

    def attach(self, executor: Executor | None) -> None:
        """Run callbacks in this executor."""
        ...


class Executor(AbstractContextManager["Executor"]):
    """Runs the callbacks of nodes in the thread that spins; also rclpy's SingleThreadedExecutor.

    Exceptions of callbacks are raised by the method that spins.
    """

    def __init__(self, *, context: Context | None = None) -> None:
        self._context = context or get_default_context()
        self._nodes: list[Owner] = []
        # its `put` may be called in signal handlers
        self._queue: SimpleQueue[Ready | Task[Any] | None] = SimpleQueue()
        self._is_shutdown = False
        # threads that spin at the same time take turns; callbacks may spin
        self._turn = RLock()
        self._context.wake_at_shutdown(self)

    @property
    def context(self) -> Context:
        """The context that ends the executor."""
        return self._context

    def add_node(self, node: Owner) -> bool:
        """Run the callbacks of a node; return whether it is new here."""
        if node in self._nodes:
            return False
        if node.executor is not None:
            node.executor.remove_node(node)
        self._nodes.append(node)
        node.attach(self)
        return True

    def remove_node(self, node: Owner) -> None:
        """Stop running the callbacks of a node."""
        if node in self._nodes:
            self._nodes.remove(node)
            node.attach(None)

    def get_nodes(self) -> list[Owner]:
        """Return the nodes."""
        return [*self._nodes]

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Task[Any]:
        """Run a function or coroutine in the executor; return its future."""
        task: Task[Any] = Task(callback, args, kwargs, self)
        self.schedule(task)
        return task

    def schedule(self, work: Ready | Task[Any]) -> None:
        """Append to the queue, from any thread."""
        self._queue.put(work)

    def wake(self) -> None:
        """End the current wait, so that the executor looks at timers and the context again."""
        self._queue.put(None)

    def shutdown(self, timeout_sec: float | None = None) -> bool:  # noqa: ARG002 - as in rclpy
        """Stop spinning, and give up the nodes."""
        self._is_shutdown = True
        for node in self.get_nodes():
            self.remove_node(node)
        self.wake()
        return True

    def __exit__(self, *_: object) -> None:
        self.shutdown()

    def spin(self) -> None:
        """Run callbacks until the executor or the context is shut down."""
        while self._context.ok() and not self._is_shutdown:
            self.spin_once()

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Run one callback, or wait for one for at most `timeout_sec` seconds.

        Raises ExternalShutdownException if the context is shut down while it waits.
        """
        self._spin_once(timeout_sec, lambda: False)

    def spin_until_future_complete(
        self, future: Future[Any], timeout_sec: float | None = None
    ) -> None:
        """Run callbacks until the future is done or cancelled, or the time is over."""
        end = _end(timeout_sec)
        future.wake_at_end(self.wake)

        def is_over() -> bool:
            return future.done() or future.cancelled()

        while self._context.ok() and not self._is_shutdown and not is_over():
            left = None if end is None else end - time.monotonic()
            if left is not None and left <= 0:
                return
            self._spin_once(left, is_over)

    def spin_once_until_future_complete(
        self, future: Future[Any], timeout_sec: float | None = None
    ) -> None:
        """Run one callback, unless the future is done before there is one."""
        future.wake_at_end(self.wake)
        self._spin_once(timeout_sec, lambda: future.done() or future.cancelled())

    def _spin_once(self, timeout: float | None, is_over: Callable[[], bool]) -> None:
        end = _end(timeout)
        while not self._is_shutdown and not is_over():
            if not self._context.ok():
                raise ExternalShutdownException
            wait = min(_TICK, self._wake_timers())
            left = None if end is None else end - time.monotonic()
            try:
                if left is not None:
                    wait = min(wait, left)
                work = self._queue.get(timeout=wait) if wait > 0 else self._queue.get_nowait()
            except Empty:
                if left is not None and left <= wait:
                    return
                continue
            with self._turn:
                if work is not None and self._run(work):
                    return

    def _wake_timers(self) -> float:
        """Queue the timers that are due; return the seconds until the next one is."""
        wait = _TICK
        for node in self._nodes:
            for timer in node.timers:
                if (left := timer.seconds_left()) is not None:
                    if left <= 0:
                        timer.wake()
                    else:
                        wait = min(wait, left)
        return wait

    def _run(self, work: Ready | Task[Any]) -> bool:
        """Run a callback or a step of a task; return whether there was one."""
        if isinstance(work, Task):
            self._step(work)
            return True
        if not work.runs_in(self):
            return False
        group = work.callback_group
        if group is not None and group.is_busy:
            group.waiting.append(work)
            return False
        work.begin()
        callback = work.take()
        if callback is None:
            return False
        task: Task[Any] = Task(callback, (), {}, self)
        if group is not None and group.is_exclusive:
            group.is_busy = True
            task.wake_at_end(lambda: self._release(group))
        self._step(task)
        return True

    def _step(self, task: Task[Any]) -> None:
        task()
        if (error := task.exception()) is not None:
            raise error

    def _release(self, group: CallbackGroup) -> None:
        group.is_busy = False
        waiting, group.waiting = group.waiting, []
        for work in waiting:
            self.schedule(work)


SingleThreadedExecutor = Executor


def _end(timeout: float | None) -> float | None:
    return None if timeout is None or timeout < 0 else time.monotonic() + timeout
