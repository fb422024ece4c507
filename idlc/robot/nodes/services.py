"""Services and clients, their events, and the service with which a node describes its types."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent import futures
from enum import IntEnum
from functools import partial
from itertools import count
from typing import Any, ClassVar, Generic, Literal, TypeAlias

from msgspec.structs import replace

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError
from idlc.robot.keys import Attachment, EntityKind, pack_attachment, parse_attachment
from idlc.robot.nodes.clock import Clock
from idlc.robot.nodes.endpoints import Bounded, Endpoint, Publisher
from idlc.robot.nodes.executor import Future, call
from idlc.robot.nodes.interfaces import RequestT, ResponseT
from idlc.robot.qos import QoSProfile
from idlc.robot.transport import Closeable, Request, Sample
from idlc.runtime.names import DecodeError
from idlc.runtime.typeinfo import types_of

#: Seconds until a call ends without a response, as in rmw_zenoh; results of actions take longer.
_TIMEOUT = 600.0
_LONG_TIMEOUT = 10 * 365 * 86400.0
#: Seconds between two looks at the context while a thread waits.
_TICK = 0.5
#: Requests that wait in a service or are being answered.
MOST_OPEN = 10_000


#: The constants of service_msgs/msg/ServiceEventInfo.
_EventType: TypeAlias = Literal[
    "REQUEST_SENT", "REQUEST_RECEIVED", "RESPONSE_SENT", "RESPONSE_RECEIVED"
]


class ServiceIntrospectionState(IntEnum):
    """The content of events: none are published, or without messages, or with messages."""

    OFF = 0
    METADATA = 1
    CONTENTS = 2


class _Introspected(Endpoint):
    """The base class of services and clients, which publish events if a program wants them."""

    _introspection: tuple[Publisher[Any], Clock, bool] | None = None

    def configure_introspection(
        self,
        clock: Clock,
        service_event_qos_profile: QoSProfile,
        introspection_state: ServiceIntrospectionState,
    ) -> None:
        """Begin or stop to publish events on the topic `_service_event` below the service."""
        if self._introspection is not None:
            self.node.destroy_publisher(self._introspection[0])
            self._introspection = None
        if introspection_state is not ServiceIntrospectionState.OFF:
            publisher = self.node.create_publisher(
                self.interface.kind.Event,
                f"{self.srv_name}/_service_event",
                service_event_qos_profile,
            )
            has_contents = introspection_state is ServiceIntrospectionState.CONTENTS
            self._introspection = publisher, clock, has_contents

    def report(self, event_type: _EventType, call: Attachment, message: Any) -> None:
        """Publish an event about a request or response of a call."""
        if self._introspection is None:
            return
        publisher, clock, has_contents = self._introspection
        event = publisher.interface.kind()
        event.info.event_type = getattr(event.info, event_type)
        event.info.stamp = clock.now().to_msg()
        event.info.client_gid = [*call.gid]
        event.info.sequence_number = call.sequence
        if has_contents:
            field = "request" if event_type.startswith("REQUEST") else "response"
            setattr(event, field, [message])
        publisher.publish(event)

    def destroy(self) -> None:
        """Withdraw the endpoint, and the publisher of events."""
        super().destroy()
        if self._introspection is not None:
            self.node.destroy_publisher(self._introspection[0])


class Service(_Introspected, Generic[RequestT, ResponseT]):
    """Answers requests: `callback` gets the request and an empty response, and returns it."""

    kind = EntityKind.SERVICE
    #: The requests that wait, if these are more than the announced depth.
    depth: ClassVar[int] = 0
    #: Called with each request and its response when the response has been sent.
    after_response: Callable[[RequestT, ResponseT], Any] | None = None

    def open(self) -> tuple[Closeable, ...]:
        """Declare the service."""
        profile = replace(self.qos_profile, depth=self.depth or self.qos_profile.depth)
        self._queue: Bounded[tuple[Request, Attachment]] = Bounded(profile)
        #: The ids of the request objects that wait or are being answered.
        self._open: set[int] = set()
        return (self.node.transport.service(self.entity, self._receive),)

    def _receive(self, request: Request) -> None:
        attachment = parse_attachment(request.attachment)
        if attachment is None or len(self._open) >= MOST_OPEN:
            self.ignored += 1
            request.drop()
            return
        self._open.add(id(request))
        for oldest, _ in self._queue.append((request, attachment), len(request.payload)):
            self._drop(oldest)
        self.wake()

    def _drop(self, request: Request) -> None:
        self._open.discard(id(request))
        request.drop()

    def take(self) -> Callable[[], Any] | None:
        """Return the callback with the next request."""
        item = self._queue.pop()
        if self._queue:
            self.wake()
        if item is None:
            return None
        request, attachment = item
        message = self.decode(self.interface.kind.Request, request.payload)
        if message is None:
            self._drop(request)
            return None
        return partial(self._answer, request, attachment, message)

    async def _answer(self, request: Request, attachment: Attachment, message: RequestT) -> None:
        kind = self.interface.kind.Response
        try:
            self.report("REQUEST_RECEIVED", attachment, message)
            response = await call(self.callback, message, kind())
            payload = self.encode(kind, response)
            # first, as a client in this process receives the response at once
            self.report("RESPONSE_SENT", attachment, response)
            request.reply(payload, pack_attachment(*attachment._replace(time=time.time_ns())))
        except BaseException:
            request.drop()
            raise
        finally:
            self._open.discard(id(request))
        if self.after_response is not None:
            await call(self.after_response, message, response)

    def destroy(self) -> None:
        """Withdraw the service; requests in the queue get no response."""
        super().destroy()
        while (item := self._queue.pop()) is not None:
            self._drop(item[0])


class DeepService(Service[RequestT, ResponseT]):
    """A service that programs ask many questions at once."""

    depth = 1000


class Client(_Introspected, Generic[RequestT, ResponseT]):
    """Sends requests, from any thread; a thread of the transport completes their futures."""

    kind = EntityKind.CLIENT

    def open(self) -> tuple[Closeable, ...]:
        """Prepare calls."""
        self._gid = self.node.transport.gid(self.entity)  # computed once, as it can be a hash
        self._numbers = count(1)
        self._pending: dict[int, Future[ResponseT]] = {}
        return ()

    def call(self, request: RequestT, timeout_sec: float | None = None) -> ResponseT | None:
        """Send a request and wait; return `None` if no response came in time.

        Unlike in rclpy, nothing has to spin. Raises RobotError if no service answered.
        """
        future = self.call_async(request)
        if not any(futures.wait([future], seconds).done for seconds in self._waits(timeout_sec)):
            future.cancel()
        return future.result()

    def call_async(self, request: RequestT) -> Future[ResponseT]:
        """Send a request; return the future of its response.

        The future raises RobotError if no service answered.
        """
        payload = self.encode(self.interface.kind.Request, request)
        number = next(self._numbers)
        attachment = Attachment(number, time.time_ns(), self._gid)
        timeout = _LONG_TIMEOUT if self.srv_name.endswith("/_action/get_result") else _TIMEOUT
        receive = partial(self._receive, number)
        future: Future[ResponseT] = Future()
        self._pending[number] = future
        future.wake_at_end(partial(self._pending.pop, number, None))
        try:
            packed = pack_attachment(*attachment)
            self.node.transport.call(self.entity, payload, packed, receive, timeout=timeout)
        except Exception as error:
            future.cancel()
            raise RobotError(f"`{self.srv_name}`: {one_line(str(error))}") from None
        self.report("REQUEST_SENT", attachment, request)
        return future

    def _receive(self, number: int, sample: Sample | None) -> None:
        """Complete the future of a request; only the first response to it counts."""
        attachment = sample and parse_attachment(sample.attachment)
        answered = attachment and (attachment.sequence, attachment.gid)
        is_end = sample is None or answered == (number, self._gid)
        future = self._pending.pop(number, None) if is_end else None
        if future is None:
            self.ignored += sample is not None
            return
        executor = future.executor = self._executor
        self._finish(future, sample, attachment)
        if executor is not None:
            # a response counts as a callback, so that `spin_once` returns
            executor.schedule(lambda: True)

    def _finish(self, future: Future[ResponseT], sample: Sample | None, attachment: Any) -> None:
        if sample is None:
            hint = "is the service running? `wait_for_service` waits until the service runs"
            future.set_exception(RobotError(f"no service answered `{self.srv_name}`", hint))
            return
        try:
            response = self.interface.kind.Response.deserialize(sample.payload)
        except DecodeError as error:
            self.ignored += 1
            problem = f"sent data that is not its response: {one_line(str(error))}"
            future.set_exception(RobotError(f"`{self.srv_name}` {problem}"))
            return
        self.report("RESPONSE_RECEIVED", attachment, response)
        future.set_result(response)

    def service_is_ready(self) -> bool:
        """Return whether there is a service."""
        return bool(self.count_others(EntityKind.SERVICE))

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait until there is a service; return whether there is one now."""
        return self.wait_for(self.service_is_ready, timeout_sec)

    def wait_for(self, is_ready: Callable[[], bool], timeout: float | None) -> bool:
        """Wait until the graph makes something true; return whether it is true now."""
        wait = partial(self.node.graph.wait_for, lambda _: is_ready())
        return any(map(wait, self._waits(timeout))) or is_ready()

    def _waits(self, timeout: float | None) -> Iterator[float]:
        """Yield the seconds of short waits, until the time is over or the context is shut down."""
        end = time.monotonic() + (_LONG_TIMEOUT if timeout is None else timeout)
        while self.node.context.ok() and (left := end - time.monotonic()) > 0:
            yield min(left, _TICK)

    def destroy(self) -> None:
        """Withdraw the client; pending futures are cancelled."""
        super().destroy()
        for future in [*self._pending.values()]:
            future.cancel()


#: The parameter without which, or with True, a node has the service.
START_SERVICE = "start_type_description_service"
SERVICE = "type_description_interfaces/srv/GetTypeDescription"


def describe(node: Any, request: Any, response: Any) -> Any:
    """Fill in the response to a request, from the types that a Node uses."""
    # a relay uses several versions of one type
    versions = [e.interface for e in node.endpoints if e.interface.name == request.type_name]
    interface = next((v for v in versions if request.type_hash in ("", v.hash)), None)
    if interface is None:
        problem = f"uses the hash {versions[0].hash}" if versions else "does not use this type"
        response.failure_reason = f"the node {problem}"
        return response
    types = types_of(interface.kind)
    names = [interface.name]
    for name in names:
        nested = dict.fromkeys(field.nested.name for field in types[name].members if field.nested)
        names += [other for other in nested if other not in names]
    first, *others = [types.descriptions[name] for name in (names[0], *sorted(names[1:]))]
    sources = []
    for name in names if request.include_type_sources else ():
        kind, text = name.split("/")[1], types.sources.get(name)
        if text is not None:
            sources.append({"type_name": name, "encoding": kind, "raw_file_contents": text})
        elif kind != "msg":  # a part of a service or action; packages contain their own messages
            sources.append({"type_name": name, "encoding": "implicit"})
    description = {"type_description": first, "referenced_type_descriptions": others}
    return type(response).from_dict(
        {"successful": True, "type_description": description, "type_sources": sources}
    )
