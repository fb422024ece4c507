"""`idlc scaffold package`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from idlc.cli import options
from idlc.cli.scaffold import common, finish

if TYPE_CHECKING:
    from idlc.project.root import Root
    from idlc.scaffold.package import Package

EPILOG = options.example(
    "idlc scaffold package my_robot --maintainer 'Ada <ada@example.com>'",
    "idlc scaffold package --interfaces my_msgs Drive srv/Ask",
    title="Examples",
)
LICENSES = ("Apache-2.0", "BSD-3-Clause", "MIT")


@click.command("package", epilog=EPILOG)
@click.argument("name", metavar="NAME")
@click.argument("starters", metavar="[INTERFACE]...", nargs=-1)
@click.option(
    "--maintainer",
    metavar="'NAME <EMAIL>'",
    default="",
    help="Maintainer of the package.  [default: git's user.name and user.email]",
)
@click.option("--license", "licence", type=click.Choice(LICENSES), help="License of the package.")
@click.option(
    "--interfaces",
    "--interfaces-only",
    "interfaces_only",
    is_flag=True,
    help="Create a package that contains only interfaces. CMake builds it for nodes in any "
    "language, and pip builds it for Python. INTERFACE is an interface to create, such as "
    "`Drive` or `srv/Ask`.",
)
@common
def command(
    name: str,
    starters: tuple[str, ...],
    interfaces_only: bool,
    **arguments: Any,
) -> int:
    """Create a package that you can build with colcon and install with pip.

    Each build of the package compiles the interfaces in its msg/, srv/ and action/ folders.
    `idlc init` creates the same package in an empty folder, with an example, and compiles it.
    """
    from idlc.cli.output import program
    from idlc.diagnostics.report import Report
    from idlc.project.root import Root
    from idlc.scaffold.changes import Settings
    from idlc.scaffold.interface import starter
    from idlc.scaffold.package import check_package_name, package

    if starters and not interfaces_only:
        raise click.UsageError("INTERFACE needs --interfaces")
    try:
        check_package_name(name)
        examples = dict(map(starter, (starters or ("Example",)) if interfaces_only else ()))
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    report, root = Report(), Root.here()
    build_type = "ament_cmake" if interfaces_only else "ament_python"
    maintainer, _, email = arguments["maintainer"].partition("<")
    arguments |= {"maintainer": maintainer.strip(), "email": email.strip(" >")}
    requested = _requested(name, arguments, build_type, root)
    shared = {key: arguments[key] for key in ("dry_run", "force", "include")}
    chosen = {"license" if key == "licence" else key for key, value in arguments.items() if value}
    chosen |= {"starters"} if starters else set()
    result = package(requested, Settings(root, **shared), report, examples, chosen)
    example = f"{program()} scaffold interface msg Status 'float32 battery'"
    return finish(result, report, (f"cd {name}", example))


def _requested(name: str, arguments: dict[str, Any], build_type: str, root: Root) -> Package:
    """Return the package with the defaults for what was not set."""
    from idlc.project.git import setting
    from idlc.scaffold.package import Package

    return Package(
        name,
        f"The package {name}.",
        arguments["maintainer"] or setting("user.name", root.base) or "Your Name",
        arguments["email"] or setting("user.email", root.base) or "you@example.com",
        arguments["licence"] or LICENSES[0],
        build_type,
    )
