"""`idlc gen`."""

from __future__ import annotations

import sys

import click

from idlc.cli import options, terminal
from idlc.disk import config
from idlc.driver.gen import Generated, GenOptions, gen
from idlc.text.diagnostics import Report
from idlc.text.present import counted, summary

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
@click.argument("paths", metavar="PATH...", nargs=-1, type=click.Path())
@click.option("-o", "--out", metavar="OUT", type=click.Path(), help="The package folder to write.")
@options.package
@options.include
@click.option("--check", is_flag=True, help="Write nothing; fail if OUT is out of date.")
@click.option("--watch", is_flag=True, help="Go on, and compile again after every change.")
@click.option(
    "--vendor-deps", is_flag=True, help="Write the packages that are depended on beside OUT."
)
@click.option("--force", is_flag=True, help="Replace edited and foreign files, keeping copies.")
@options.style
def command(
    paths: tuple[str, ...],
    out: str | None,
    package: str | None,
    include: tuple[str, ...],
    check: bool,
    watch: bool,
    vendor_deps: bool,
    force: bool,
    style: str,
) -> int:
    """Compile interface files into a Python package.

    PATH is a package folder, a folder of interface files, or a .msg, .srv or .action file.
    """
    report = Report()
    settings = config.load(report)
    if report.had_errors:
        terminal.show(report, style, sys.stdout if style == "json" else sys.stderr)
        return terminal.status(report)
    out = out or settings.out
    paths = paths or settings.paths
    if not paths or not out:
        missing = "-o OUT" if paths else "PATH"
        raise click.UsageError(f"give {missing}, or set it in [tool.idlc] of pyproject.toml")
    if check and (watch or force):
        raise click.UsageError(
            "--check writes nothing, so it goes with neither --watch nor --force"
        )
    wanted = GenOptions(
        paths=paths,
        out=out,
        package=package or settings.package,
        include=(*include, *settings.include),
        check=check,
        vendor_deps=vendor_deps or settings.vendor_deps,
        force=force,
    )
    if watch:
        from idlc.cli.watch import watch as run_again

        return run_again(wanted, lambda: once(wanted, style))
    return once(wanted, style)


def once(wanted: GenOptions, style: str) -> int:
    """Run once, show what happened and return the exit status."""
    report = Report()
    packages = gen(wanted, report)
    if style == "json":
        terminal.show(report, style, sys.stdout)
        for package in packages:
            terminal.fact(sys.stdout, "package", **package._asdict(), check=wanted.check)
        terminal.fact(sys.stdout, "summary", **terminal.counts(report))
        return terminal.status(report)
    terminal.show(report, style, sys.stderr)
    if report.had_errors:
        outcome = "" if wanted.check else "; nothing was written"
        sys.stderr.write(f"{summary(report)}{outcome}\n")
    else:
        for package in packages:
            sys.stdout.write(_line(package, wanted.check))
    return terminal.status(report)


def _line(package: Generated, check: bool) -> str:
    """Return what is said of a package: what it is, and what was done if that is not all of it."""
    done = []
    if check:
        done.append("up to date")
    elif not package.written and not package.removed:
        done.append("unchanged")
    elif package.written < package.files or package.removed:
        done += [f"{package.written} written"] if package.written else []
        done += [f"{package.removed} removed"] if package.removed else []
    note = f" ({', '.join(done)})" if done else ""
    return (
        f"{package.package}: {counted(package.interfaces, 'interface')} → "
        f"{counted(package.files, 'file')} in {package.out}{note}\n"
    )
