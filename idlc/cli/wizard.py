"""Asking for what a node is to do, on a terminal."""

from __future__ import annotations

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
DONE = "done"


def ask(name: str) -> spec.Node:
    """Return the node that the answers describe; every wrong answer is asked for again."""
    click.echo(f"What is {name} to do?")
    choices = click.Choice([*_KINDS, "timer", "parameter", DONE])
    endpoints: list[spec.Endpoint] = []
    timers: list[float] = []
    parameters: list[spec.Parameter] = []
    while (chosen := click.prompt("It is to", type=choices, default=DONE)) != DONE:
        try:
            if chosen == "timer":
                timers.append(spec.period(click.prompt("Every how many seconds", default="1.0")))
            elif chosen == "parameter":
                parameters.append(spec.parameter(click.prompt("NAME:TYPE=DEFAULT")))
            else:
                endpoints.append(_endpoint(*_KINDS[chosen]))
        except ValueError as error:
            click.echo(f"{error}")
    lifecycle = click.confirm("Is it a lifecycle node", default=False)
    return spec.Node(name, "", tuple(endpoints), tuple(timers), tuple(parameters), lifecycle)


def _endpoint(role: spec.Role, question: str) -> spec.Endpoint:
    type_ = click.prompt(question)
    what = {"msg": "Topic", "srv": "Name of the service", "action": "Name of the action"}
    text = f"{type_}:{click.prompt(what[spec.ROLES[role]])}"
    if role == "publisher":
        text += f"@{click.prompt('How often a second', default='1')}"
    if spec.ROLES[role] == "msg":
        qos = click.prompt("Quality of service", type=click.Choice(spec.QOS), default=spec.QOS[0])
        text += f"{spec.QOS_MARK}{qos}"
    return spec.endpoint(role, text)
