"""Nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from idlc.robot.errors import RobotError
from idlc.robot.graph import Graph
from idlc.robot.keys import Entity, Kind
from idlc.robot.names import InvalidNameError, expand_namespace, is_node_name
from idlc.robot.nodes.arguments import Arguments, parse_arguments
from idlc.robot.nodes.clock import Clock, ClockType, Time, Timer
from idlc.robot.nodes.context import Context, get_default_context
from idlc.robot.nodes.descriptions import SERVICE, describe
from idlc.robot.nodes.endpoints import (
    Publisher,
    PublisherEventCallbacks,
    Subscription,
    SubscriptionEventCallbacks,
)
from idlc.robot.nodes.executor import (
    CallbackGroup,
    Executor,
    MutuallyExclusiveCallbackGroup,
    Ready,
)
from idlc.robot.nodes.interfaces import (
    Interface,
    MessageLike,
    RequestT,
    ResponseT,
    ServiceLike,
    interface_of,
    standard,
)
from idlc.robot.nodes.logger import Logger, Record
from idlc.robot.nodes.services import Client, Service
from idlc.robot.parameters.declared import HasParameters, add_services
from idlc.robot.parameters.overrides import overrides_of
from idlc.robot.parameters.values import Parameter
from idlc.robot.qos import (
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_parameter_events,
    qos_profile_rosout_default,
    qos_profile_services_default,
)
from idlc.robot.qos import qos_profile as profile_of

if TYPE_CHECKING:
    from idlc.robot.nodes.stream import Stream
    from idlc.robot.session import Session
    from idlc.robot.transport import Transport

M = TypeVar("M", bound=MessageLike)
R = TypeVar("R", bound=Ready)
_CLOCK = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


class TopicEndpointInfo(NamedTuple):
    """A publisher or subscription in the graph."""

    node_name: str
    node_namespace: str
    topic_type: str
    topic_type_hash: str
    endpoint_type: str
    endpoint_gid: list[int]
    qos_profile: QoSProfile


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
        use_global_arguments: bool = True,
        enable_rosout: bool = True,
        start_parameter_services: bool = True,
        parameter_overrides: Sequence[Parameter] = (),
        allow_undeclared_parameters: bool = False,
        automatically_declare_parameters_from_overrides: bool = False,
    ) -> None:
        self._context = Context(session) if session else context or get_default_context()
        self.session = self._context.session
        own = parse_arguments(["--ros-args", *(cli_args or ())])
        #: Replacements of names, and overrides of parameters.
        self.arguments = own + (self._context.arguments if use_global_arguments else Arguments())
        self._name = self.arguments.special(node_name, "__node") or node_name
        if not is_node_name(self._name):
            raise InvalidNameError(
                f"`{self._name}` is not the name of a node; write letters, digits and `_`"
            )
        place = self.arguments.special(node_name, "__ns") or namespace or ""
        self._namespace = expand_namespace(place)
        self._executor: Executor | None = None
        self.default_callback_group: CallbackGroup = MutuallyExclusiveCallbackGroup()
        self.publishers: list[Publisher[Any]] = []
        self.subscriptions: list[Subscription[Any]] = []
        self.services: list[Service[Any, Any]] = []
        self.clients: list[Client[Any, Any]] = []
        self.timers: list[Timer] = []
        self.waitables: list[Ready] = []
        self._interfaces: dict[str, Interface] = {}
        self._clock = Clock(clock_type=ClockType.ROS_TIME)
        self._clock_subscription: Subscription[Any] | None = None
        self._rosout: Publisher[Any] | None = None
        self._id = self.session.next_id()
        self._token = self.transport.announce(self._entity(Kind.NODE, self._id).token)
        self._logger = Logger(
            f"{self._namespace}/{self._name}".strip("/").replace("/", "."), self._log
        )
        # in the order of rclpy, so that ids are equal
        if enable_rosout:
            self._rosout = self._publisher(
                "/rosout", standard("rcl_interfaces/msg/Log"), qos_profile_rosout_default
            )
        self._parameter_events = self._publisher(
            "/parameter_events",
            standard("rcl_interfaces/msg/ParameterEvent"),
            qos_profile_parameter_events,
        )
        self._service(
            "~/get_type_description", standard(SERVICE), partial(describe, self._interfaces)
        )
        overrides = overrides_of(self.arguments, self.get_fully_qualified_name())
        self._begin_parameters(
            {**overrides, **{each.name: each for each in parameter_overrides or ()}},
            allow_undeclared=allow_undeclared_parameters,
            declare_overrides=automatically_declare_parameters_from_overrides,
        )
        if start_parameter_services:
            add_services(self, self._service)

    # the node itself

    @property
    def context(self) -> Context:
        """The context of the node."""
        return self._context

    @property
    def transport(self) -> Transport:
        """The connection to other programs."""
        return self.session.transport

    @property
    def executor(self) -> Executor | None:
        """The executor that runs the callbacks."""
        return self._executor

    @executor.setter
    def executor(self, executor: Executor | None) -> None:
        if executor is not None:
            executor.add_node(self)
        elif self._executor is not None:
            self._executor.remove_node(self)

    def attach(self, executor: Executor | None) -> None:
        """Run callbacks in this executor; called by it."""
        self._executor = executor
        for ready in self._ready():
            if ready.callback_group is not None:
                ready.callback_group.reset()
            ready.attach(executor)

    def _ready(self) -> list[Ready]:
        return [
            *self.timers,
            *self.subscriptions,
            *self.services,
            *self.clients,
            *self.waitables,
        ]

    def add(self, ready: R, where: list[Any]) -> R:
        """Have the executor of the node run the callbacks of `ready`."""
        where.append(ready)
        ready.attach(self._executor)
        if self._executor is not None:
            self._executor.wake()
        return ready

    def _remove(self, item: Any, where: list[Any]) -> bool:
        if item not in where:
            return False
        where.remove(item)
        if isinstance(item, Ready):
            item.attach(None)
        item.destroy()
        return True

    def get_name(self) -> str:
        """Return the name without its namespace."""
        return self._name

    def get_namespace(self) -> str:
        """Return the namespace, which begins with a slash."""
        return self._namespace

    def get_fully_qualified_name(self) -> str:
        """Return the absolute name."""
        return f"{self._namespace.rstrip('/')}/{self._name}"

    def get_logger(self) -> Logger:
        """Return the logger, which also publishes on /rosout."""
        return self._logger

    def get_clock(self) -> Clock:
        """Return the clock: of the system, or of /clock in a simulation."""
        return self._clock

    def use_sim_time(self, is_simulated: bool) -> None:
        """Have /clock set the clock, or the system."""
        subscription = self._clock_subscription
        if is_simulated and subscription is None:
            self._clock.simulate(0)
            self._clock_subscription = self._subscription(
                "/clock", standard("rosgraph_msgs/msg/Clock"), self._set_clock, _CLOCK
            )
        elif not is_simulated and subscription is not None:
            self._clock_subscription = None
            self.destroy_subscription(subscription)
            self._clock.simulate(None)

    def _set_clock(self, message: Any) -> None:
        with suppress(ValueError):  # before 1970
            self._clock.simulate(Time.from_msg(message.clock).nanoseconds)

    def _log(self, record: Record) -> None:
        if self._rosout is None:
            return
        with suppress(RobotError):
            message = self._rosout.msg_type(
                level=int(record.level),
                name=record.name,
                msg=record.message,
                file=record.file,
                function=record.function,
                line=record.line,
            )
            message.stamp.sec, message.stamp.nanosec = divmod(record.time, 10**9)
            self._rosout.publish(message)

    def destroy_node(self) -> None:
        """Withdraw the node with its endpoints; may be called twice."""
        if self._executor is not None:
            self._executor.remove_node(self)
        for endpoint in [*self.publishers, *self.subscriptions, *self.services, *self.clients]:
            endpoint.destroy()
        for timer in self.timers:
            timer.destroy()
        self._token.close()

    # names

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """Return the absolute name of a topic, replaced by `--ros-args` unless `only_expand`."""
        return self._resolve(topic, "rostopic", only_expand)

    def resolve_service_name(self, service: str, *, only_expand: bool = False) -> str:
        """Return the absolute name of a service, replaced by `--ros-args` unless `only_expand`."""
        return self._resolve(service, "rosservice", only_expand)

    def _resolve(self, name: str, scheme: str, only_expand: bool) -> str:
        arguments = Arguments() if only_expand else self.arguments
        return arguments.rename(name, self._namespace, self._name, scheme)

    # endpoints

    def entity(self, kind: Kind, name: str, interface: Interface, qos: QoSProfile) -> Entity:
        """Return the entity of a new endpoint; raise InvalidNameError."""
        is_topic = kind in (Kind.PUBLISHER, Kind.SUBSCRIPTION)
        absolute = self._resolve(name, "rostopic" if is_topic else "rosservice", False)
        self._interfaces[interface.name] = interface
        return self._entity(
            kind,
            self.session.next_id(),
            name=absolute,
            type=interface.name,
            hash=interface.hash,
            qos=qos,
        )

    def _entity(self, kind: Kind, number: int, **more: Any) -> Entity:
        return Entity(
            domain=self.session.domain,
            session=self.session.id,
            node_id=self._id,
            id=number,
            kind=kind,
            namespace=self._namespace,
            node=self._name,
            **more,
        )

    def _publisher(
        self, topic: str, interface: Interface, qos: QoSProfile, **more: Any
    ) -> Publisher[Any]:
        publisher: Publisher[Any] = Publisher(self, topic, interface, qos, **more)
        self.publishers.append(publisher)
        return publisher

    def _subscription(
        self,
        topic: str,
        interface: Interface,
        callback: Callable[..., Any],
        qos: QoSProfile,
        **more: Any,
    ) -> Subscription[Any]:
        more["group"] = more.get("group") or self.default_callback_group
        subscription: Subscription[Any] = Subscription(
            self, topic, interface, callback, qos, **more
        )
        return self.add(subscription, self.subscriptions)

    def _service(
        self,
        name: str,
        interface: Interface,
        callback: Callable[..., Any],
        qos: QoSProfile = qos_profile_services_default,
        group: CallbackGroup | None = None,
    ) -> Service[Any, Any]:
        service: Service[Any, Any] = Service(
            self, name, interface, callback, qos, group=group or self.default_callback_group
        )
        return self.add(service, self.services)

    def create_publisher(
        self,
        msg_type: type[M],
        topic: str,
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: PublisherEventCallbacks | None = None,
    ) -> Publisher[M]:
        """Return a publisher; a number is the depth of the default profile."""
        return self._publisher(
            topic,
            interface_of(msg_type),
            profile_of(qos_profile),
            group=callback_group or self.default_callback_group,
            events=event_callbacks,
        )

    def create_subscription(
        self,
        msg_type: type[M],
        topic: str,
        callback: Callable[[M], Any] | Callable[[M, Any], Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        raw: bool = False,
    ) -> Subscription[M]:
        """Return a subscription; `callback` gets each message, or its bytes with `raw`.

        A callback with two parameters also gets a dictionary of times and numbers.
        """
        return self._subscription(
            topic,
            interface_of(msg_type),
            callback,
            profile_of(qos_profile),
            group=callback_group,
            events=event_callbacks,
            raw=raw,
        )

    def subscribe(
        self, msg_type: type[M], topic: str, qos_profile: QoSProfile | int = 10
    ) -> Stream[M]:
        """Return the messages of a topic for `async for` in asyncio; nothing has to spin."""
        from idlc.robot.nodes.stream import Stream

        stream: Stream[M] = Stream(self, topic, interface_of(msg_type), profile_of(qos_profile))
        return self.add(stream, self.subscriptions)

    def create_service(
        self,
        srv_type: ServiceLike[RequestT, ResponseT],
        srv_name: str,
        callback: Callable[[RequestT, ResponseT], Any],
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Service[RequestT, ResponseT]:
        """Return a service; `callback` gets a request and an empty response, and returns it."""
        return self._service(
            srv_name, interface_of(srv_type), callback, qos_profile, callback_group
        )

    def create_client(
        self,
        srv_type: ServiceLike[RequestT, ResponseT],
        srv_name: str,
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,  # noqa: ARG002 - as in rclpy
    ) -> Client[RequestT, ResponseT]:
        """Return a client; responses are taken between callbacks of any group."""
        client: Client[RequestT, ResponseT] = Client(
            self, srv_name, interface_of(srv_type), qos_profile
        )
        return self.add(client, self.clients)

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], Any] | None,
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Return a timer by the node's clock, or another."""
        timer = Timer(
            callback,
            callback_group or self.default_callback_group,
            int(timer_period_sec * 1e9),
            clock or self._clock,
            autostart=autostart,
        )
        return self.add(timer, self.timers)

    def destroy_publisher(self, publisher: Publisher[Any]) -> bool:
        """Withdraw a publisher; return whether it was of this node."""
        return self._remove(publisher, self.publishers)

    def destroy_subscription(self, subscription: Subscription[Any]) -> bool:
        """Withdraw a subscription; return whether it was of this node."""
        return self._remove(subscription, self.subscriptions)

    def destroy_service(self, service: Service[Any, Any]) -> bool:
        """Withdraw a service; return whether it was of this node."""
        return self._remove(service, self.services)

    def destroy_client(self, client: Client[Any, Any]) -> bool:
        """Withdraw a client; return whether it was of this node."""
        return self._remove(client, self.clients)

    def destroy_timer(self, timer: Timer) -> bool:
        """Stop a timer for good; return whether it was of this node."""
        return self._remove(timer, self.timers)

    # the graph

    @property
    def graph(self) -> Graph:
        """All nodes and endpoints of the domain."""
        return self.session.graph

    def count_matching(self, kind: Kind, other: Entity) -> int:
        """Return the number of endpoints with the key of another: its name, type and hash."""
        entities = self.graph.entities(kind, name=other.name, type=other.type)
        return sum(entity.hash == other.hash for entity in entities)

    def count_publishers(self, topic_name: str) -> int:
        """Return the number of publishers of a topic."""
        return self.graph.count(Kind.PUBLISHER, self.resolve_topic_name(topic_name))

    def count_subscribers(self, topic_name: str) -> int:
        """Return the number of subscriptions of a topic."""
        return self.graph.count(Kind.SUBSCRIPTION, self.resolve_topic_name(topic_name))

    def count_services(self, service_name: str) -> int:
        """Return the number of services with this name."""
        return self.graph.count(Kind.SERVICE, self.resolve_service_name(service_name))

    def count_clients(self, service_name: str) -> int:
        """Return the number of clients of a service."""
        return self.graph.count(Kind.CLIENT, self.resolve_service_name(service_name))

    def get_topic_names_and_types(self, no_demangle: bool = False) -> list[tuple[str, list[str]]]:  # noqa: ARG002
        """Return the topics and their types, sorted."""
        return _listed(self.graph.types(Kind.PUBLISHER, Kind.SUBSCRIPTION))

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return the services and their types, sorted."""
        return _listed(self.graph.types(Kind.SERVICE))

    def get_node_names(self) -> list[str]:
        """Return the names of nodes without their namespaces."""
        return [name for name, _ in self.get_node_names_and_namespaces()]

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return the names of nodes, and their namespaces."""
        return [(entity.node, entity.namespace) for entity in self.graph.entities(Kind.NODE)]

    def get_publishers_info_by_topic(
        self,
        topic_name: str,
        no_mangle: bool = False,  # noqa: ARG002
    ) -> list[TopicEndpointInfo]:
        """Return the publishers of a topic."""
        return self._infos(Kind.PUBLISHER, topic_name)

    def get_subscriptions_info_by_topic(
        self,
        topic_name: str,
        no_mangle: bool = False,  # noqa: ARG002
    ) -> list[TopicEndpointInfo]:
        """Return the subscriptions of a topic."""
        return self._infos(Kind.SUBSCRIPTION, topic_name)

    def _infos(self, kind: Kind, topic: str) -> list[TopicEndpointInfo]:
        return [
            TopicEndpointInfo(
                entity.node,
                entity.namespace,
                entity.type,
                entity.hash,
                kind.name,
                [*entity.gid],
                entity.qos,
            )
            for entity in self.graph.entities(kind, name=self.resolve_topic_name(topic))
        ]


def _listed(types: dict[str, tuple[str, ...]]) -> list[tuple[str, list[str]]]:
    return [(name, [*of]) for name, of in types.items()]


#: rclpy has a function of this name, which does the same.
create_node = Node
