"""`idlc call`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.robot.session import Session


@click.command(
    "call", epilog=options.example("idlc call tcp/robot:7447 /add_two_ints a=1 b=2 --format json")
)
@options.on_robot
@click.argument("service", metavar="SERVICE", shell_complete=completion.robot_names)
@click.argument(
    "values", metavar="[FIELD=VALUE]...", nargs=-1, shell_complete=completion.robot_fields
)
@click.option(
    "--timeout",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    default=10.0,
    show_default=True,
    help="Stop waiting for the response after this time.",
)
@options.output_style(("yaml", "json"), "Output format: YAML, or one JSON object.")
def command(
    service: str,
    values: tuple[str, ...],
    timeout: float,
    style: str,
    session: Session,
    report: Report,
    include: tuple[str, ...],
) -> None:
    """Call a service of a robot and print the response.

    ADDRESS is `dds`, or the endpoint of the robot's Zenoh router, such as tcp/robot:7447.
    FIELD=VALUE sets a field of the request: write `goal.x=1.5`, for example. Write lists and
    messages as JSON, such as `ids=[1,2]`. Other fields have their default values. idlc checks all
    values before it sends the request.
    """
    from idlc.cli import messages, output
    from idlc.diagnostics import codes
    from idlc.robot.keys import Kind
    from idlc.robot.live import connect, traffic

    kind, ends = traffic.find_version(session, service, [Kind.SERVICE], report, include)
    if kind is None:
        return
    request = messages.message_of(kind.Request, values)
    replies = connect.call(session, [(ends[0], request)], timeout)
    _, payload = next(replies, (0, None))
    if payload is None:
        message = f"`{ends[0].name}` of `{ends[0].node_name}` did not respond"
        hint = f"idlc waited {timeout:g} s; raise --timeout"
        report.add(codes.NO_ANSWER.of("", message, hint=hint))
        return
    try:
        text = "".join(messages.texts(style, [kind.Response.deserialize(payload).to_dict()]))
        output.lines(text.removesuffix(messages.BETWEEN), style, sys.stdout)
    except ValueError as error:
        message = f"`{ends[0].name}` sent a malformed response: {error}"
        report.add(codes.NO_ANSWER.of("", message))
