"""Futures, and executors: one thread runs all callbacks of its nodes, one at a time, or several do.

Threads of the transport only append to bounded queues and wake it.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Generator
from concurrent import futures
from contextlib import AbstractContextManager, suppress
from functools import partial
from inspect import iscoroutine
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any, TypeAlias, TypeVar

from idlc.robot.nodes.context import Context, get_default_context
from idlc.robot.transport import Transport

T = TypeVar("T")
#: On Windows, a signal does not interrupt a wait, so that no wait is longer than these seconds.
_TICK = 0.5
#: Seconds; `None` and negative numbers are no limit.
Limit: TypeAlias = float | None
Callback: TypeAlias = Callable[[], Any]


class ExternalShutdownException(Exception):  # noqa: N818 - rclpy's name
    """The context was shut down, for example by SIGTERM, while an executor waited."""


class ShutdownException(Exception):  # noqa: N818 - rclpy's name
    """The executor was shut down while it waited for a callback."""


class TimeoutException(Exception):  # noqa: N818 - rclpy's name
    """No callback was ready in time."""


class Future(futures.Future[T]):
    """A result that comes later; `await` it in a coroutine that an executor or asyncio runs.

    Callbacks run in the executor, or at once on the thread that sets the result if there is none.
    """

    def __init__(self, *, executor: Executor | None = None) -> None:
        super().__init__()
        self.executor = executor

    def __await__(self) -> Generator[Any, None, T]:
        while not self.done():
            # a task of asyncio asks again, as in rclpy; an executor waits for the future
            yield None if _is_in_asyncio() else self
        return self.result()  # type: ignore[return-value] # as in rclpy, `None` if cancelled

    def result(self, timeout: float | None = None) -> T | None:  # type: ignore[override]
        """Return the result, `None` before there is one; raise the exception if one was set."""
        return super().result(timeout) if self.done() and not self.cancelled() else None

    def exception(self, timeout: float | None = None) -> BaseException | None:
        """Return the exception that was set."""
        return super().exception(timeout) if self.done() and not self.cancelled() else None

    def set_result(self, result: T) -> None:
        """Finish with a result, unless the future is done."""
        with suppress(futures.InvalidStateError):
            super().set_result(result)

    def set_exception(self, exception: BaseException | None) -> None:
        """Finish with an exception, unless the future is done."""
        with suppress(futures.InvalidStateError):
            super().set_exception(exception)

    def add_done_callback(self, callback: Callable[[Future[T]], Any]) -> None:
        """Call `callback` with the future when it is done or cancelled, at once if it is now."""

        def run(_: object) -> None:
            if self.executor is None:
                callback(self)
            else:
                self.executor.create_task(callback, self)

        super().add_done_callback(run)

    def wake_at_end(self, waiter: Callback) -> None:
        """Call `waiter` on the thread that ends the future, or now."""
        super().add_done_callback(lambda _: waiter())


def _is_in_asyncio() -> bool:
    if "asyncio" not in sys.modules:
        return False
    import asyncio

    with suppress(RuntimeError):
        asyncio.get_running_loop()
        return True
    return False


async def call(callback: Callable[..., Any], *args: Any) -> Any:
    """Call a function or a coroutine function; return its result."""
    result = callback(*args)
    return await result if iscoroutine(result) else result


class CallbackGroup:
    """Decides which callbacks may run while a coroutine of the group waits.

    Subclasses can override `beginning_execution` and `ending_execution`.
    """

    #: Functions to call at the end of the callback that runs; `None` if others need not wait.
    waiting: list[Callback] | None = None

    def __init__(self) -> None:
        self._lock = Lock()

    def begin(self, waiting: list[Callback] | None, resume: Callback) -> bool:
        """Begin a callback, unless one runs; then `resume` is called at its end."""
        with self._lock:
            if self.waiting is not None:
                self.waiting.append(resume)
                return False
            self.waiting = waiting
            return True

    def end(self, waiting: list[Callback] | None) -> None:
        """End a callback; in a new executor, another one may run already."""
        with self._lock:
            if self.waiting is waiting:
                self.waiting = None
        for resume in waiting or ():
            resume()

    def beginning_execution(self, entity: Any) -> bool:  # noqa: ARG002 - for subclasses
        """Return whether a callback may run now; else it is tried again after the next one."""
        return True

    def ending_execution(self, entity: Any) -> None:
        """Take note that a callback has ended."""


class MutuallyExclusiveCallbackGroup(CallbackGroup):
    """One callback at a time, coroutines included; each node has such a group as the default."""


class ReentrantCallbackGroup(CallbackGroup):
    """Callbacks run while coroutines of the group wait."""


class Ready:
    """Something that has callbacks to run, such as a subscription with its queue."""

    def __init__(self, group: CallbackGroup | None) -> None:
        self.callback_group = group or ReentrantCallbackGroup()
        self.node: Any = None
        self._executor: Executor | None = None
        self._is_queued = False

    def wake(self) -> None:
        """Have the executor take from this soon; for any thread."""
        executor = self._executor
        if executor is not None and not self._is_queued:
            self._is_queued = True
            executor.schedule(self.run, executor)

    def attach(self, executor: Executor | None) -> None:
        """Run in this executor from now on."""
        self._executor, self._is_queued = executor, False
        self.wake()

    def take(self) -> Callback | None:
        """Return the next callback, `None` if there is none."""
        return None

    def run(self, executor: Executor) -> bool:
        """Run the next callback; return whether there was one that may run now."""
        group = self.callback_group
        if self._executor is not executor:
            return False
        waiting: list[Callback] | None = None
        if isinstance(group, MutuallyExclusiveCallbackGroup):
            waiting = []
        if not group.begin(waiting, partial(executor.schedule, self.run, executor)):
            return False
        if not group.beginning_execution(self):
            group.end(waiting)
            executor.refused.append(self)
            return False
        self._is_queued = False
        callback = self.take()
        if callback is None:
            self._end(waiting)
            return False
        return executor.begin(self, callback, partial(self._end, waiting))

    def _end(self, waiting: list[Callback] | None) -> None:
        self.callback_group.ending_execution(self)
        self.callback_group.end(waiting)


class Task(Future[Any]):
    """A callback that a subclass of Executor runs by a call, on any thread."""

    def __init__(self, executor: Executor, callback: Callback, end: Callback) -> None:
        super().__init__(executor=executor)
        self._callback = callback
        self.wake_at_end(end)

    def __call__(self) -> None:
        """Run the callback; `result` and `exception` return what came of it."""
        with suppress(BaseException):
            Executor.step(self.executor, self, self._callback)  # type: ignore[arg-type]


class Executor(AbstractContextManager["Executor"]):
    """Runs the callbacks of nodes in the thread that spins; also rclpy's SingleThreadedExecutor.

    Callbacks can spin it, too, but no other thread can at the same time.
    Exceptions of callbacks are raised by the method that spins.
    """

    def __init__(self, *, context: Context | None = None) -> None:
        self.context = context or get_default_context()
        self._nodes: list[Any] = []
        # its `put` may be called in signal handlers
        self._queue: SimpleQueue[Callable[[], bool]] = SimpleQueue()
        self._is_shutdown = False
        #: The transport of the last node, which receives while the executor waits.
        self.transport: Transport | None = None
        #: What its callback group did not let run.
        self.refused: list[Ready] = []
        #: What `wait_for_ready_callbacks` returns, while it waits.
        self._found: list[tuple[Task, Ready, Any]] | None = None
        self.context.sleepers.add(self)

    def add_node(self, node: Any) -> bool:
        """Run the callbacks of a Node, which imports this module; return whether it is new."""
        if node in self._nodes:
            return False
        if node.executor is not None:
            node.executor.remove_node(node)
        self._nodes.append(node)
        node.attach(self)
        return True

    def remove_node(self, node: Any) -> None:
        """Stop running the callbacks of a node."""
        if node in self._nodes:
            self._nodes.remove(node)
            node.attach(None)

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Future[Any]:
        """Run a function or coroutine in the executor; return its future."""
        work = callback if iscoroutine(callback) else partial(callback, *args, **kwargs)
        future: Future[Any] = Future(executor=self)
        self.schedule(self.step, future, work)
        return future

    def begin(self, ready: Ready, callback: Callback, end: Callback) -> bool:
        """Run a callback, and call `end` after it; a coroutine goes on as a task."""
        if self._found is not None:
            self._found.append((Task(self, callback, end), ready, ready.node))
            return True
        try:
            result = callback()
        except BaseException:
            end()
            raise
        if not iscoroutine(result):  # most callbacks are functions; a future is slow to make
            end()
            return True
        future: Future[Any] = Future(executor=self)
        future.wake_at_end(end)
        return self.step(future, result)

    def step(self, future: Future[Any], work: Any) -> bool:
        """Run a function, or a coroutine to its next `await`; the future gets the result."""
        if future.done():
            return True
        coroutine = work if iscoroutine(work) else call(work)
        try:
            awaited = coroutine.send(None)
        except StopIteration as end:
            future.set_result(end.value)
        except BaseException as error:
            future.set_exception(error)
            raise
        else:
            resume = partial(self.schedule, self.step, future, coroutine)
            if isinstance(awaited, Future):
                awaited.wake_at_end(resume)
            else:
                resume()
        return True

    def schedule(self, work: Callable[..., bool], *args: Any) -> None:
        """Append to the queue, from any thread; `work` returns whether it ran a callback."""
        self._queue.put(partial(work, *args))
        if self.transport is not None:
            self.transport.wake()

    def wake(self) -> None:
        """End the current wait, so that the executor looks at timers and the context again."""
        self.schedule(lambda: False)

    def shutdown(self) -> None:
        """Stop spinning, and give up the nodes."""
        self._is_shutdown = True
        for node in [*self._nodes]:
            self.remove_node(node)
        self.wake()

    def __exit__(self, *_: object) -> None:
        self.shutdown()

    def spin(self) -> None:
        """Run callbacks until the executor or the context is shut down."""
        while self.context.ok() and not self._is_shutdown:
            self.spin_once()

    def spin_once(self, timeout_sec: Limit = None) -> None:
        """Run one callback, or wait for one for at most `timeout_sec` seconds.

        Raises ExternalShutdownException if the context is shut down while it waits.
        """
        end = _end(timeout_sec)
        while not self._is_shutdown and not self._spin_once(end):
            pass

    def spin_until_future_complete(self, future: Future[Any], timeout_sec: Limit = None) -> None:
        """Run callbacks until the future is done or cancelled, or the time is over."""
        end = _end(timeout_sec)
        future.wake_at_end(partial(self.schedule, lambda: True))
        while not future.done() and self.context.ok() and not self._is_shutdown:
            self.spin_once(timeout_sec=max(0.0, end - time.monotonic()))
            if time.monotonic() >= end:
                return

    def wait_for_ready_callbacks(self, timeout_sec: Limit = None) -> tuple[Task, Ready, Any]:
        """Wait for a callback; return a task that runs it, its entity, and its node.

        The `spin_once` of a subclass calls it. Raises TimeoutException,
        ShutdownException, and ExternalShutdownException.
        """
        end, self._found = _end(timeout_sec), []
        try:
            while not self._found:
                if self._is_shutdown:
                    raise ShutdownException
                self._spin_once(end)
                if not self._found and time.monotonic() >= end:
                    raise TimeoutException
            return self._found[0]
        finally:
            self._found = None

    def _spin_once(self, end: float) -> bool:
        """Take from the queue once; return whether a callback ran, or the time is over."""
        if not self.context.ok():
            raise ExternalShutdownException
        waits = [timer.wake_if_ready() for node in self._nodes for timer in node.timers]
        wait = min(_TICK, end - time.monotonic(), *waits)
        try:
            work = self._next(max(0.0, wait))
        except Empty:
            return time.monotonic() >= end
        has_run = work()
        if has_run and self.refused:
            refused, self.refused = self.refused, []
            for ready in refused:
                self.schedule(ready.run, self)
        return has_run

    def _next(self, wait: float) -> Callable[[], bool]:
        """Return work from the queue; raise Empty if there is none for so many seconds or less."""
        is_idle = self._queue.empty
        if wait and self.transport is not None and is_idle():
            wait = 0.0 if self.transport.pump(wait, is_idle) else wait
        return self._queue.get(block=wait > 0, timeout=wait)


SingleThreadedExecutor = Executor


class MultiThreadedExecutor(Executor):
    """Runs callbacks in threads; those of a mutually exclusive group one after the other."""

    def __init__(self, num_threads: int | None = None, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        self._pool = futures.ThreadPoolExecutor(num_threads or max(2, os.cpu_count() or 2))

    def begin(self, ready: Ready, callback: Callback, end: Callback) -> bool:
        """Run a callback in a thread."""
        return self._submit(super().begin, ready, callback, end)

    def step(self, future: Future[Any], work: Any) -> bool:
        """Run a function, or a coroutine to its next `await`, in a thread."""
        return self._submit(super().step, future, work)

    def _submit(self, work: Callable[..., bool], *args: Any) -> bool:
        with suppress(RuntimeError):  # the executor is shut down
            self._pool.submit(self._run, work, *args)
        return True

    def _run(self, work: Callable[..., bool], *args: Any) -> None:
        try:
            work(*args)
        except BaseException as error:
            self.schedule(_fail, error)

    def shutdown(self) -> None:
        """Stop spinning, and give up the nodes; callbacks that run go on."""
        super().shutdown()
        self._pool.shutdown(wait=False)


def _fail(error: BaseException) -> bool:
    raise error


def _end(timeout: Limit) -> float:
    return float("inf") if timeout is None or timeout < 0 else time.monotonic() + timeout


def _executor_of(node: Any, executor: Executor | None) -> Executor:
    chosen = executor or node.executor or Executor(context=node.context)
    chosen.add_node(node)
    return chosen


def spin(node: Any, executor: Executor | None = None) -> None:
    """Run the callbacks of a node until the context is shut down.

    Raises what callbacks raise, and ExternalShutdownException after SIGTERM.
    """
    _executor_of(node, executor).spin()


def spin_once(node: Any, *, executor: Executor | None = None, timeout_sec: Limit = None) -> None:
    """Run one callback of a node, or wait for one for at most `timeout_sec` seconds."""
    _executor_of(node, executor).spin_once(timeout_sec)


def spin_until_future_complete(
    node: Any, future: Future[Any], executor: Executor | None = None, timeout_sec: Limit = None
) -> None:
    """Run callbacks until the future is done or cancelled, or the time is over."""
    _executor_of(node, executor).spin_until_future_complete(future, timeout_sec)
