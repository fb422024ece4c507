"""Makes the offered part of rclpy, and ROS 2's standard interfaces, importable in this process."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

#: The classes in modules of their names, such as `rclpy.node.Node`.
_CLASSES = "Client Context Duration Node Publisher Service Subscription Timer".split()
#: The modules of rclpy, and the names in them; `docs/robot-nodes.md` lists them, too.
OFFERED = {f"rclpy.{name.lower()}": name for name in _CLASSES} | {
    "rclpy": (
        "Context Future Parameter create_node get_default_context init ok shutdown spin spin_once"
        " spin_until_future_complete try_shutdown"
    ),
    "rclpy.action": "ActionClient ActionServer CancelResponse GoalResponse",
    "rclpy.action.client": "ActionClient ClientGoalHandle",
    "rclpy.action.server": "ActionServer CancelResponse GoalResponse ServerGoalHandle",
    "rclpy.callback_groups": "CallbackGroup MutuallyExclusiveCallbackGroup ReentrantCallbackGroup",
    "rclpy.clock": "Clock ClockType",
    "rclpy.clock_type": "ClockType",
    "rclpy.event_handler": (
        "PublisherEventCallbacks QoSLivelinessChangedInfo QoSMessageLostInfo"
        " QoSOfferedDeadlineMissedInfo QoSOfferedIncompatibleQoSInfo QoSPublisherMatchedInfo"
        " QoSRequestedDeadlineMissedInfo QoSRequestedIncompatibleQoSInfo"
        " QoSSubscriptionMatchedInfo SubscriptionEventCallbacks UnsupportedEventTypeError"
    ),
    "rclpy.exceptions": (
        "InvalidParameterException InvalidParameterTypeException InvalidParameterValueException"
        " ParameterAlreadyDeclaredException ParameterException ParameterNotDeclaredException"
        " ParameterUninitializedException"
    ),
    "rclpy.executors": (
        "Executor ExternalShutdownException MultiThreadedExecutor ShutdownException"
        " SingleThreadedExecutor TimeoutException"
    ),
    "rclpy.guard_condition": "GuardCondition",
    "rclpy.impl": "",
    "rclpy.impl.logging_severity": "LoggingSeverity",
    "rclpy.lifecycle": (
        "LifecycleNode LifecycleNodeMixin LifecyclePublisher LifecycleState ManagedEntity Node"
        " NodeMixin Publisher SimpleManagedEntity State TransitionCallbackReturn"
    ),
    "rclpy.logging": "LoggingSeverity get_logger",
    "rclpy.parameter": "Parameter parameter_dict_from_yaml_file parameter_value_to_python",
    "rclpy.parameter_client": "AsyncParameterClient",
    "rclpy.qos": (
        "DurabilityPolicy HistoryPolicy LivelinessPolicy QoSDurabilityPolicy QoSHistoryPolicy"
        " QoSLivelinessPolicy QoSPolicyKind QoSProfile QoSReliabilityPolicy ReliabilityPolicy"
        " qos_profile_action_status_default qos_profile_parameter_events qos_profile_parameters"
        " qos_profile_sensor_data qos_profile_services_default qos_profile_system_default"
    ),
    "rclpy.qos_overriding_options": (
        "InvalidQosOverridesError QosCallbackResult QoSOverridingOptions"
    ),
    "rclpy.service_introspection": "ServiceIntrospectionState",
    "rclpy.signals": "SignalHandlerOptions",
    "rclpy.task": "Future",
    "rclpy.time": "Duration Time",
    "rclpy.utilities": "get_default_context ok remove_ros_args shutdown try_shutdown",
    "sensor_msgs_py": "",
    "sensor_msgs_py.point_cloud2": (
        "create_cloud create_cloud_xyz32 read_points read_points_numpy"
    ),
}
#: The modules of idlc that provide the names.
_HOMES = (
    "robot robot.lifecycle robot.nodes.context robot.nodes.events robot.nodes.executor"
    " robot.nodes.node robot.nodes.overrides robot.nodes.parameter_client robot.nodes.services"
    " robot.parameters robot.qos robot.nodes.point_cloud2"
).split()
#: The names that idlc gives to what has other names in rclpy.
_ALIASES = {
    f"rclpy.lifecycle.{name}": f"Lifecycle{name}"
    for name in "Node NodeMixin Publisher State".split()
}


def attribute(module: str, name: str) -> Any:
    """Return a name in a module of rclpy; raise AttributeError if idlc does not offer it."""
    full_name = f"{module}.{name}"
    if full_name in OFFERED:
        return import_module(full_name)
    if name not in OFFERED[module].split():
        raise AttributeError(not_offered(full_name), name=name)
    name = _ALIASES.get(full_name, name)
    homes = (vars(import_module(f"idlc.{home}")) for home in _HOMES)
    return next(home[name] for home in homes if name in home)


class Importer(MetaPathFinder, Loader):
    """Finds the modules, unless they are installed; for `sys.meta_path`."""

    def find_spec(self, name: str, _path: object = None, _target: object = None) -> Any:
        """Return the spec of a module; raise ModuleNotFoundError for other parts of rclpy."""
        if name in OFFERED:
            return ModuleSpec(name, self, is_package=True)
        package = name.partition(".")[0]
        if package in ("rclpy", "sensor_msgs_py"):
            # Python ignores errors with the full name of what `from rclpy.node import X` imports
            raise ModuleNotFoundError(not_offered(name), name=package)
        from idlc.model.catalog import packages
        from idlc.recordings.load import known_spec

        return known_spec(package, name) if package in packages() else None

    def exec_module(self, module: ModuleType) -> None:
        """Offer the names of a module."""
        names = OFFERED[module.__name__].split()
        vars(module).update(__all__=names, __getattr__=partial(attribute, module.__name__))


def not_offered(name: str) -> str:
    """Return the message about a name of rclpy."""
    return f"idlc does not offer `{name}`; docs/robot-nodes.md lists the names that idlc offers"
