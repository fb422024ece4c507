"""Asking for what a node is to do, on a terminal."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import click

from idlc.scaffold import spec

_KINDS: dict[str, tuple[spec.Role, str]] = {
    "publish": ("publisher", "Message, such as std_msgs/String"),
    "subscribe": ("subscriber", "Message, such as std_msgs/String"),
    "serve": ("service", "Service, such as std_srvs/SetBool"),
    "call": ("client", "Service, such as std_srvs/SetBool"),
    "act": ("action_server", "Action, such as Countdown"),
    "send goals": ("action_client", "Action, such as Countdown"),
}
_NAMES = {"msg": "Topic", "srv": "Name of the service", "action": "Name of the action"}
DONE = "done"

Answer = TypeVar("Answer")
#: Raises ValueError for an interface that there is not.
CheckType = Callable[[spec.Role, str], None]


def ask(name: str, check_type: CheckType) -> spec.Node:
    """Return the node that the answers describe; every wrong answer is asked for again at once."""
    click.echo(f"What is {name} to do?")
    choices = click.Choice([*_KINDS, "timer", "parameter", DONE])
    endpoints: list[spec.Endpoint] = []
    timers: list[float] = []
    parameters: list[spec.Parameter] = []
    while (chosen := click.prompt("It is to", type=choices, default=DONE)) != DONE:
        if chosen == "timer":
            timers.append(_answer("Every how many seconds", spec.period, "1.0"))
        elif chosen == "parameter":
            parameters.append(_answer("NAME:TYPE=DEFAULT", spec.parameter))
        else:
            endpoints.append(_endpoint(*_KINDS[chosen], check_type))
    lifecycle = click.confirm("Is it a lifecycle node", default=False)
    return spec.Node(name, "", tuple(endpoints), tuple(timers), tuple(parameters), lifecycle)


def _answer(
    question: str, understand: Callable[[str], Answer], default: str | None = None
) -> Answer:
    """Ask until the answer can be understood; return what it means."""

    def process(text: str) -> Answer:
        try:
            return understand(text)
        except ValueError as error:
            raise click.BadParameter(str(error)) from error

    answer: Answer = click.prompt(question, default=default, value_proc=process)
    return answer


def _endpoint(role: spec.Role, question: str, check_type: CheckType) -> spec.Endpoint:
    def known(text: str) -> str:
        check_type(role, text)
        return text

    type_ = _answer(question, known)
    endpoint = _answer(
        _NAMES[spec.ROLES[role]], lambda name: spec.endpoint(role, f"{type_}:{name}")
    )
    if role == "publisher" and endpoint.rate is None:
        text = f"{type_}:{endpoint.topic}"
        endpoint = _answer(
            "How often a second", lambda rate: spec.endpoint(role, f"{text}@{rate}"), "1"
        )
    if spec.ROLES[role] == "msg":
        qos = click.prompt("Quality of service", type=click.Choice(spec.QOS), default=spec.QOS[0])
        endpoint = endpoint._replace(qos=qos)
    return endpoint
