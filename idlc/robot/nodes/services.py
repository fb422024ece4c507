"""Services and clients."""

from __future__ import annotations

import inspect
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from itertools import count
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any, Generic, cast

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError
from idlc.robot.keys import Attachment, Kind, pack_attachment, parse_attachment
from idlc.robot.names import action_part
from idlc.robot.nodes.endpoints import Bounded, Endpoint, is_instance
from idlc.robot.nodes.executor import CallbackGroup, Future, Ready
from idlc.robot.nodes.interfaces import Interface, RequestT, ResponseT
from idlc.robot.qos import QoSProfile
from idlc.robot.transport import Request, Sample

#: Seconds until a call ends without a response, as in rmw_zenoh; results of actions take longer.
_TIMEOUT = 600.0
_LONG_TIMEOUT = 10 * 365 * 86400.0
#: Seconds between two looks at the context while a thread waits.
_TICK = 0.5
#: Requests that wait in a service or are being answered.
MOST_OPEN = 10_000
#: Replies to one request that a client looks at.
_MOST_REPLIES = 16


class _ServiceEndpoint(Endpoint, Ready, Generic[RequestT, ResponseT]):
    """The base class of services and clients."""

    def __init__(
        self,
        node: Any,
        kind: Kind,
        name: str,
        interface: Interface,
        qos: QoSProfile,
        group: CallbackGroup | None,
    ) -> None:
        Ready.__init__(self, group)
        super().__init__(node, kind, name, interface, qos)
        #: Counts requests and responses without an attachment, and those of other kinds.
        self.ignored = 0

    @property
    def srv_type(self) -> Any:
        """The class of the service."""
        return self.interface.kind

    @property
    def srv_name(self) -> str:
        """The absolute name of the service."""
        return self.entity.name

    service_name = srv_name


class _Open:
    """A request that waits or is being answered."""

    def __init__(self, request: Request, attachment: Attachment) -> None:
        self.request = request
        self.attachment = attachment

    @property
    def id(self) -> tuple[bytes, int]:
        """The client, and its number of the request."""
        return self.attachment.gid, self.attachment.sequence


class Service(_ServiceEndpoint[RequestT, ResponseT]):
    """Answers requests: `callback` gets the request and an empty response, and returns it."""

    def __init__(
        self,
        node: Any,
        name: str,
        interface: Interface,
        callback: Callable[[RequestT, ResponseT], Any],
        qos: QoSProfile,
        *,
        group: CallbackGroup | None = None,
    ) -> None:
        super().__init__(node, Kind.SERVICE, name, interface, qos, group)
        self.callback = callback
        self._queue: Bounded[_Open] = Bounded(qos)
        self._open: set[tuple[bytes, int]] = set()
        self._lock = Lock()
        self._closeables.append(node.transport.service(self.entity.key, self._receive))
        self.announce()

    def _receive(self, request: Request) -> None:
        attachment = parse_attachment(request.attachment)
        if attachment is None:
            self.ignored += 1
            request.drop()
            return
        waiting = _Open(request, attachment)
        with self._lock:
            refused = waiting.id in self._open or len(self._open) >= MOST_OPEN
            if not refused:
                self._open.add(waiting.id)
        if refused:
            self.ignored += 1
            request.drop()
            return
        for oldest in self._queue.append(waiting, len(request.payload)):
            self._drop(oldest)
        self.wake()

    def _drop(self, item: _Open) -> None:
        self._open.discard(item.id)
        item.request.drop()

    def take(self) -> Callable[[], Any] | None:
        """Return the callback with the next request."""
        item = self._queue.pop()
        if self._queue:
            self.wake()
        if item is None:
            return None
        message = self.decode(self.interface.kind.Request, item.request.payload)
        if message is None:
            self.ignored += 1
            self._drop(item)
            return None
        return partial(self._answer, item, message)

    def _answer(self, item: _Open, message: RequestT) -> Any:
        try:
            response = self.callback(message, self.interface.kind.Response())
        except BaseException:
            self._drop(item)
            raise
        if inspect.iscoroutine(response):
            return self._answer_later(item, response)
        self._reply(item, response)
        return None

    async def _answer_later(self, item: _Open, coroutine: Any) -> None:
        try:
            response = await coroutine
        except BaseException:
            self._drop(item)
            raise
        self._reply(item, response)

    def _reply(self, item: _Open, response: Any) -> None:
        try:
            if not is_instance(response, self.interface.kind.Response):
                raise TypeError(
                    f"the callback of `{self.entity.name}` returned {type(response).__name__}, not "
                    f"its response"
                )
            sequence, _, gid = item.attachment
            attachment = pack_attachment(sequence, time.time_ns(), gid)
            item.request.reply(response.serialize(), attachment)
            self._open.discard(item.id)
        finally:
            if item.id in self._open:
                self._drop(item)

    def destroy(self) -> None:
        """Withdraw the service; requests in the queue get no response."""
        super().destroy()
        while (item := self._queue.pop()) is not None:
            self._drop(item)


class _Call:
    """Passes on what arrives for a request; a service sends one reply, a hostile one many."""

    def __init__(self, deliver: Callable[[Sample | None], Any]) -> None:
        self._deliver = deliver
        self._left = _MOST_REPLIES

    def __call__(self, sample: Sample | None) -> None:
        self._left -= sample is not None
        if self._left >= 0 or sample is None:
            self._deliver(sample)


class Client(_ServiceEndpoint[RequestT, ResponseT]):
    """Sends requests, from any thread."""

    def __init__(self, node: Any, name: str, interface: Interface, qos: QoSProfile) -> None:
        # responses arrive while callbacks of the node wait for them
        super().__init__(node, Kind.CLIENT, name, interface, qos, None)
        is_result = (action_part(self.entity.name) or ("", ""))[1] == "get_result"
        self._timeout = _LONG_TIMEOUT if is_result else _TIMEOUT
        self._key = self.entity.key
        self._gid = self.entity.gid
        self._numbers = count(1)
        self._pending: dict[int, Future[ResponseT]] = {}
        self._arrived: deque[tuple[int, Sample | None]] = deque()
        self.announce()

    def call(self, request: RequestT, timeout_sec: float | None = None) -> ResponseT | None:
        """Send a request and wait; return `None` if no response came in time.

        Unlike in rclpy, nothing has to spin. Raises RobotError if no service answered.
        """
        replies: SimpleQueue[Sample | None] = SimpleQueue()
        timeout = self._timeout if timeout_sec is None else timeout_sec
        end = time.monotonic() + timeout
        number = next(self._numbers)
        self._send(number, request, replies.put, timeout)
        while (left := end - time.monotonic()) > 0 and self.node.context.ok():
            try:
                sample = replies.get(timeout=min(left, _TICK))
            except Empty:
                continue
            if sample is None:
                break
            if (response := self._response(number, sample)) is not None:
                return response
        if end > time.monotonic() and self.node.context.ok():
            raise self._no_response()
        return None

    def call_async(self, request: RequestT) -> Future[ResponseT]:
        """Send a request; return the future of its response, which an executor completes.

        The future raises RobotError if no service answered.
        """
        future: Future[ResponseT] = Future()
        number = next(self._numbers)
        self._pending[number] = future
        future.wake_at_end(partial(self._pending.pop, number, None))
        try:
            self._send(number, request, partial(self._receive, number), self._timeout)
        except BaseException:
            self._pending.pop(number, None)
            raise
        return future

    def remove_pending_request(self, future: Future[ResponseT]) -> None:
        """Ignore the response to a request."""
        for number, pending in [*self._pending.items()]:
            if pending is future:
                self._pending.pop(number, None)

    def _send(
        self,
        number: int,
        request: RequestT,
        deliver: Callable[[Sample | None], Any],
        timeout: float,
    ) -> None:
        if not is_instance(request, self.interface.kind.Request):
            expected = f"{self.interface.name}.Request, not {type(request).__name__}"
            raise TypeError(f"requests to `{self.entity.name}` are {expected}")
        payload: bytes = cast("Any", request).serialize()
        attachment = pack_attachment(number, time.time_ns(), self._gid)
        try:
            self.node.transport.call(
                self._key, payload, attachment, _Call(deliver), timeout=timeout
            )
        except Exception as error:
            raise RobotError(f"`{self.entity.name}`: {one_line(str(error))}") from None

    def _receive(self, number: int, sample: Sample | None) -> None:
        if number in self._pending:
            self._arrived.append((number, sample))
            self.wake()

    def take(self) -> Callable[[], Any] | None:
        """Return what completes the future of the next response."""
        if not self._arrived:
            return None
        number, sample = self._arrived.popleft()
        if self._arrived:
            self.wake()
        future = self._pending.get(number)
        if future is None:
            return None
        future.executor = self._executor
        if sample is None:
            return partial(future.set_exception, self._no_response())
        response = self._response(number, sample)
        return None if response is None else partial(future.set_result, response)

    def _response(self, number: int, sample: Sample) -> ResponseT | None:
        """Return the response in a reply; `None` if it is not one to this request."""
        attachment = parse_attachment(sample.attachment)
        response: ResponseT | None = None
        if attachment and (attachment.sequence, attachment.gid) == (number, self._gid):
            response = self.decode(self.interface.kind.Response, sample.payload)
        self.ignored += response is None
        return response

    def _no_response(self) -> RobotError:
        return RobotError(
            f"no service answered `{self.entity.name}`",
            "is the service running? `wait_for_service` waits until the service runs",
        )

    def service_is_ready(self) -> bool:
        """Return whether there is a service."""
        return bool(self.node.count_matching(Kind.SERVICE, self.entity))

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait until there is a service; return whether there is one now."""
        end = None if timeout_sec is None else time.monotonic() + timeout_sec
        graph = self.node.session.graph
        while self.node.context.ok():
            left = _TICK if end is None else min(_TICK, end - time.monotonic())
            if graph.wait_for(lambda _: self.service_is_ready(), left):
                return True
            if left < _TICK:
                break
        return self.service_is_ready()

    def destroy(self) -> None:
        """Withdraw the client; pending futures are cancelled."""
        super().destroy()
        for future in [*self._pending.values()]:
            future.cancel()
