"""The view of what is no message: services and actions, which only hold classes."""

from __future__ import annotations

import msgspec

from idlc.emit import literals, pynames
from idlc.model import derive, ir

SERVICE_PARTS = ("Request", "Response", "Event")
ACTION_PARTS = ("Goal", "Result", "Feedback")


class GroupView(msgspec.Struct, frozen=True):
    """A service or action class."""

    name: str
    base: str
    body: tuple[str, ...]


def views(interface: ir.Interface) -> list[GroupView]:
    """Return the classes that are not messages, those of an action's services first."""
    found = [
        GroupView(
            name=pynames.class_(service.name),
            base="_idlc.Service",
            body=(
                *literals.docstring([f"The service {service.name}."], 4),
                "",
                *(
                    f"    {part}: _idlc.TypeAlias = {service.name.name}_{part}"
                    for part in SERVICE_PARTS
                ),
            ),
        )
        for service in derive.services(interface)
    ]
    if isinstance(interface, ir.Action):
        found.append(_action(interface))
    return found


def _action(action: ir.Action) -> GroupView:
    name = action.name.name
    return GroupView(
        name=pynames.class_(action.name),
        base="_idlc.Action",
        body=(
            *literals.docstring([f"The action {action.name}."], 4),
            "",
            *(f"    {part}: _idlc.TypeAlias = {name}_{part}" for part in ACTION_PARTS),
            "",
            "    class Impl:",
            '        """What rclpy needs of the action."""',
            "",
            f"        SendGoalService = {name}_SendGoal",
            f"        GetResultService = {name}_GetResult",
            f"        FeedbackMessage = {name}_FeedbackMessage",
            '        CancelGoalService = _idlc.Imported("action_msgs.srv", "CancelGoal")',
            '        GoalStatusMessage = _idlc.Imported("action_msgs.msg", "GoalStatusArray")',
        ),
    )
