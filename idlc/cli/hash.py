"""`idlc hash`."""

from __future__ import annotations

import sys

import click

from idlc.cli import completion, options

EPILOG = """\
Example:

\b
  idlc hash std_msgs/msg/Header std_srvs/srv/SetBool
"""


@click.command("hash", epilog=EPILOG)
@click.argument(
    "subjects",
    metavar="PATH|TYPE...",
    nargs=-1,
    required=True,
    type=click.Path(),
    shell_complete=completion.types_and_paths,
)
@options.package
@options.include
@options.exclude
@options.distro
def command(
    subjects: tuple[str, ...],
    package: str | None,
    include: tuple[str, ...],
    exclude: tuple[str, ...],
    distro: str | None,
) -> int:
    """Print type hashes (RIHS01), derived types of services and actions included.

    TYPE is a name such as std_msgs/msg/Header, PATH a file or folder as for `idlc gen`.
    """
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.documents.show import hashes
    from idlc.project.root import Root
    from idlc.project.settings import load_settings, scope

    report = Report()
    settings = load_settings(Root.here(), report)
    if not report.had_errors:
        where = scope(settings, package, include, exclude, distro)
        for value, name in hashes(subjects, where, report):
            sys.stdout.write(f"{value}  {name}\n")
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    return output.status(report)
