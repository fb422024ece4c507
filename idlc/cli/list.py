"""`idlc list`."""

from __future__ import annotations

import sys

import click

from idlc.cli import completion, options

EPILOG = """\
Example:

\b
  idlc list std_msgs
"""


@click.command("list", epilog=EPILOG)
@click.argument("packages", metavar="[PACKAGE]...", nargs=-1, shell_complete=completion.packages)
@options.include
@options.distro
@options.style
def command(
    packages: tuple[str, ...], include: tuple[str, ...], distro: str | None, style: str
) -> int:
    """List the packages that are known here, or the interfaces of some.

    Known are packages below the working folder, along -I, in the ament prefixes, and the standard
    ones of a distribution, which are built in.
    """
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.diagnostics.terminal import counted
    from idlc.diagnostics.text import one_line
    from idlc.project import library
    from idlc.project.root import Root
    from idlc.project.settings import load_settings, scope

    report = Report()
    where = scope(load_settings(Root.here(), report), include=include, distro=distro)
    listed = [] if packages else library.packages(where, report)
    names = library.interfaces(packages, where, report) if packages else []
    if style == "json":
        for package in listed:
            output.fact(sys.stdout, "package", **package._asdict())
        for name in names:
            output.fact(sys.stdout, "interface", name=name)
    else:
        width = max((len(package.name) for package in listed), default=0)
        for name, number, path in listed:
            place = one_line(path) if path else "built in"
            count = counted(number, "interface")
            sys.stdout.write(f"{name:{width}}  {count:>14}  {place}\n")
        sys.stdout.writelines(f"{name}\n" for name in names)
    output.show(report, "text", sys.stderr)
    return output.status(report)
