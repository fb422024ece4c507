"""The structures that services and actions imply, built in one place (language 5)."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import TypeVar

from idlc.model import ir

Node = TypeVar("Node", bound=Hashable)

SERVICE_EVENT_INFO = ir.TypeName("service_msgs", "msg", "ServiceEventInfo")
UUID = ir.TypeName("unique_identifier_msgs", "msg", "UUID")
TIME = ir.TypeName("builtin_interfaces", "msg", "Time")

#: What clients and servers of all actions use.
ACTION_PROTOCOL = frozenset(
    {
        ir.TypeName("action_msgs", "srv", "CancelGoal"),
        ir.TypeName("action_msgs", "msg", "GoalStatusArray"),
    }
)

#: Packages that each kind of file needs beside the types that it names.
IMPLICIT_PACKAGES: dict[ir.Kind, tuple[str, ...]] = {
    "msg": (),
    "srv": ("service_msgs",),
    "action": ("service_msgs", "action_msgs"),
}


def _named(parent: ir.TypeName, suffix: str) -> ir.TypeName:
    return parent._replace(name=parent.name + suffix)


def _field(name: str, type_: ir.FieldType) -> ir.Field:
    return ir.Field(name=name, type=type_)


def event(service: ir.Service) -> ir.Message:
    """Return the X_Event message of a service, which service introspection publishes."""
    return ir.Message(
        name=_named(service.name, "_Event"),
        fields=(
            _field("info", ir.Ref(SERVICE_EVENT_INFO)),
            _field("request", ir.Sequence(ir.Ref(service.request.name), 1)),
            _field("response", ir.Sequence(ir.Ref(service.response.name), 1)),
        ),
    )


def send_goal(action: ir.Action) -> ir.Service:
    """Return the service A_SendGoal of an action."""
    name = _named(action.name, "_SendGoal")
    return ir.Service(
        name=name,
        request=ir.Message(
            name=_named(name, "_Request"),
            fields=(_field("goal_id", ir.Ref(UUID)), _field("goal", ir.Ref(action.goal.name))),
        ),
        response=ir.Message(
            name=_named(name, "_Response"),
            fields=(_field("accepted", ir.Primitive("bool")), _field("stamp", ir.Ref(TIME))),
        ),
    )


def get_result(action: ir.Action) -> ir.Service:
    """Return the service A_GetResult of an action."""
    name = _named(action.name, "_GetResult")
    return ir.Service(
        name=name,
        request=ir.Message(
            name=_named(name, "_Request"), fields=(_field("goal_id", ir.Ref(UUID)),)
        ),
        response=ir.Message(
            name=_named(name, "_Response"),
            fields=(
                _field("status", ir.Primitive("int8")),
                _field("result", ir.Ref(action.result.name)),
            ),
        ),
    )


def feedback_message(action: ir.Action) -> ir.Message:
    """Return the A_FeedbackMessage of an action."""
    return ir.Message(
        name=_named(action.name, "_FeedbackMessage"),
        fields=(
            _field("goal_id", ir.Ref(UUID)),
            _field("feedback", ir.Ref(action.feedback.name)),
        ),
    )


def composites(interface: ir.Interface) -> tuple[ir.Message, ...]:
    """Return the structures in which an action's goals, results and feedback are sent."""
    if not isinstance(interface, ir.Action):
        return ()
    send, get = send_goal(interface), get_result(interface)
    return (send.request, get.response, feedback_message(interface))


def services(interface: ir.Interface) -> tuple[ir.Service, ...]:
    """Return the services that an interface is or holds, in dependency order."""
    match interface:
        case ir.Message():
            return ()
        case ir.Service():
            return (interface,)
        case ir.Action():
            return (send_goal(interface), get_result(interface))


def messages(interface: ir.Interface) -> tuple[ir.Message, ...]:
    """Return every structure of an interface, derived ones included, in dependency order."""
    match interface:
        case ir.Message():
            return (interface,)
        case ir.Service():
            return (interface.request, interface.response, event(interface))
        case ir.Action():
            return (
                *sections(interface),
                *(part for service in services(interface) for part in messages(service)),
                feedback_message(interface),
            )


def sections(interface: ir.Interface) -> tuple[ir.Message, ...]:
    """Return the structures as written in the file, in file order."""
    match interface:
        case ir.Message():
            return (interface,)
        case ir.Service():
            return (interface.request, interface.response)
        case ir.Action():
            return (interface.goal, interface.result, interface.feedback)


def closure(names: Iterable[Node], targets: Callable[[Node], Iterable[Node]]) -> set[Node]:
    """Return names and all that they lead to, in linear time, circles or not."""
    reached: set[Node] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += targets(name)
    return reached


def references(interface: ir.Interface) -> set[ir.TypeName]:
    """Return the structures that an interface's file names as types of fields."""
    return {target for section in sections(interface) for target in section.references}


def pseudo_structures(interface: ir.Interface) -> tuple[ir.Message, ...]:
    """Return the structures that exist only in type descriptions: services and actions as such."""
    structures = [
        ir.Message(
            name=service.name,
            fields=(
                _field("request_message", ir.Ref(service.request.name)),
                _field("response_message", ir.Ref(service.response.name)),
                _field("event_message", ir.Ref(event(service).name)),
            ),
        )
        for service in services(interface)
    ]
    if isinstance(interface, ir.Action):
        structures.append(_action_structure(interface))
    return tuple(structures)


def _action_structure(action: ir.Action) -> ir.Message:
    send, result = services(action)
    return ir.Message(
        name=action.name,
        fields=(
            _field("goal", ir.Ref(action.goal.name)),
            _field("result", ir.Ref(action.result.name)),
            _field("feedback", ir.Ref(action.feedback.name)),
            _field("send_goal_service", ir.Ref(send.name)),
            _field("get_result_service", ir.Ref(result.name)),
            _field("feedback_message", ir.Ref(feedback_message(action).name)),
        ),
    )
