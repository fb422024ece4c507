"""`idlc breaking`."""

from __future__ import annotations

import click

from idlc.cli import options

EPILOG = """\
Example:

\b
  mkdir -p old/msg new/msg
  echo 'float64 speed 0.5  # [m/s]' > old/msg/Drive.msg
  echo 'float64 speed 0.7  # [m/s]' > new/msg/Drive.msg
  idlc breaking new --against old --level hash

A change that is meant is allowed in pyproject.toml, with a reason and for a time:

\b
  [[tool.idlc.breaking.allow]]
  at = "demo/msg/Drive.speed"
  reason = "all robots are updated in the same week"
  until = 2030-12-31
"""

LEVELS = ("wire", "hash", "source", "behaviour")


@click.command("breaking", epilog=EPILOG)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option(
    "--against",
    metavar="DIR|git:REF|idlc.lock|REC|distro:NAME|graph",
    help="The version to compare with: a folder, a git revision, the type hashes in a lock, "
    "recordings (a pattern such as 'bags/*.mcap' means several), the standard interfaces of a "
    "distribution, or what the nodes of the running ROS 2 graph use (a folder of that name is "
    "./graph).",
)
@click.option(
    "--timeout",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="How long to wait for news from the graph, and for its nodes' answers.  [default: 5]",
)
@click.option(
    "--level",
    "levels",
    multiple=True,
    type=click.Choice(LEVELS),
    help="Only report what breaks this. May be repeated; otherwise all, or against recordings what "
    "readers of them would notice.",
)
@options.package
@options.include
@options.exclude
@options.distro
@options.report_style
def command(
    paths: tuple[str, ...],
    against: str | None,
    timeout: float | None,
    levels: tuple[str, ...],
    package: str | None,
    include: tuple[str, ...],
    exclude: tuple[str, ...],
    distro: str | None,
    style: str,
) -> int:
    """Report what a new version of interfaces breaks, and for whom.

    wire: bytes recorded before are read wrongly or not at all. hash: the middleware may not
    deliver messages between both versions. source: code fails. behaviour: the same code does
    something else.

    With distro:NAME, the standard interfaces that PATH uses are compared with that
    distribution's, or all of them if there is no PATH.

    Against recordings, the question is whether they can still be read: interfaces of PATH that
    were recorded are compared, or without PATH all that are known here.

    Against the graph, it reports the types of which running nodes have several versions, or
    another one than the files here or the installed packages.
    """
    from idlc.cli.breaking_run import BreakingWishes, compare

    typed = BreakingWishes(
        paths, against, timeout, levels, package, include, exclude, distro, style
    )
    return compare(typed)
