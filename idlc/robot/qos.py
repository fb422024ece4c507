"""Quality of service in the words of rclpy: profiles, the predefined ones, and compatibility."""

from __future__ import annotations

from enum import IntEnum
from operator import index
from typing import Any

import msgspec

#: Nanoseconds of a duration that never ends, and of one that follows the other side.
INFINITE = 2**63 - 1
FOLLOWS = INFINITE - 1
#: The depth of a profile that leaves it to the middleware.
DEFAULT_DEPTH = 42
#: No depth is larger, so that no announcement of another program is either.
MOST_DEPTH = 2**31 - 1

# The numbers of all policies are those of rmw, which are also on the wire.


class ReliabilityPolicy(IntEnum):
    """Delivery of each message, or of the newest that arrive."""

    SYSTEM_DEFAULT = 0
    RELIABLE = 1
    BEST_EFFORT = 2
    BEST_AVAILABLE = 4


class DurabilityPolicy(IntEnum):
    """Delivery of earlier messages to late subscriptions, or not."""

    SYSTEM_DEFAULT = 0
    TRANSIENT_LOCAL = 1
    VOLATILE = 2
    BEST_AVAILABLE = 4


class HistoryPolicy(IntEnum):
    """The kept messages: the last `depth`, or all; Fast DDS does not tell others."""

    SYSTEM_DEFAULT = 0
    KEEP_LAST = 1
    KEEP_ALL = 2
    UNKNOWN = 3


class LivelinessPolicy(IntEnum):
    """The way in which a publisher asserts that it is alive."""

    SYSTEM_DEFAULT = 0
    AUTOMATIC = 1
    MANUAL_BY_TOPIC = 3
    BEST_AVAILABLE = 5


class QoSPolicyKind(IntEnum):
    """A policy of a profile."""

    INVALID = 1
    DURABILITY = 2
    DEADLINE = 4
    LIVELINESS = 8
    RELIABILITY = 16
    HISTORY = 32
    LIFESPAN = 64
    DEPTH = 128
    LIVELINESS_LEASE_DURATION = 256
    AVOID_ROS_NAMESPACE_CONVENTIONS = 512


class QoSProfile(msgspec.Struct, kw_only=True):
    """Quality of service of one endpoint.

    Durations are nanoseconds, or objects that have `nanoseconds`, such as rclpy's; a profile
    contains integers. Values that leave the choice to the middleware become its choice:
    SYSTEM_DEFAULT the default of the policy, depth 0 a depth of 42, a duration of 0 infinite.
    Raises ValueError if a value is out of range, and TypeError if it is no integer.
    """

    history: HistoryPolicy = HistoryPolicy.KEEP_LAST
    depth: int = DEFAULT_DEPTH
    reliability: ReliabilityPolicy = ReliabilityPolicy.RELIABLE
    durability: DurabilityPolicy = DurabilityPolicy.VOLATILE
    lifespan: Any = INFINITE
    deadline: Any = INFINITE
    liveliness: LivelinessPolicy = LivelinessPolicy.AUTOMATIC
    liveliness_lease_duration: Any = INFINITE

    def __post_init__(self) -> None:
        """Check the values and fill in the choices of the middleware."""
        for name, default in zip(self.__struct_fields__, self.__struct_defaults__, strict=True):
            value = getattr(self, name)
            number = index(getattr(value, "nanoseconds", value)) or default
            most = MOST_DEPTH if name == "depth" else INFINITE
            if isinstance(default, IntEnum):
                number = type(default)(number)
            elif not 0 < number <= most:
                raise ValueError(f"{name} must be between 0 and {most}, not {number}")
            msgspec.structs.force_setattr(self, name, number)

    def __setattr__(self, name: str, value: Any) -> None:
        """Change a value; endpoints have a profile of their own, which stays as it is."""
        # `msgspec.structs.replace` calls `__post_init__` only in later versions
        changed = type(self)(**{**msgspec.structs.asdict(self), name: value})
        msgspec.structs.force_setattr(self, name, getattr(changed, name))

    def __hash__(self) -> int:
        return hash(msgspec.structs.astuple(self))

    @property
    def is_latched(self) -> bool:
        """True if late subscriptions get earlier messages."""
        return self.durability is DurabilityPolicy.TRANSIENT_LOCAL

    @property
    def is_reliable(self) -> bool:
        """True if lost messages are sent again."""
        return self.reliability is not ReliabilityPolicy.BEST_EFFORT


# rclpy's older names
QoSReliabilityPolicy = ReliabilityPolicy
QoSDurabilityPolicy = DurabilityPolicy
QoSHistoryPolicy = HistoryPolicy
QoSLivelinessPolicy = LivelinessPolicy

qos_profile_system_default = QoSProfile()
qos_profile_sensor_data = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
qos_profile_services_default = QoSProfile(depth=10)
qos_profile_parameters = QoSProfile(depth=1000)
qos_profile_parameter_events = qos_profile_parameters
qos_profile_action_status_default = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
qos_profile_rosout_default = QoSProfile(
    depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL, lifespan=10 * 10**9
)


def qos_profile(value: QoSProfile | int) -> QoSProfile:
    """Return a copy of a profile, or the default profile with this depth."""
    if isinstance(value, QoSProfile):
        return msgspec.structs.replace(value)
    return QoSProfile(depth=value)


#: The offered and the requested value that do not fit; durations fit if they are not longer.
_UNFIT = {
    "reliability": (ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE),
    "durability": (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL),
    "deadline": None,
    "liveliness": (LivelinessPolicy.AUTOMATIC, LivelinessPolicy.MANUAL_BY_TOPIC),
    "liveliness_lease_duration": None,
}


def incompatible_policies(offered: QoSProfile, requested: QoSProfile) -> tuple[str, ...]:
    """Return the policies for which a publisher offers less than a subscription requests.

    ROS 2 on DDS does not connect such ends; rmw_zenoh connects them all the same.
    """
    names = []
    for name, unfit in _UNFIT.items():
        pair = (getattr(offered, name), getattr(requested, name))
        if pair == unfit or (unfit is None and pair[0] > pair[1] != FOLLOWS):
            names.append(name)
    return tuple(names)
