"""`idlc list`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.project.settings import Scope


@click.command("list", epilog=options.example("idlc list std_msgs"))
@click.argument("packages", metavar="[PACKAGE]...", nargs=-1, shell_complete=completion.packages)
@options.scoped(options.include, options.distro)
@options.style
def command(packages: tuple[str, ...], style: str, scope: Scope, report: Report) -> None:
    """List the packages that idlc can find, or the interfaces in each PACKAGE.

    idlc searches the working folder, the -I folders and the ament prefixes. It also contains the
    standard packages of each distribution.
    """
    from idlc.cli import output
    from idlc.diagnostics.terminal import counted
    from idlc.diagnostics.text import one_line
    from idlc.project import library

    listed = [] if packages else library.packages(scope, report)
    names = library.interfaces(packages, scope, report) if packages else []
    if style == "json":
        for package in listed:
            output.fact(sys.stdout, "package", **package._asdict())
        for name in names:
            output.fact(sys.stdout, "interface", name=name)
        return
    paint = output.painter(sys.stdout)
    width = max((len(package.name) for package in listed), default=0)
    for name, number, path in listed:
        place = one_line(path) if path else "built in"
        head = f"{paint('type', name)}{' ' * (width - len(name))}"
        sys.stdout.write(f"{head}  {counted(number, 'interface'):>14}  {place}\n")
    sys.stdout.writelines(f"{name}\n" for name in names)
