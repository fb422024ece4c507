"""Futures and tasks, as those of rclpy: they run in an executor, not in asyncio."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Generator
from threading import Lock
from typing import Any, Generic, Protocol, TypeVar

T = TypeVar("T")


class Scheduler(Protocol):
    """The part of an Executor that futures use; the class Executor imports this module."""

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Task[Any]:
        """Run a function or coroutine."""
        ...

    def schedule(self, work: Task[Any]) -> None:
        """Run the next step of a task."""
        ...


class Future(Generic[T]):
    """A result that comes later; `await` it in a coroutine that an executor runs.

    Callbacks run in the executor, or at once on the thread that sets the result if there is none.
    """

    def __init__(self, *, executor: Scheduler | None = None) -> None:
        self._executor = executor
        self._lock = Lock()
        self._result: T | None = None
        self._exception: BaseException | None = None
        self._state = "pending"
        self._callbacks: list[Callable[[Any], Any]] = []
        self._waiters: list[Callable[[], Any]] = []

    def __await__(self) -> Generator[Any, None, T]:
        while self._state == "pending":
            yield self
        return self.result()  # type: ignore[return-value] # as in rclpy, `None` if cancelled

    def done(self) -> bool:
        """Return whether there is a result or an exception."""
        return self._state == "finished"

    def cancelled(self) -> bool:
        """Return whether the future was cancelled."""
        return self._state == "cancelled"

    def result(self) -> T | None:
        """Return the result, `None` before there is one; raise the exception if one was set."""
        if self._exception is not None:
            raise self._exception
        return self._result

    def exception(self) -> BaseException | None:
        """Return the exception that was set."""
        return self._exception

    def set_result(self, result: T) -> None:
        """Finish with a result."""
        self._finish("finished", result, None)

    def set_exception(self, exception: BaseException) -> None:
        """Finish with an exception."""
        self._finish("finished", None, exception)

    def cancel(self) -> None:
        """Give up the result, unless it is there."""
        self._finish("cancelled", None, None)

    def _finish(self, state: str, result: T | None, exception: BaseException | None) -> None:
        with self._lock:
            if self._state != "pending":
                return
            self._result, self._exception, self._state = result, exception, state
            callbacks, self._callbacks = self._callbacks, []
            waiters, self._waiters = self._waiters, []
        for waiter in waiters:
            waiter()
        for callback in callbacks:
            self._call(callback)

    def add_done_callback(self, callback: Callable[[Future[T]], Any]) -> None:
        """Call `callback` with the future when it is done or cancelled, at once if it is now."""
        with self._lock:
            if self._state == "pending":
                self._callbacks.append(callback)
                return
        self._call(callback)

    def remove_done_callback(self, callback: Callable[[Future[T]], Any]) -> bool:
        """Remove a callback; return whether it was there."""
        with self._lock:
            if callback in self._callbacks:
                self._callbacks.remove(callback)
                return True
        return False

    def run_callbacks_in(self, executor: Scheduler | None) -> None:
        """Run the callbacks as tasks of an executor."""
        self._executor = executor

    def wake_at_end(self, waiter: Callable[[], Any]) -> None:
        """Call `waiter` on the thread that ends the future, or now."""
        with self._lock:
            if self._state == "pending":
                if waiter not in self._waiters:
                    self._waiters.append(waiter)
                return
        waiter()

    def _call(self, callback: Callable[[Future[T]], Any]) -> None:
        if self._executor is not None:
            self._executor.create_task(callback, self)
        else:
            callback(self)


class Task(Future[T]):
    """A function or coroutine that an executor runs to its end; made by `create_task`."""

    def __init__(
        self, handler: Any, args: tuple[Any, ...], kwargs: dict[str, Any], executor: Scheduler
    ) -> None:
        super().__init__(executor=executor)
        self._owner = executor
        self._handler = handler
        self._arguments = args, kwargs
        self._coroutine: Any = handler if inspect.iscoroutine(handler) else None
        self._is_running = False

    def __call__(self) -> None:
        """Run to the end, or to the next `await` of something that is not there yet."""
        if self._state != "pending" or self._is_running:
            return
        self._is_running = True
        try:
            self._step()
        except StopIteration as end:
            self.set_result(end.value)
        except Exception as error:
            self.set_exception(error)
        finally:
            self._is_running = False

    def _step(self) -> None:
        if self._coroutine is None:
            args, kwargs = self._arguments
            result = self._handler(*args, **kwargs)
            if not inspect.iscoroutine(result):
                self.set_result(result)
                return
            self._coroutine = result
        awaited = self._coroutine.send(None)
        if isinstance(awaited, Future):
            awaited.wake_at_end(self._resume)
        else:
            self._resume()

    def _resume(self) -> None:
        self._owner.schedule(self)

    def executing(self) -> bool:
        """Return whether the task is running at the moment."""
        return self._is_running

    def cancel(self) -> None:
        """Stop a coroutine where it waits."""
        if self._state == "pending" and self._coroutine is not None and not self._is_running:
            self._coroutine.close()
        super().cancel()
