"""`idlc scaffold node`."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

from idlc.cli import completion
from idlc.cli.scaffold import common, finish
from idlc.model import ir
from idlc.scaffold import spec
from idlc.scaffold.roles import DEFAULT_QOS, QOS_NAMES, ROLES, Endpoint, Role

DONE = "done"
PARAMETER = "parameter"
#: For each kind of interface: the question for the type, and that for the name.
_QUESTIONS: dict[ir.Kind, tuple[str, str]] = {
    "msg": ("Message type, such as std_msgs/String", "Topic"),
    "srv": ("Service type, such as std_srvs/SetBool", "Service name"),
    "action": ("Action type, such as Countdown", "Action name"),
}

#: Raises ValueError for an interface that does not exist.
CheckType = Callable[[Role, str], None]


def ask(name: str, check_type: CheckType) -> spec.Node:
    """Return the node that the answers describe; every wrong answer is asked for again at once."""
    roles = {role.answer: role for role in ROLES}
    numbers = {str(number): answer for number, answer in enumerate((*roles, PARAMETER), start=1)}
    listed = "".join(f"\n  {number}  {answer}" for number, answer in numbers.items())
    click.echo(f"What should {name} do?{listed}")
    question = f"Add (1-{len(numbers)}, Enter to finish)"
    choices = click.Choice([*numbers, *numbers.values(), DONE])
    ask_next = partial(
        click.prompt, question, default=DONE, type=choices, show_choices=False, show_default=False
    )
    endpoints: list[Endpoint] = []
    parameters: list[spec.Parameter] = []
    while (chosen := ask_next()) != DONE:
        chosen = numbers.get(chosen, chosen)
        if chosen == PARAMETER:
            answer = _answer("Parameter as NAME:TYPE=DEFAULT", spec.parameter)
            parameters.append(spec.parameter(answer))
        else:
            endpoints.append(_endpoint(roles[chosen], check_type))
    lifecycle = click.confirm("Lifecycle node?", default=False, prompt_suffix=" ")
    endpoints.sort(key=lambda endpoint: ROLES.index(endpoint.role))
    return spec.Node(name, "", tuple(endpoints), tuple(parameters), lifecycle)


def _answer(question: str, check: Callable[[str], object], default: str | None = None) -> str:
    """Ask until the answer is valid, for which `check` raises no ValueError."""

    def process(text: str) -> str:
        try:
            check(text)
        except ValueError as error:
            raise click.BadParameter(str(error)) from error
        return text

    return str(click.prompt(question, default=default, value_proc=process))


def _endpoint(role: Role, check_type: CheckType) -> Endpoint:
    """Ask for the value of the role's option."""
    value = ""
    if role.kind:
        type_question, name_question = _QUESTIONS[role.kind]
        type_ = _answer(type_question, lambda text: check_type(role, text))
        name = _answer(name_question, lambda text: spec.endpoint(role, f"{type_}:{text}"))
        value = f"{type_}:{name}"
    question = role.question
    if question and not (question.separator and question.separator in value):
        start = f"{value}{question.separator}"
        value = start + _answer(
            question.text, lambda text: spec.endpoint(role, start + text), question.default
        )
    if role.kind != "msg":
        return spec.endpoint(role, value)
    presets = click.Choice(QOS_NAMES)
    preset = click.prompt("Quality of service", type=presets, default=DEFAULT_QOS.name)
    return spec.endpoint(role, value, preset)


EPILOG = """\
TYPE is an interface in your package (RobotCommand) or in another package (std_msgs/String). If you
give no endpoints on a terminal, idlc asks for them.

Example, within a package:

\b
  idlc scaffold node talker --publisher std_msgs/String:chatter@2 --qos latched
  idlc scaffold node listener --subscriber std_msgs/String:chatter --param verbose:bool=true
"""


def interactive() -> bool:
    """Return whether standard input and output are terminals."""
    return sys.stdin.isatty() and sys.stdout.isatty()


class NodeCommand(click.Command):
    """A command whose --qos belongs to the endpoint before it."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Assign each quality of service to its endpoint, then parse as usual."""
        if not ctx.resilient_parsing:
            names = {role.name for role in ROLES if role.kind}
            counts: Counter[str] = Counter()
            last: tuple[str, int] | None = None
            owners = ctx.meta[_OWNERS] = []
            _, _, order = self.make_parser(ctx).parse_args(args=list(args))
            for name in (parameter.name or "" for parameter in order):
                if name in names:
                    last = (name, counts[name])
                    counts[name] += 1
                elif name == "qos":
                    if last is None:
                        raise click.UsageError("--qos must follow its endpoint", ctx)
                    owners.append(last)
        return super().parse_args(ctx, args)


#: The key of the endpoints with a --qos in the context: for each, its role and its index.
_OWNERS = "idlc.qos"


def _presets(arguments: Mapping[str, Any]) -> dict[tuple[str, int], str]:
    owners = click.get_current_context().meta[_OWNERS]
    return dict(zip(owners, arguments["qos"], strict=True))


def _role_options(function: Any) -> Any:
    for role in reversed(ROLES):
        function = click.option(
            role.option,
            role.name,
            metavar=role.metavar,
            multiple=True,
            shell_complete=completion.endpoint if role.kind else None,
            help=role.help,
        )(function)
    return function


@click.command("node", cls=NodeCommand, epilog=EPILOG)
@click.argument("name", metavar="NAME")
@_role_options
@click.option(
    "--param", "parameters", metavar="NAME:TYPE=DEFAULT", multiple=True, help="Declare a parameter."
)
@click.option(
    "--qos",
    "qos",
    metavar="|".join(QOS_NAMES),
    multiple=True,
    shell_complete=lambda _, __, word: [name for name in QOS_NAMES if name.startswith(word)],
    help="Set the quality of service of the preceding endpoint.",
)
@click.option("--lifecycle", is_flag=True, help="Create a lifecycle node.")
@click.option(
    "--robust",
    is_flag=True,
    help="Handle signals while starting, replaced and cancelled goals, servers that do not answer.",
)
@common
def command(name: str, **arguments: Any) -> int:
    """Create a node in the package that contains the working folder.

    idlc writes the module and a test. It adds the command to setup.py and the dependencies to
    package.xml. It also adds the node to the launch file, unless the node performs a single task
    and exits.
    """
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
    from idlc.scaffold import changes, new_node

    shared = ("dry_run", "force", "include")
    settings = changes.Settings(Root.here(), **{key: arguments[key] for key in shared})
    described = (*(role.name for role in ROLES), "parameters", "lifecycle", "robust")
    try:
        spec.check_name(name)
        if not any(arguments[option] for option in described) and interactive():
            requested = ask(name, lambda role, type_: changes.check(role, type_, settings))
        else:
            presets = _presets(arguments)
            endpoints = (
                spec.endpoint(role, value, presets.get((role.name, n)))
                for role in ROLES
                for n, value in enumerate(arguments[role.name])
            )
            parameters = tuple(map(spec.parameter, arguments["parameters"]))
            forms = arguments["lifecycle"], arguments["robust"]
            requested = spec.Node(name, "", tuple(endpoints), parameters, *forms)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    report = Report()
    result = new_node.node(requested, settings, report)
    folder = "" if result is None or result.folder == "." else f"{result.folder}/"
    python = Path(sys.executable).name
    install = () if find_spec("pytest") else (f"{python} -m pip install pytest",)
    done = () if result is None else result.done
    paths = [each.path for each in done if each.path.endswith(f"/test_{name}.py")]
    test = f"{python} -m pytest {folder}{next(iter(paths), '')}"
    return finish(result, report, (*install, test))
