"""`idlc list`."""

from __future__ import annotations

import sys

import click

from idlc.cli import complete, options

EPILOG = """\
Example:

\b
  idlc list std_msgs
"""


@click.command("list", epilog=EPILOG)
@click.argument("packages", metavar="[PACKAGE]...", nargs=-1, shell_complete=complete.packages)
@options.include
@options.style
def command(packages: tuple[str, ...], include: tuple[str, ...], style: str) -> int:
    """List the packages that are known here, or the interfaces of some.

    Known are packages below the working folder, along -I, in the ament prefixes, and the built-in
    ones of ROS 2 Jazzy.
    """
    from idlc.cli import terminal
    from idlc.driver import known
    from idlc.text.diagnostics import Report
    from idlc.text.present import counted
    from idlc.text.visible import one_line

    report = Report()
    found = [] if packages else known.packages(include, report)
    names = known.interfaces(packages, include, report) if packages else []
    if style == "json":
        for package in found:
            terminal.fact(sys.stdout, "package", **package._asdict())
        for name in names:
            terminal.fact(sys.stdout, "interface", name=name)
    else:
        width = max((len(package.name) for package in found), default=0)
        for name, number, path in found:
            where = one_line(path) if path else "built in"
            count = counted(number, "interface")
            sys.stdout.write(f"{name:{width}}  {count:>14}  {where}\n")
        sys.stdout.writelines(f"{name}\n" for name in names)
    terminal.show(report, "text", sys.stderr)
    return terminal.status(report)
