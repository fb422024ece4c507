"""Nodes."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Literal, overload

from idlc.robot import qos as profiles
from idlc.robot.errors import RobotError
from idlc.robot.graph import Graph
from idlc.robot.keys import Entity, EntityKind
from idlc.robot.names import InvalidNameError, expand_namespace, is_node_name
from idlc.robot.nodes.arguments import parse_arguments
from idlc.robot.nodes.clock import Clock, ClockType, GuardCondition, Time, Timer
from idlc.robot.nodes.context import Context, get_default_context
from idlc.robot.nodes.endpoints import (
    Endpoint,
    Publisher,
    RawSubscription,
    Stream,
    Subscription,
)
from idlc.robot.nodes.events import EventCallbacks
from idlc.robot.nodes.executor import CallbackGroup, Executor, MutuallyExclusiveCallbackGroup
from idlc.robot.nodes.interfaces import (
    InterfaceClass,
    M,
    RequestT,
    ResponseT,
    ServiceLike,
    standard,
)
from idlc.robot.nodes.logger import Logger, answer_levels, set_levels
from idlc.robot.nodes.overrides import QoSOverridingOptions, overridden, overrides_of
from idlc.robot.nodes.services import SERVICE, START_SERVICE, Client, DeepService, Service, describe
from idlc.robot.parameters import HasParameters, Parameter
from idlc.robot.qos import QoSProfile, ReliabilityPolicy
from idlc.robot.session import Session

_CLOCK = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


class Node(HasParameters):
    """A node, with the words of rclpy.

    `context` is what `init` opened; an open `session` can take its place. `--ros-args` in
    `cli_args` and in the arguments of `init` change names. Raises RobotError and InvalidNameError.
    """

    def __init__(
        self,
        node_name: str,
        *,
        context: Context | None = None,
        session: Session | None = None,
        cli_args: Sequence[str] | None = None,
        namespace: str | None = None,
        start_parameter_services: bool = True,
        parameter_overrides: Sequence[Parameter] = (),
        allow_undeclared_parameters: bool = False,
        automatically_declare_parameters_from_overrides: bool = False,
        enable_logger_service: bool = False,
    ) -> None:
        self.context = Context(session) if session else context or get_default_context()
        self.session = self.context.session
        self.transport = self.session.transport
        #: Replacements of names, and overrides of parameters.
        self.arguments = parse_arguments(["--ros-args", *(cli_args or ())], self.context.arguments)
        name = self.arguments.special(node_name, "__node") or node_name
        if not is_node_name(name):
            raise InvalidNameError(f"`{name}` is not the name of a node; use letters, digits, `_`")
        place = self.arguments.special(node_name, "__ns") or namespace or ""
        number = self.session.next_id()
        #: How the graph shows the node.
        self.entity = Entity(
            domain=self.session.domain,
            session=self.session.id,
            node_id=number,
            id=number,
            kind=EntityKind.NODE,
            namespace=expand_namespace(place),
            node=name,
        )
        #: The executor that runs the callbacks; its method `add_node` sets it.
        self.executor: Executor | None = None
        self.default_callback_group: CallbackGroup = MutuallyExclusiveCallbackGroup()
        self.endpoints: list[Endpoint] = []
        self.timers: list[Timer] = []
        self._clock = Clock(clock_type=ClockType.ROS_TIME)
        self._clock_subscription: Subscription[Any] | None = None
        self._token = self.transport.announce(self.entity)
        self._logger = Logger(self.entity.node_name.strip("/").replace("/", "."), self._log)
        # in the order of rclpy, so that ids are equal
        log: Any = standard("rcl_interfaces/msg/Log")
        self._rosout = self.create_publisher(log, "/rosout", profiles.qos_profile_rosout_default)
        event: Any = standard("rcl_interfaces/msg/ParameterEvent")
        self._parameter_events = self.create_publisher(
            event, "/parameter_events", profiles.qos_profile_parameter_events
        )
        overrides = overrides_of(self.arguments, self.get_fully_qualified_name())
        overrides |= {each.name: each for each in parameter_overrides or ()}
        if START_SERVICE not in overrides or overrides[START_SERVICE].value is not False:
            describe_used, service = partial(describe, self), standard(SERVICE)
            DeepService[Any, Any](self, "~/get_type_description", service, 10, None, describe_used)
        self._begin_parameters(
            overrides,
            allow_undeclared=allow_undeclared_parameters,
            declare_overrides=automatically_declare_parameters_from_overrides,
        )
        if start_parameter_services:
            self._serve_parameters(self.create_service)
        if enable_logger_service:
            for verb, answer in (("Get", answer_levels), ("Set", set_levels)):
                levels = standard(f"rcl_interfaces/srv/{verb}LoggerLevels")
                self.create_service(levels, f"{name}/{verb.lower()}_logger_levels", answer)

    # the node itself

    def attach(self, executor: Executor | None) -> None:
        """Run callbacks in this executor; called by it."""
        self.executor = executor
        if executor is not None:
            executor.transport = self.transport
        for part in (*self.timers, *self.endpoints):
            # a coroutine of another executor does not go on
            part.callback_group.waiting = None
            part.attach(executor)

    def add(self, part: Timer | Endpoint) -> None:
        """Have the executor run the callbacks of a timer or an endpoint."""
        parts: list[Any] = self.timers if isinstance(part, Timer) else self.endpoints
        parts.append(part)
        part.node = self
        part.attach(self.executor)

    def destroy_timer(self, part: Timer | Endpoint) -> bool:
        """Withdraw a timer or an endpoint; return whether it was of this node."""
        parts: list[Any] = self.timers if isinstance(part, Timer) else self.endpoints
        if part not in parts:
            return False
        parts.remove(part)
        part.attach(None)
        part.destroy()
        return True

    destroy_publisher = destroy_subscription = destroy_service = destroy_client = destroy_timer
    destroy_guard_condition = destroy_timer

    def destroy_node(self) -> None:
        """Withdraw the node with its endpoints; may be called twice."""
        if self.executor is not None:
            self.executor.remove_node(self)
        while parts := self.endpoints or self.timers:
            self.destroy_timer(parts[0])
        self._token.close()

    def get_name(self) -> str:
        """Return the name without its namespace."""
        return self.entity.node

    def get_namespace(self) -> str:
        """Return the namespace, which begins with a slash."""
        return self.entity.namespace

    def get_fully_qualified_name(self) -> str:
        """Return the absolute name."""
        return self.entity.node_name

    def get_logger(self) -> Logger:
        """Return the logger, which also publishes on /rosout."""
        return self._logger

    def get_clock(self) -> Clock:
        """Return the clock: of the system, or of /clock in a simulation."""
        return self._clock

    def use_sim_time(self, is_simulated: bool) -> None:
        """Have /clock set the clock, or the system."""
        if is_simulated and self._clock_subscription is None:
            self._clock.simulated = 0
            kind: Any = standard("rosgraph_msgs/msg/Clock")
            clock = self.create_subscription(kind, "/clock", self._set_clock, _CLOCK)
            self._clock_subscription = clock
        elif not is_simulated and self._clock_subscription is not None:
            self.destroy_subscription(self._clock_subscription)
            self._clock_subscription = None
            self._clock.simulated = None

    def _set_clock(self, message: Any) -> None:
        with suppress(ValueError):  # before 1970
            self._clock.simulated = Time.from_msg(message.clock).nanoseconds

    def _log(self, nanoseconds: int, *fields: Any) -> None:
        with suppress(RobotError):
            stamp = Time(nanoseconds=nanoseconds).to_msg()
            self._rosout.publish(self._rosout.interface.kind(stamp, *fields))

    # names

    def resolve_topic_name(self, topic: str) -> str:
        """Return the absolute name of a topic or service, replaced by `--ros-args`."""
        return self.arguments.rename(topic, self.entity.namespace, self.entity.node)

    resolve_service_name = resolve_topic_name

    # endpoints

    def create_publisher(
        self,
        msg_type: type[M] | InterfaceClass,
        topic: str,
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: EventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        publisher_class: type[Publisher[Any]] = Publisher,
    ) -> Publisher[M]:
        """Return a publisher; a number is the depth of the default profile."""
        qos_profile = overridden(self, "publisher", topic, qos_profile, qos_overriding_options)
        publisher: Publisher[M] = publisher_class(
            self, topic, msg_type, qos_profile, callback_group
        )
        publisher.watch(event_callbacks)
        return publisher

    @overload
    def create_subscription(
        self,
        msg_type: type[M] | InterfaceClass,
        topic: str,
        callback: Callable[[M], Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: EventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: Literal[False] = False,
    ) -> Subscription[M]: ...

    @overload
    def create_subscription(
        self,
        msg_type: type[Any] | InterfaceClass,
        topic: str,
        callback: Callable[[bytes], Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: EventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: Literal[True],
    ) -> Subscription[Any]: ...

    def create_subscription(
        self,
        msg_type: type[Any] | InterfaceClass,
        topic: str,
        callback: Callable[[Any], Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: EventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
    ) -> Subscription[Any]:
        """Return a subscription; `callback` gets each message, or its bytes if it is `raw`."""
        qos_profile = overridden(self, "subscription", topic, qos_profile, qos_overriding_options)
        kind: Any = RawSubscription if raw else Subscription
        subscription: Subscription[Any] = kind(
            self, topic, msg_type, qos_profile, callback_group, callback
        )
        subscription.watch(event_callbacks)
        return subscription

    def subscribe(
        self, msg_type: type[M], topic: str, qos_profile: QoSProfile | int = 10
    ) -> AsyncGenerator[M, None]:
        """Return the messages of a topic for `async for` in asyncio; nothing has to spin."""
        return Stream[M](self, topic, msg_type, qos_profile, None).messages()

    def create_service(
        self,
        srv_type: ServiceLike[RequestT, ResponseT] | InterfaceClass,
        srv_name: str,
        callback: Callable[[RequestT, ResponseT], Any],
        *,
        qos_profile: QoSProfile | int = 10,
        callback_group: CallbackGroup | None = None,
    ) -> Service[RequestT, ResponseT]:
        """Return a service; `callback` gets a request and an empty response, and returns it."""
        return Service(self, srv_name, srv_type, qos_profile, callback_group, callback)

    def create_client(
        self,
        srv_type: ServiceLike[RequestT, ResponseT] | InterfaceClass,
        srv_name: str,
        *,
        qos_profile: QoSProfile | int = 10,
        callback_group: CallbackGroup | None = None,
    ) -> Client[RequestT, ResponseT]:
        """Return a client; responses arrive while callbacks of its group run."""
        return Client(self, srv_name, srv_type, qos_profile, callback_group)

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], Any] | None,
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
    ) -> Timer:
        """Return a timer by the node's clock, or another."""
        group = callback_group or self.default_callback_group
        timer = Timer(callback, group, int(timer_period_sec * 1e9), clock or self._clock)
        self.add(timer)
        return timer

    def create_guard_condition(
        self, callback: Callable[[], Any], callback_group: CallbackGroup | None = None
    ) -> GuardCondition:
        """Return a condition that calls back when it is triggered."""
        group = callback_group or self.default_callback_group
        condition = GuardCondition(callback, group, self._clock)
        self.add(condition)
        return condition

    # the graph

    @property
    def graph(self) -> Graph:
        """All nodes and endpoints of the domain."""
        return self.session.graph

    def count_publishers(self, topic_name: str) -> int:
        """Return the number of publishers of a topic."""
        return self.graph.count(EntityKind.PUBLISHER, self.resolve_topic_name(topic_name))

    def count_subscribers(self, topic_name: str) -> int:
        """Return the number of subscriptions of a topic."""
        return self.graph.count(EntityKind.SUBSCRIPTION, self.resolve_topic_name(topic_name))

    def count_services(self, service_name: str) -> int:
        """Return the number of services with this name."""
        return self.graph.count(EntityKind.SERVICE, self.resolve_service_name(service_name))

    def count_clients(self, service_name: str) -> int:
        """Return the number of clients of a service."""
        return self.graph.count(EntityKind.CLIENT, self.resolve_service_name(service_name))

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return the topics and their types, sorted."""
        types = self.graph.types(EntityKind.PUBLISHER, EntityKind.SUBSCRIPTION)
        return [(name, [*of]) for name, of in types.items()]

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return the services and their types, sorted."""
        return [(name, [*of]) for name, of in self.graph.types(EntityKind.SERVICE).items()]

    def get_node_names(self) -> list[str]:
        """Return the names of nodes without their namespaces."""
        return [entity.node for entity in self.graph.entities(EntityKind.NODE)]


create_node = Node
