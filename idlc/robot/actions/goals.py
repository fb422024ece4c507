"""The states of goals, the answers of servers to clients, and the ids of goals."""

from __future__ import annotations

from enum import Enum, IntEnum
from inspect import isawaitable
from typing import Any


class GoalState(IntEnum):
    """The state of a goal; the numbers are those of action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def is_active(self) -> bool:
        """True if the goal has not ended."""
        return GoalState.ACCEPTED <= self <= GoalState.CANCELING


class CancelCode(IntEnum):
    """The outcome of a request to cancel; the numbers are those of action_msgs/srv/CancelGoal."""

    NONE = 0
    REJECTED = 1
    UNKNOWN_GOAL_ID = 2
    GOAL_TERMINATED = 3


class GoalResponse(Enum):
    """The answer to a new goal."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(Enum):
    """The answer to a request to cancel a goal."""

    REJECT = 1
    ACCEPT = 2


#: The states from which a goal can enter a state.
BEFORE: dict[GoalState, tuple[GoalState, ...]] = {
    GoalState.EXECUTING: (GoalState.ACCEPTED,),
    GoalState.CANCELING: (GoalState.ACCEPTED, GoalState.EXECUTING),
    GoalState.SUCCEEDED: (GoalState.EXECUTING, GoalState.CANCELING),
    GoalState.CANCELED: (GoalState.CANCELING,),
    GoalState.ABORTED: (GoalState.EXECUTING, GoalState.CANCELING),
}


def id_of(goal_id: Any) -> bytes:
    """Return the id in a unique_identifier_msgs/msg/UUID."""
    return bytes(goal_id.uuid)


async def result_of(value: Any) -> Any:
    """Return the result of a callback, which may be a coroutine."""
    return await value if isawaitable(value) else value
