"""Options that several commands have, and what pyproject.toml says instead."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, wraps
from typing import Any, TypeVar

import click
from click.core import ParameterSource

FORMATS = ("text", "json")
#: The formats of reports that CI systems read.
DOCUMENTS = ("github", "sarif", "junit", "gitlab")
REPORT_FORMATS = (*FORMATS, *DOCUMENTS)

#: Commands that write an interface, for examples.
DEMO = ("mkdir -p demo/msg", "echo 'float64 speed 0.5  # [m/s]' > demo/msg/Drive.msg")

Command = TypeVar("Command", bound=Callable[..., Any])


def completed(by: str) -> Callable[[click.Context, click.Parameter, str], Any]:
    """Return what completes words, by a function of `run/completion.py`.

    Only the completion of a shell imports that module.
    """

    def offer(context: click.Context, parameter: click.Parameter, word: str) -> Any:
        from idlc.cli.run import completion

        return getattr(completion, by)(context, parameter, word)

    return offer


def example(*lines: str, title: str = "Example") -> str:
    """Return the end of a command's help: an example of commands."""
    return "\n".join((f"{title}:\n\n\b", *(f"  {line}" for line in lines), ""))


def typed(*without: str) -> tuple[str, ...]:
    """Return the words that were typed after the command that runs, `without` these parameters."""
    context = click.get_current_context()
    arguments: list[str] = []
    words: list[str] = []
    for parameter in context.command.params:
        name = str(parameter.name)
        if context.get_parameter_source(name) is not ParameterSource.COMMANDLINE or name in without:
            continue
        value = context.params[name]
        if isinstance(parameter, click.Argument):
            arguments += (f"./{word}" if word.startswith("-") else word for word in value)
        elif value is True:
            words.append(parameter.opts[0])
        elif isinstance(default := getattr(parameter, "flag_value", None), str):
            words.append(parameter.opts[0] + ("" if value == default else f"={value}"))
        else:
            for word in value if isinstance(value, tuple) else (value,):
                words += (parameter.opts[0], word)
    return (*arguments, *words)


package = click.option(
    "--package",
    metavar="NAME",
    help="Name of the ROS 2 package.  [default: from package.xml, or the folder's name]",
)
include = click.option(
    "-I",
    "--include",
    metavar="DIR",
    multiple=True,
    type=click.Path(file_okay=False),
    help="Search this folder for types before any other. Repeatable.",
)
exclude = click.option(
    "--exclude",
    metavar="PATTERN",
    multiple=True,
    help="Exclude interface files (`msg/ros1/**`). Repeatable.",
)


def packages(command: Command) -> Command:
    """Add the options of a command that reads packages."""
    return package(include(exclude(command)))


def _single(context: click.Context, option: click.Parameter, value: str | None) -> str | None:
    if value and "," in value:
        raise click.UsageError("--distro takes one name; only `idlc check` takes several")
    return _several(context, option, value)


def _several(_: click.Context, __: click.Parameter, value: str | None) -> str | None:
    from idlc.model.distros import BY_NAME, split_names, unknown_distro

    for name in split_names(value) if value is not None else ():
        if name not in BY_NAME:
            raise click.UsageError(f"no such distribution: {name!r}; {unknown_distro(name)}")
    return value


def _distro(metavar: str, text: str, callback: Any) -> Callable[[Command], Command]:
    return click.option(
        "--distro",
        metavar=metavar,
        help=f"{text}  [default: the installed one]",
        callback=callback,
        shell_complete=completed("distros"),
    )


distro = _distro("NAME", "ROS 2 distribution, such as jazzy.", _single)
distros = _distro("NAME,...", "ROS 2 distributions in which the interfaces have to work.", _several)


def output_style(formats: Sequence[str], text: str) -> Callable[[Command], Command]:
    """Return the option --format with these names, the first of which is the default."""
    choice = click.Choice(formats)
    return click.option(
        "--format", "style", type=choice, default=formats[0], show_default=True, help=text
    )


style = output_style(FORMATS, "Output format.")
report_style = output_style(REPORT_FORMATS, "Format of the report.")


def scoped(
    *options: Callable[[Any], Any], despite_errors: bool = False
) -> Callable[[Callable[..., str | None]], Callable[..., int]]:
    """Have a command called with the `scope` that these options mean, and a `report`.

    Unless `despite_errors`, it is not called if the settings have errors. What it returns is
    written after the report.
    """

    def decorate(command: Callable[..., str | None]) -> Callable[..., int]:
        @wraps(command)
        def run(
            package: str | None = None,
            include: tuple[str, ...] = (),
            exclude: tuple[str, ...] = (),
            distro: str | None = None,
            **arguments: Any,
        ) -> int:
            from idlc.cli.run.look import in_scope

            scoping = (package, include, exclude, distro)
            return in_scope(partial(command, **arguments), scoping, despite_errors=despite_errors)

        for option in reversed(options):
            option(run)
        return run

    return decorate


def _address(_: click.Context, __: click.Parameter, value: str) -> str:
    """Refuse a word that is no address before click asks for the arguments after it."""
    from idlc.diagnostics.text import did_you_mean
    from idlc.project.files import GRAPH_HINT

    hint = GRAPH_HINT if value == "graph" else did_you_mean(value, ["dds"])
    if hint and value != "dds":
        raise click.UsageError(f"`{value}` is not an address; {hint}")
    return value


def on_robot(command: Callable[..., bool | None]) -> Callable[..., int]:
    """Have a command called with the `session` with a robot whose ADDRESS is given, and a `report`.

    `include` has the folders of -I and of the settings. The report is written after it.
    If it returns True, it failed.
    """

    @wraps(command)
    def run(address: str, include: tuple[str, ...], **arguments: Any) -> int:
        from idlc.cli.run.robots import with_session

        return with_session(partial(command, **arguments), address, include)

    return click.argument("address", metavar="ADDRESS", callback=_address)(include(run))
