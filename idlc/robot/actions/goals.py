"""The states of goals, and the answers of servers to clients."""

from __future__ import annotations

from enum import Enum, IntEnum


class GoalState(IntEnum):
    """The state of a goal; the numbers are those of action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class GoalResponse(Enum):
    """The answer to a new goal."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(Enum):
    """The answer to a request to cancel a goal."""

    REJECT = 1
    ACCEPT = 2
