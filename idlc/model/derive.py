"""The structures that services and actions imply, built in one place (language 5)."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import TypeVar

from idlc.model import ir

_Node = TypeVar("_Node", bound=Hashable)

SERVICE_EVENT_INFO = ir.TypeName("service_msgs", "msg", "ServiceEventInfo")
UUID = ir.TypeName("unique_identifier_msgs", "msg", "UUID")
TIME = ir.TypeName("builtin_interfaces", "msg", "Time")

#: What clients and servers of all actions use.
ACTION_PROTOCOL = frozenset(
    map(ir.TypeName.parse, ("action_msgs/srv/CancelGoal", "action_msgs/msg/GoalStatusArray"))
)

#: Packages that each kind of file needs beside the types that it names.
IMPLICIT_PACKAGES: dict[ir.Kind, tuple[str, ...]] = {
    "msg": (),
    "srv": ("service_msgs",),
    "action": ("service_msgs", "action_msgs"),
}


def _message(parent: ir.TypeName, suffix: str, **types: ir.FieldType) -> ir.Message:
    """Return the message of a derived name with these fields."""
    fields = tuple(ir.Field(name=name, type=type_) for name, type_ in types.items())
    return ir.Message(name=parent._replace(name=parent.name + suffix), fields=fields)


def event(service: ir.Service) -> ir.Message:
    """Return the X_Event message of a service, which service introspection publishes."""
    return _message(
        service.name,
        "_Event",
        info=ir.Ref(SERVICE_EVENT_INFO),
        request=ir.Sequence(ir.Ref(service.request.name), 1),
        response=ir.Sequence(ir.Ref(service.response.name), 1),
    )


def _send_goal(action: ir.Action) -> ir.Service:
    name = action.name._replace(name=f"{action.name.name}_SendGoal")
    return ir.Service(
        name=name,
        request=_message(name, "_Request", goal_id=ir.Ref(UUID), goal=ir.Ref(action.goal.name)),
        response=_message(name, "_Response", accepted=ir.Primitive("bool"), stamp=ir.Ref(TIME)),
    )


def _get_result(action: ir.Action) -> ir.Service:
    name = action.name._replace(name=f"{action.name.name}_GetResult")
    status, result = ir.Primitive("int8"), ir.Ref(action.result.name)
    return ir.Service(
        name=name,
        request=_message(name, "_Request", goal_id=ir.Ref(UUID)),
        response=_message(name, "_Response", status=status, result=result),
    )


def feedback_message(action: ir.Action) -> ir.Message:
    """Return the A_FeedbackMessage of an action."""
    goal_id, feedback = ir.Ref(UUID), ir.Ref(action.feedback.name)
    return _message(action.name, "_FeedbackMessage", goal_id=goal_id, feedback=feedback)


def composites(interface: ir.Interface) -> tuple[ir.Message, ...]:
    """Return the structures in which an action's goals, results and feedback are sent."""
    if not isinstance(interface, ir.Action):
        return ()
    send, get = services(interface)
    return (send.request, get.response, feedback_message(interface))


def services(interface: ir.Interface) -> tuple[ir.Service, ...]:
    """Return the services that an interface is or holds, in dependency order."""
    match interface:
        case ir.Message():
            return ()
        case ir.Service():
            return (interface,)
        case ir.Action():
            return (_send_goal(interface), _get_result(interface))


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


def closure(names: Iterable[_Node], targets: Callable[[_Node], Iterable[_Node]]) -> set[_Node]:
    """Return names and all that they lead to, in linear time, circles or not."""
    reached: set[_Node] = set()
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


def structures(interface: ir.Interface) -> tuple[ir.Message, ...]:
    """Return all structures, those included that exist only in type descriptions.

    These are services and actions as such.
    """
    described = [
        _message(
            service.name,
            "",
            request_message=ir.Ref(service.request.name),
            response_message=ir.Ref(service.response.name),
            event_message=ir.Ref(event(service).name),
        )
        for service in services(interface)
    ]
    if isinstance(interface, ir.Action):
        send, get = services(interface)
        described.append(
            _message(
                interface.name,
                "",
                goal=ir.Ref(interface.goal.name),
                result=ir.Ref(interface.result.name),
                feedback=ir.Ref(interface.feedback.name),
                send_goal_service=ir.Ref(send.name),
                get_result_service=ir.Ref(get.name),
                feedback_message=ir.Ref(feedback_message(interface).name),
            )
        )
    return (*messages(interface), *described)
