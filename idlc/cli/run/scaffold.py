"""`idlc scaffold package`, `interface` and `node`."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

from idlc.cli import output
from idlc.diagnostics.report import Report, ReportedError
from idlc.diagnostics.terminal import summary
from idlc.model import ir
from idlc.model.ir import KINDS
from idlc.project.git import setting
from idlc.project.root import Root
from idlc.scaffold import spec
from idlc.scaffold.changes import ScaffoldOptions, ScaffoldResult, check
from idlc.scaffold.interface import check_interface_name, interface, interface_text, starter
from idlc.scaffold.new_node import node
from idlc.scaffold.package import LICENSES, Package, check_package_name, package
from idlc.scaffold.roles import DEFAULT_QOS, QOS_NAMES, ROLES, EndpointSpec, Role


def _finish(result: ScaffoldResult | None, report: Report, hints: tuple[str, ...] = ()) -> int:
    """Show the outcome of a command and return the exit status; `hints` are the next commands."""
    output.show(report, "text", sys.stderr)
    if result is None:
        sys.stderr.write(f"{summary(report)}; nothing was written\n")
        return output.status(report)
    if result.diff:
        sys.stdout.writelines(result.diff)
        return output.status(report)
    folder = "" if result.folder in ("", ".") else f"{result.folder}/"
    changes = [done for done in result.done if done.what != "unchanged"]
    sys.stdout.writelines(f"{done.what} {folder}{done.path}\n" for done in changes)
    if not changes:
        sys.stdout.write("nothing to do\n")
    sys.stdout.writelines(f"note: {note}\n" for note in result.notes)
    if changes:
        if result.following:
            hints = (shlex.join([*output.program().split(), *result.following]), *hints)
        sys.stdout.writelines(f"next: {hint}\n" for hint in hints)
    return output.status(report)


def new_package(
    name: str,
    starters: tuple[str, ...],
    interfaces_only: bool,
    **arguments: Any,
) -> int:
    """Create a package and return the exit status."""
    if starters and not interfaces_only:
        raise click.UsageError("INTERFACE needs --interfaces")
    try:
        check_package_name(name)
        examples = dict(map(starter, (starters or ("Example",)) if interfaces_only else ()))
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    report, root = Report(), Root.here()
    build_type = "ament_cmake" if interfaces_only else "ament_python"
    maintainer, _, email = arguments["maintainer"].partition("<")
    arguments |= {"maintainer": maintainer.strip(), "email": email.strip(" >")}
    requested = _requested(name, arguments, build_type, root)
    shared = {key: arguments[key] for key in ("dry_run", "force", "include")}
    chosen = {"license" if key == "licence" else key for key, value in arguments.items() if value}
    chosen |= {"starters"} if starters else set()
    result = None
    with suppress(ReportedError):
        result = package(requested, ScaffoldOptions(root, **shared), report, examples, chosen)
    example = f"{output.program()} scaffold interface msg Status 'float32 battery'"
    return _finish(result, report, (f"cd {name}", example))


def _requested(name: str, arguments: dict[str, Any], build_type: str, root: Root) -> Package:
    """Return the package with the defaults for what was not set."""
    return Package(
        name,
        f"The package {name}.",
        arguments["maintainer"] or setting("user.name", root.base) or "Your Name",
        arguments["email"] or setting("user.email", root.base) or "you@example.com",
        arguments["licence"] or LICENSES[0],
        build_type,
    )


def new_interface(
    kind: str,
    name: str,
    fields: tuple[str, ...],
    include: tuple[str, ...],
    **arguments: Any,
) -> int:
    """Create an interface and return the exit status."""
    report = Report()
    try:
        check_interface_name(name)
        interface_text(kind, fields)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    settings = ScaffoldOptions(Root.here(), include=include, **arguments)
    checked_kind = KINDS[KINDS.index(kind)]
    result = None
    with suppress(ReportedError):
        result = interface(checked_kind, name, fields, settings, report)
    return _finish(result, report)


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


def ask(name: str, check_type: CheckType) -> spec.NodeSpec:
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
    endpoints: list[EndpointSpec] = []
    parameters: list[spec.ParameterSpec] = []
    while (chosen := ask_next()) != DONE:
        chosen = numbers.get(chosen, chosen)
        if chosen == PARAMETER:
            answer = _answer("Parameter as NAME:TYPE=DEFAULT", spec.parameter)
            parameters.append(spec.parameter(answer))
        else:
            endpoints.append(_endpoint(roles[chosen], check_type))
    lifecycle = click.confirm("Lifecycle node?", default=False, prompt_suffix=" ")
    endpoints.sort(key=lambda endpoint: ROLES.index(endpoint.role))
    return spec.NodeSpec(name, "", tuple(endpoints), tuple(parameters), lifecycle)


def _answer(question: str, check: Callable[[str], object], default: str | None = None) -> str:
    """Ask until the answer is valid, for which `check` raises no ValueError."""

    def process(text: str) -> str:
        try:
            check(text)
        except ValueError as error:
            raise click.BadParameter(str(error)) from error
        return text

    return str(click.prompt(question, default=default, value_proc=process))


def _endpoint(role: Role, check_type: CheckType) -> EndpointSpec:
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


def interactive() -> bool:
    """Return whether standard input and output are terminals."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def new_node(name: str, owners: Sequence[tuple[str, int]], **arguments: Any) -> int:
    """Create a node and return the exit status; `owners` are the roles of the --qos options."""
    shared = ("dry_run", "force", "include")
    settings = ScaffoldOptions(Root.here(), **{key: arguments[key] for key in shared})
    described = (*(role.name for role in ROLES), "parameters", "lifecycle", "robust")
    try:
        spec.check_name(name)
        if not any(arguments[option] for option in described) and interactive():
            requested = ask(name, lambda role, type_: check(role, type_, settings))
        else:
            presets = dict(zip(owners, arguments["qos"], strict=True))
            endpoints = (
                spec.endpoint(role, value, presets.get((role.name, n)))
                for role in ROLES
                for n, value in enumerate(arguments[role.name])
            )
            parameters = tuple(map(spec.parameter, arguments["parameters"]))
            forms = arguments["lifecycle"], arguments["robust"]
            requested = spec.NodeSpec(name, "", tuple(endpoints), parameters, *forms)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    report = Report()
    result = None
    with suppress(ReportedError):
        result = node(requested, settings, report)
    folder = "" if result is None or result.folder == "." else f"{result.folder}/"
    python = Path(sys.executable).name
    install = () if find_spec("pytest") else (f"{python} -m pip install pytest",)
    done = () if result is None else result.done
    paths = [each.path for each in done if each.path.endswith(f"/test_{name}.py")]
    test = f"{python} -m pytest {folder}{next(iter(paths), '')}"
    return _finish(result, report, (*install, test))
