"""Commands for two versions of interfaces: `breaking` and `upgrade`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options

BREAKING_EPILOG = (
    options.example(
        "mkdir -p old/msg",
        "echo 'float64 speed 0.5  # [m/s]' > old/msg/Drive.msg",
        "cp -r old new",
        "echo 'string text' > new/msg/Note.msg",
        "idlc breaking new --against old",
    )
    + "\n"
    + options.example(
        "[[tool.idlc.breaking.allow]]",
        'at = "demo/msg/Drive.speed"',
        'reason = "all robots are updated in the same week"',
        "until = 2030-12-31",
        title="Allow an intentional change in pyproject.toml, with a reason and an end date",
    )
)


@click.command("breaking", epilog=BREAKING_EPILOG)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option(
    "--against",
    metavar="DIR|git:REF|idlc.lock|REC|distro:NAME|graph|ADDRESS",
    help="The version to compare with: a folder, a git revision, the type hashes in idlc.lock, a "
    "recording, or the standard interfaces of a distribution. For several recordings, write a "
    "pattern, such as 'bags/*.mcap'. To compare with running nodes, write the word "
    "'graph', or the address of a robot, such as tcp/robot:7447. For a folder named graph, write "
    "./graph. By default, idlc uses `against` of the settings, else git:origin/HEAD, else "
    "git:HEAD.",
)
@click.option(
    "--timeout",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="With --against graph or ADDRESS, stop waiting for nodes and replies after this time.  "
    "[default: 5]",
)
@options.packages
@options.distro
@options.report_style
def breaking_command(**arguments: Any) -> int:
    """Compare two versions of interfaces and report breaking changes.

    PATH is a file or folder with the new version. --against names the old version.

    idlc assigns one or more of these levels to each breaking change:

    \b
    wire       existing data is misread or unreadable
    hash       the type hash differs, so middleware might not deliver messages
    source     code that uses the interface fails
    behaviour  the same code behaves differently

    With --against distro:NAME, idlc compares two versions of each standard interface that PATH
    uses: the version in your distribution and the version in the distribution NAME. If neither PATH
    nor `paths` in pyproject.toml is given, it compares all standard interfaces.

    With --against REC, a recording, idlc reports changes that prevent programs with your interfaces
    from reading it. PATH can be a second recording: idlc then compares the types of the two. If
    neither PATH nor `paths` is given, it compares each recorded type with the type that `idlc list`
    finds.

    With --against graph (the nodes that run now) or ADDRESS, idlc reports each type that these
    nodes use in different versions. It also compares these versions with your files and your
    installed packages.
    """  # noqa: D301  (click needs the character, not the escape)
    from idlc.cli.run.breaking import run

    return run(**arguments)


UPGRADE_EPILOG = (
    options.example(
        "idlc upgrade rec.mcap --to distro:lyrical --diff",
        "idlc upgrade rec.mcap --to distro:lyrical -o upgraded",
    )
    + "\n"
    + options.example(
        "idlc upgrade 'bags/*.mcap' --to my_msgs --write-rules my_msgs/upgrade",
        "idlc upgrade 'bags/*.mcap' --to my_msgs --rules my_msgs/upgrade -o upgraded",
        title="Write rules for renamed fields, edit them, and run them",
    )
)


@click.command("upgrade", epilog=UPGRADE_EPILOG)
@click.argument(
    "paths",
    metavar="REC... [TOPIC]...",
    nargs=-1,
    required=True,
    type=click.Path(),
    shell_complete=options.completed("topics_and_paths"),
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
def upgrade_command(**arguments: Any) -> int:
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


MEMBERS = (breaking_command, upgrade_command)
