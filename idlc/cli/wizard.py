"""Asking for what a node is to do, on a terminal."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import click

from idlc.model import ir
from idlc.scaffold import qos, spec
from idlc.scaffold.roles import ROLES
from idlc.scaffold.roles.role import Endpoint, Role

DONE = "done"
PARAMETER = "parameter"
#: For each kind of interface: the question for the type, and that for the name.
_QUESTIONS: dict[ir.Kind, tuple[str, str]] = {
    "msg": ("Message type, such as std_msgs/String", "Topic"),
    "srv": ("Service type, such as std_srvs/SetBool", "Service name"),
    "action": ("Action type, such as Countdown", "Action name"),
}

Answer = TypeVar("Answer")
#: Raises ValueError for an interface that there is not.
CheckType = Callable[[Role, str], None]


def ask(name: str, check_type: CheckType) -> spec.Node:
    """Return the node that the answers describe; every wrong answer is asked for again at once."""
    click.echo(f"What should {name} do?")
    roles = {role.answer: role for role in ROLES}
    choices = click.Choice([*roles, PARAMETER, DONE])
    endpoints: list[Endpoint] = []
    parameters: list[spec.Parameter] = []
    while (chosen := click.prompt(f"Add ({DONE} to finish)", type=choices, default=DONE)) != DONE:
        if chosen == PARAMETER:
            parameters.append(_answer("Parameter as NAME:TYPE=DEFAULT", spec.parameter))
        else:
            endpoints.append(_endpoint(roles[chosen], check_type))
    lifecycle = click.confirm("Make it a lifecycle node?", default=False, prompt_suffix=" ")
    return spec.Node(name, "", spec.in_order(endpoints), tuple(parameters), lifecycle)


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


def _endpoint(role: Role, check_type: CheckType) -> Endpoint:
    """Ask for what the value of the role's option says."""

    def known(text: str) -> str:
        check_type(role, text)
        return text

    def checked(value: str) -> str:
        spec.endpoint(role, value)
        return value

    value = ""
    if role.kind:
        type_question, name_question = _QUESTIONS[role.kind]
        type_ = _answer(type_question, known)
        value = _answer(name_question, lambda name: checked(f"{type_}:{name}"))
    question = role.question
    if question and not (question.separator and question.separator in value):
        head = f"{value}{question.separator}"
        value = _answer(question.text, lambda answer: checked(f"{head}{answer}"), question.default)
    if role.kind != "msg":
        return spec.endpoint(role, value)
    preset = click.prompt(
        "Quality of service", type=click.Choice(qos.NAMES), default=qos.DEFAULT.name
    )
    return spec.endpoint(role, value, preset)
