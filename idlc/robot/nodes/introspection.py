"""Service introspection: events about requests and responses, for tools that watch services."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from idlc.robot.keys import Attachment
from idlc.robot.nodes.clock import Clock
from idlc.robot.nodes.endpoints import Endpoint, Publisher
from idlc.robot.qos import QoSProfile


class ServiceIntrospectionState(IntEnum):
    """The content of events: none are published, or without messages, or with messages."""

    OFF = 0
    METADATA = 1
    CONTENTS = 2


class EventType(IntEnum):
    """The numbers of service_msgs/msg/ServiceEventInfo."""

    REQUEST_SENT = 0
    REQUEST_RECEIVED = 1
    RESPONSE_SENT = 2
    RESPONSE_RECEIVED = 3


class Introspected(Endpoint):
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

    def report(self, type_: EventType, call: Attachment, message: Any) -> None:
        """Publish an event about a request or response of a call."""
        if self._introspection is None:
            return
        publisher, clock, has_contents = self._introspection
        event = publisher.interface.kind()
        event.info.event_type = type_
        event.info.stamp = clock.now().to_msg()
        event.info.client_gid = [*call.gid]
        event.info.sequence_number = call.sequence
        if has_contents:
            is_request = type_ in (EventType.REQUEST_SENT, EventType.REQUEST_RECEIVED)
            setattr(event, "request" if is_request else "response", [message])
        publisher.publish(event)

    def destroy(self) -> None:
        """Withdraw the endpoint, and the publisher of events."""
        super().destroy()
        if self._introspection is not None:
            self.node.destroy_publisher(self._introspection[0])
