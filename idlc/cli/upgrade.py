"""`idlc upgrade`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import completion, options

EPILOG = options.example(
    "idlc upgrade rec.mcap --to distro:lyrical --diff",
    "idlc upgrade rec.mcap --to distro:lyrical -o upgraded",
)


EPILOG += "\n" + options.example(
    "idlc upgrade 'bags/*.mcap' --to my_msgs --write-rules my_msgs/upgrade",
    "idlc upgrade 'bags/*.mcap' --to my_msgs --rules my_msgs/upgrade -o upgraded",
    title="Write rules for renamed fields, edit them, and run them",
)


@click.command("upgrade", epilog=EPILOG)
@click.argument(
    "paths",
    metavar="REC... [TOPIC]...",
    nargs=-1,
    required=True,
    type=click.Path(),
    shell_complete=completion.topics_and_paths,
)
@click.option(
    "-o",
    "--out",
    metavar="DIR",
    type=click.Path(),
    help="The folder to write the new recordings to. idlc does not change the original recordings.",
)
@click.option(
    "--to",
    metavar="PATH|REC|git:REF|distro:NAME",
    help="The types to upgrade to: a package folder, another recording, a git revision, or the "
    "standard interfaces of a distribution. By default, idlc takes types that `idlc list` finds.",
)
@click.option(
    "--from",
    "old",
    metavar="PATH|REC|git:REF|distro:NAME",
    help="The old types, for recordings that do not contain their definitions, such as .db3 files "
    "of Humble.",
)
@click.option(
    "--rules",
    metavar="PATH",
    multiple=True,
    type=click.Path(),
    help="Run the rules in this Python file or folder. Repeatable.",
)
@click.option(
    "--write-rules",
    metavar="DIR",
    type=click.Path(),
    help="Write a Python file with a function for each field that needs a rule.",
)
@click.option(
    "--diff",
    "dry_run",
    is_flag=True,
    help="Write nothing; show how idlc converts each changed field.",
)
@click.option(
    "--allow-loss",
    is_flag=True,
    help="Accept that a type was removed: copy its messages unchanged, under the old type. Without "
    "this option, idlc reports an error.",
)
@click.option("--strict", is_flag=True, help="Refuse a damaged recording.")
@options.packages
@options.distro
@options.style
def command(**arguments: Any) -> int:
    """Convert recordings to the current versions of their types.

    REC is an .mcap or .db3 file, a bag folder, or a pattern such as 'drive_*.mcap'. With TOPIC,
    idlc upgrades only these topics.

    idlc compares the recorded definitions with the new ones. Added fields get their defaults,
    removed fields are dropped, and a number is converted if its new type can hold each value of the
    old type. Other changes need a rule: a Python function that returns the value of the new field.

    --package, -I, --exclude and --distro are about the new types.
    """
    from idlc.cli.run.upgrade import run

    return run(**arguments)
