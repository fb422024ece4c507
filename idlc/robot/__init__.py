"""A live robot: its graph and types, and nodes without ROS, over the protocol of rmw_zenoh."""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from idlc.robot.actions.client import ActionClient, ClientGoalHandle
    from idlc.robot.actions.goals import CancelResponse, GoalResponse
    from idlc.robot.actions.server import ActionServer, ServerGoalHandle
    from idlc.robot.errors import RobotError
    from idlc.robot.graph import Graph
    from idlc.robot.nodes.arguments import remove_ros_args
    from idlc.robot.nodes.clock import Clock, ClockType, Duration, Time
    from idlc.robot.nodes.context import (
        Context,
        SignalHandlerOptions,
        get_default_context,
        init,
        ok,
        shutdown,
        try_shutdown,
    )
    from idlc.robot.nodes.endpoints import (
        Publisher,
        PublisherEventCallbacks,
        Subscription,
        SubscriptionEventCallbacks,
    )
    from idlc.robot.nodes.executor import (
        Executor,
        ExternalShutdownException,
        MutuallyExclusiveCallbackGroup,
        ReentrantCallbackGroup,
        SingleThreadedExecutor,
    )
    from idlc.robot.nodes.logger import Logger, LoggingSeverity, get_logger
    from idlc.robot.nodes.node import Node
    from idlc.robot.nodes.services import Client, Service
    from idlc.robot.nodes.spinning import spin, spin_once, spin_until_future_complete
    from idlc.robot.nodes.tasks import Future
    from idlc.robot.nodes.timer import Timer
    from idlc.robot.parameters.values import Parameter, parameter_value_to_python
    from idlc.robot.qos import (
        DurabilityPolicy,
        HistoryPolicy,
        LivelinessPolicy,
        QoSProfile,
        ReliabilityPolicy,
    )
    from idlc.robot.session import Session, open_router, open_session

__all__ = [
    "ActionClient",
    "ActionServer",
    "CancelResponse",
    "Client",
    "ClientGoalHandle",
    "Clock",
    "ClockType",
    "Context",
    "DurabilityPolicy",
    "Duration",
    "Executor",
    "ExternalShutdownException",
    "Future",
    "GoalResponse",
    "Graph",
    "HistoryPolicy",
    "LivelinessPolicy",
    "Logger",
    "LoggingSeverity",
    "MutuallyExclusiveCallbackGroup",
    "Node",
    "Parameter",
    "Publisher",
    "PublisherEventCallbacks",
    "QoSProfile",
    "ReentrantCallbackGroup",
    "ReliabilityPolicy",
    "RobotError",
    "ServerGoalHandle",
    "Service",
    "Session",
    "SignalHandlerOptions",
    "SingleThreadedExecutor",
    "Subscription",
    "SubscriptionEventCallbacks",
    "Time",
    "Timer",
    "get_default_context",
    "get_logger",
    "init",
    "ok",
    "open_router",
    "open_session",
    "parameter_value_to_python",
    "remove_ros_args",
    "shutdown",
    "spin",
    "spin_once",
    "spin_until_future_complete",
    "try_shutdown",
]

#: The names that programs use, and the modules that are imported when they ask for one.
_MODULES = {
    "ActionClient": "actions.client",
    "ActionServer": "actions.server",
    "CancelResponse": "actions.goals",
    "Client": "nodes.services",
    "ClientGoalHandle": "actions.client",
    "Clock": "nodes.clock",
    "ClockType": "nodes.clock",
    "Context": "nodes.context",
    "DurabilityPolicy": "qos",
    "Duration": "nodes.clock",
    "Executor": "nodes.executor",
    "ExternalShutdownException": "nodes.executor",
    "Future": "nodes.tasks",
    "GoalResponse": "actions.goals",
    "Graph": "graph",
    "HistoryPolicy": "qos",
    "LivelinessPolicy": "qos",
    "Logger": "nodes.logger",
    "LoggingSeverity": "nodes.logger",
    "MutuallyExclusiveCallbackGroup": "nodes.executor",
    "Node": "nodes.node",
    "Parameter": "parameters.values",
    "Publisher": "nodes.endpoints",
    "PublisherEventCallbacks": "nodes.endpoints",
    "QoSProfile": "qos",
    "ReentrantCallbackGroup": "nodes.executor",
    "ReliabilityPolicy": "qos",
    "RobotError": "errors",
    "ServerGoalHandle": "actions.server",
    "Service": "nodes.services",
    "Session": "session",
    "SignalHandlerOptions": "nodes.context",
    "SingleThreadedExecutor": "nodes.executor",
    "Subscription": "nodes.endpoints",
    "SubscriptionEventCallbacks": "nodes.endpoints",
    "Time": "nodes.clock",
    "Timer": "nodes.timer",
    "get_default_context": "nodes.context",
    "get_logger": "nodes.logger",
    "init": "nodes.context",
    "ok": "nodes.context",
    "open_router": "session",
    "open_session": "session",
    "parameter_value_to_python": "parameters.values",
    "remove_ros_args": "nodes.arguments",
    "shutdown": "nodes.context",
    "spin": "nodes.spinning",
    "spin_once": "nodes.spinning",
    "spin_until_future_complete": "nodes.spinning",
    "try_shutdown": "nodes.context",
}


def __getattr__(name: str) -> object:
    """Import a name when a program asks for it."""
    if name in _MODULES:
        return getattr(__import__(f"idlc.robot.{_MODULES[name]}", fromlist=[name]), name)
    raise AttributeError(f"module 'idlc.robot' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the public names, for help() and completion."""
    return sorted({*globals(), *__all__})
