"""`idlc gen`."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from idlc.cli import completion, options

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.generate.gen import GenOptions
    from idlc.generate.package import Generated
    from idlc.project.find import Stamp


def once(request: GenOptions, style: str) -> int:
    """Run once, show the outcome and return the exit status."""
    from idlc.cli import output
    from idlc.diagnostics.report import Report
    from idlc.diagnostics.terminal import summary
    from idlc.generate.gen import gen

    report = Report()
    packages = gen(request, report)
    if style == "text":
        output.show(report, style, sys.stderr)
        output.notes(report, sys.stderr)
        if report.had_errors:
            outcome = "" if request.check else "; nothing was written"
            sys.stderr.write(f"{summary(report)}{outcome}\n")
        else:
            sys.stdout.writelines([_line(package, request.check) for package in packages])
    else:
        _document(report, style, packages, check=request.check)
    return output.status(report)


def _document(
    report: Report, style: str, packages: Sequence[Generated] = (), *, check: bool = False
) -> None:
    """Write the outcome in a format for programs."""
    from idlc.cli import output

    if style != "json":
        output.document(report, style, "gen", tuple(package.out for package in packages))
        return
    output.show(report, style, sys.stdout)
    for package in packages:
        output.fact(sys.stdout, "package", **package._asdict(), check=check)
    output.fact(sys.stdout, "summary", **output.counts(report))


def _line(package: Generated, check: bool) -> str:
    """Return the line about a package: its size, and the changes if only a part was written."""
    from idlc.diagnostics.terminal import counted
    from idlc.diagnostics.text import one_line

    is_all = not check and package.written >= package.files and not package.removed
    note = "" if is_all else f" ({'up to date' if check else package.changes})"
    needs = "" if check or not package.needs else f"; imports {', '.join(package.needs)}"
    return (
        f"{package.package}: {counted(package.interfaces, 'interface')} → "
        f"{counted(package.files, 'file')} in {one_line(package.out)}, "
        f"runtime {package.runtime}{note}{needs}\n"
    )


INTERVAL = 0.25


def run_again(request: GenOptions, style: str) -> int:
    """Run now and after each change of a compiled file; Ctrl-C ends it with status 0."""
    from idlc.diagnostics.text import one_line

    try:
        seen = now = _snapshot(request)
        once(request, style)
        sys.stderr.write(f"watching {one_line(', '.join(request.paths))}; Ctrl-C ends\n")
        while True:
            sys.stdout.flush()
            sys.stderr.flush()
            time.sleep(INTERVAL)
            before, now = now, _snapshot(request)
            if before == now != seen:  # so that a burst of changes counts as one
                seen = now
                once(request, style)
    except KeyboardInterrupt:
        sys.stderr.write("\n")
        return 0


def _snapshot(request: GenOptions) -> dict[str, Stamp]:
    from idlc.project.find import snapshot, stamps
    from idlc.recordings.find import files

    root = request.scope.root
    return snapshot(request.paths, request.scope.include, root) | stamps(files(request.paths, root))


EPILOG = options.example(*options.DEMO, "idlc gen demo -o out/demo")
EPILOG += "\n" + options.example(
    "[tool.idlc]",
    'paths = ["demo"]',
    'out = "out/demo"',
    title="All options can be kept in pyproject.toml",
)


class _Command(click.Command):
    """The command, in which --vendor-deps does not take the next argument for its value."""

    def parse_args(self, context: click.Context, words: list[str]) -> list[str]:
        """Parse the words after the command."""
        words = [f"{word}=private" if word == "--vendor-deps" else word for word in words]
        return super().parse_args(context, words)


@click.command("gen", cls=_Command, epilog=EPILOG)
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
@options.packages
@options.distro
@click.option("--check", is_flag=True, help="Write nothing; fail if OUT is out of date.")
@click.option("--watch", is_flag=True, help="Go on, and compile again after every change.")
@click.option(
    "--vendor-deps",
    "vendoring",
    type=click.Choice(("private", "beside")),
    is_flag=False,
    flag_value="private",
    metavar="[=beside]",
    help="Write the types that OUT uses of other packages into it, or these packages beside it.",
)
@click.option(
    "--runtime",
    type=click.Choice(["carried", "installed"]),
    help="Have a copy of the runtime in OUT, or import idlc-runtime. As before, at first carried.",
)
@click.option("--force", is_flag=True, help="Replace edited and foreign files, keeping copies.")
@options.report_style
def command(style: str, watch: bool, **arguments: Any) -> int:
    """Compile interface files into a Python package.

    PATH is a package folder, a folder of interface files, a .msg, .srv or .action file, a folder of
    packages, or the name of a package or type that is installed or built in: std_msgs/msg/Header.
    REC is a recording, an .mcap or .db3 file or the folder of a bag: all that its topics need.

    OUT is the package for one package. Several are written to OUT/NAME each. With PREFIX, which any
    number of packages can share, there is nothing to build: `source PREFIX/setup.bash`. In a
    package with a setup.py, PATH and OUT default to the package and the folder that setup.py takes
    it from.
    """
    from idlc.cli import output
    from idlc.generate.gen import GenOptions, in_package, with_settings
    from idlc.project.find import is_path
    from idlc.project.settings import scope, settings_here
    from idlc.recordings.find import split_recordings

    settings, report = settings_here()
    if report.had_errors:
        if style == "text":
            output.show(report, style, sys.stderr)
        else:
            _document(report, style)
        return output.status(report)
    package = arguments["package"]
    words = [arguments.pop(name) for name in ("package", "include", "exclude", "distro")]
    again = shlex.join(("idlc", "gen", *options.typed("check", "style")))
    arguments["vendoring"] = arguments["vendoring"] or ""
    typed = GenOptions(**arguments, scope=scope(settings, *words), again=again)
    request = in_package(with_settings(typed, settings))
    if not request.paths or not (request.out or request.ament):
        missing = "-o OUT or --ament PREFIX" if request.paths else "PATH"
        raise click.UsageError(f"give {missing}, or set it in [tool.idlc] of pyproject.toml")
    root = request.scope.root
    # which may have no effect on the paths
    judged = request.paths if package or request.topics else ()
    recordings, others = split_recordings(judged, root)
    if request.topics and not recordings:
        raise click.UsageError("--topic is for recordings, and none was given")
    if package and not any(is_path(word, root) for word in others):
        what = "what was recorded" if recordings else "what is installed"
        raise click.UsageError(
            f"--package is for files, and none was given; {what} keeps the name that messages have"
        )
    if request.check and (watch or request.force):
        raise click.UsageError(
            "--check writes nothing, so it goes with neither --watch nor --force"
        )
    if watch and style in options.DOCUMENTS:
        raise click.UsageError("--watch goes with --format text and json only")
    if watch:
        return run_again(request, style)
    return once(request, style)
