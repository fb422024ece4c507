"""The names of rclpy that idlc offers to a program, and the modules in which they are here.

`docs/robot-nodes.md` lists the modules.
"""

from __future__ import annotations

_ACTIONS = "idlc.robot.actions"
_NODES = "idlc.robot.nodes"
_VALUES = "idlc.robot.parameters.values"
_QOS = "idlc.robot.qos"

_EXECUTORS = "Executor ExternalShutdownException SingleThreadedExecutor"
_GROUPS = "CallbackGroup MutuallyExclusiveCallbackGroup ReentrantCallbackGroup"

#: For each module of rclpy: modules of idlc, and the names that they provide.
OFFERED: dict[str, dict[str, str]] = {
    "rclpy": {
        f"{_NODES}.context": "Context get_default_context init ok shutdown try_shutdown",
        f"{_NODES}.spinning": "create_node spin spin_once spin_until_future_complete",
        f"{_NODES}.tasks": "Future",
        _VALUES: "Parameter",
    },
    "rclpy.action": {
        f"{_ACTIONS}.client": "ActionClient",
        f"{_ACTIONS}.goals": "CancelResponse GoalResponse",
        f"{_ACTIONS}.server": "ActionServer",
    },
    "rclpy.action.client": {f"{_ACTIONS}.client": "ActionClient ClientGoalHandle"},
    "rclpy.action.server": {
        f"{_ACTIONS}.goals": "CancelResponse GoalResponse",
        f"{_ACTIONS}.server": "ActionServer ServerGoalHandle",
    },
    "rclpy.callback_groups": {f"{_NODES}.executor": _GROUPS},
    "rclpy.client": {f"{_NODES}.services": "Client"},
    "rclpy.clock": {f"{_NODES}.clock": "Clock ClockType"},
    "rclpy.context": {f"{_NODES}.context": "Context"},
    "rclpy.duration": {f"{_NODES}.clock": "Duration"},
    "rclpy.exceptions": {
        _VALUES: (
            "InvalidParameterException InvalidParameterTypeException"
            " InvalidParameterValueException ParameterAlreadyDeclaredException ParameterException"
            " ParameterNotDeclaredException ParameterUninitializedException"
        )
    },
    "rclpy.executors": {f"{_NODES}.executor": _EXECUTORS},
    "rclpy.logging": {f"{_NODES}.logger": "LoggingSeverity get_logger"},
    "rclpy.node": {f"{_NODES}.node": "Node"},
    "rclpy.parameter": {_VALUES: "Parameter parameter_value_to_python"},
    "rclpy.publisher": {f"{_NODES}.endpoints": "Publisher"},
    "rclpy.qos": {
        _QOS: (
            "DurabilityPolicy HistoryPolicy LivelinessPolicy QoSProfile ReliabilityPolicy"
            " qos_profile_action_status_default qos_profile_best_available"
            " qos_profile_parameter_events qos_profile_parameters qos_profile_sensor_data"
            " qos_profile_services_default qos_profile_system_default"
        )
    },
    "rclpy.service": {f"{_NODES}.services": "Service"},
    "rclpy.signals": {f"{_NODES}.context": "SignalHandlerOptions"},
    "rclpy.subscription": {f"{_NODES}.endpoints": "Subscription"},
    "rclpy.task": {f"{_NODES}.tasks": "Future Task"},
    "rclpy.time": {f"{_NODES}.clock": "Duration Time"},
    "rclpy.timer": {f"{_NODES}.timer": "Timer"},
    "rclpy.utilities": {
        f"{_NODES}.arguments": "remove_ros_args",
        f"{_NODES}.context": "get_default_context ok shutdown try_shutdown",
    },
}
