"""`idlc gen`."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Any

import click

from idlc.cli import completion, options
from idlc.diagnostics.formats import DOCUMENTS

EPILOG = """\
Example:

\b
  mkdir -p demo/msg
  echo 'float64 speed 0.5  # [m/s]' > demo/msg/Drive.msg
  idlc gen demo -o out/demo

All options can be kept in pyproject.toml:

\b
  [tool.idlc]
  paths = ["demo"]
  out = "out/demo"
"""


@click.command("gen", epilog=EPILOG)
@click.argument("paths", metavar="PATH|PACKAGE|TYPE|REC...", nargs=-1, type=click.Path())
@click.option("-o", "--out", metavar="OUT", type=click.Path(), help="The folder to write.")
@click.option(
    "--ament",
    metavar="PREFIX",
    type=click.Path(),
    default="",
    help="Install into a prefix, complete for ROS 2 and its C++ tools.",
)
@click.option(
    "--topic",
    "topics",
    metavar="NAME",
    multiple=True,
    shell_complete=completion.topics,
    help="Of recordings, only the types of this topic. May be repeated.",
)
@options.package
@options.include
@options.exclude
@options.distro
@click.option("--check", is_flag=True, help="Write nothing; fail if OUT is out of date.")
@click.option("--watch", is_flag=True, help="Go on, and compile again after every change.")
@click.option(
    "--vendor-deps", is_flag=True, help="Write the packages that are depended on beside OUT."
)
@click.option("--force", is_flag=True, help="Replace edited and foreign files, keeping copies.")
@options.report_style
def command(style: str, watch: bool, **given: Any) -> int:
    """Compile interface files into a Python package.

    PATH is a package folder, a folder of interface files, a .msg, .srv or .action file, a folder of
    packages, or the name of a package or type that is installed or built in: std_msgs/msg/Header.
    REC is a recording, an .mcap or .db3 file or the folder of a bag: all that its topics need.

    OUT is the package for one package. Several are written to OUT/NAME each. With PREFIX, which any
    number of packages can share, there is nothing to build: `source PREFIX/setup.bash`. In a
    package with a setup.py, PATH and OUT default to the package and the folder that setup.py takes
    it from.
    """
    from idlc.cli import gen_run, output
    from idlc.diagnostics.report import Report
    from idlc.disk.scope import scope
    from idlc.disk.settings import pyproject
    from idlc.driver.generate.gen import GenOptions, in_package, with_settings

    report = Report()
    settings = pyproject.load(report)
    if report.had_errors:
        gen_run.refuse(report, style)
        return output.status(report)
    package = given["package"]
    words = [given.pop(name) for name in ("package", "include", "exclude", "distro")]
    again = shlex.join(("idlc", "gen", *options.typed("check", "style")))
    asked = GenOptions(**given, scope=scope(settings, *words), again=again)
    wanted = in_package(with_settings(asked, settings))
    if not wanted.paths or not (wanted.out or wanted.ament):
        missing = "-o OUT or --ament PREFIX" if wanted.paths else "PATH"
        raise click.UsageError(f"give {missing}, or set it in [tool.idlc] of pyproject.toml")
    _refuse_in_vain(wanted.paths, package, wanted.topics)
    if wanted.check and (watch or wanted.force):
        raise click.UsageError(
            "--check writes nothing, so it goes with neither --watch nor --force"
        )
    if watch and style in DOCUMENTS:
        raise click.UsageError("--watch goes with --format text and json only")
    if watch:
        from idlc.cli.watch import run_again

        return run_again(wanted, style)
    return gen_run.once(wanted, style)


def _refuse_in_vain(paths: Sequence[str], package: str | None, topics: Sequence[str]) -> None:
    """Refuse options that mean nothing for what was given."""
    from idlc.disk.find import is_path
    from idlc.recordings.find import divided

    recordings, others = divided(paths) if package or topics else ((), ())
    if topics and not recordings:
        raise click.UsageError("--topic is for recordings, and none was given")
    if package and not any(map(is_path, others)):
        what = "what was recorded" if recordings else "what is installed"
        raise click.UsageError(
            f"--package is for files, and none was given; {what} keeps the name that messages have"
        )
