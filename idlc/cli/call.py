"""`idlc call`."""

from __future__ import annotations

import sys

import click

from idlc.cli import completion, options


@click.command(
    "call", epilog=options.example("idlc call tcp/robot:7447 /add_two_ints a=1 b=2 --format json")
)
@click.argument("address", metavar="ADDRESS")
@click.argument("service", metavar="SERVICE", shell_complete=completion.robot_services)
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
def command(address: str, service: str, values: tuple[str, ...], timeout: float, style: str) -> int:
    """Call a service of a robot and print the response.

    ADDRESS is the endpoint of the robot's Zenoh router, such as tcp/robot:7447. FIELD=VALUE sets a
    field of the request: write `goal.x=1.5`, for example. Write lists and messages as JSON, such as
    `ids=[1,2]`. Other fields have their default values. idlc checks all values before it sends the
    request.
    """
    from idlc.cli import output
    from idlc.diagnostics import codes
    from idlc.diagnostics.report import Report
    from idlc.robot.keys import Kind
    from idlc.robot.live import traffic
    from idlc.robot.live.connect import connected, find_endpoints

    report = Report()
    with connected(address, report) as session:
        ends = find_endpoints(session, service, (Kind.SERVICE,), report) if session else []
        end = traffic.version_of(ends, report)[0] if ends else None
        kind = traffic.interface_class(session, address, end, report) if session and end else None
        if session and end and kind:
            try:
                request = traffic.request_of(kind.Request, values)
            except traffic.FieldError as error:
                message, _, hint = str(error).partition("; ")
                output.usage_error(message, hint or f"the request is a {end.type}_Request")
                return 2
            payload = traffic.call(session, end, request, timeout)
            if payload is None:
                message = f"`{end.name}` of `{end.node_name}` did not respond"
                hint = f"idlc waited {timeout:g} s; raise --timeout"
                report.add(codes.NO_ANSWER.of("", message, hint=hint))
            else:
                try:
                    response = kind.Response.deserialize(payload)
                    text = traffic.formatter(style, kind.Response)(response)
                    output.lines(text.removesuffix(traffic.BETWEEN), sys.stdout)
                except ValueError as error:
                    message = f"`{end.name}` sent a malformed response: {error}"
                    report.add(codes.NO_ANSWER.of("", message))
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)
