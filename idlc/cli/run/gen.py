"""`idlc gen`: compiling once, or after every change."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

import click

from idlc.cli import options, output
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError
from idlc.diagnostics.terminal import Paint, counted, summary
from idlc.diagnostics.text import one_line
from idlc.generate.package import Generated
from idlc.project.find import Stamp, list_files, snapshot, stamps
from idlc.project.root import Root
from idlc.project.settings import load_settings, scope, settings_here
from idlc.project.words import files, is_address, read_words, split_topics
from idlc.tasks.gen import GenOptions, gen, in_package, with_settings

#: The seconds between two looks at the files.
INTERVAL = 0.25


def once(request: GenOptions, style: str) -> int:
    """Run once, show the outcome and return the exit status."""
    report = Report()
    packages: tuple[Generated, ...] | None = None
    with suppress(ReportedError):
        packages = gen(request, report)
    if style == "text":
        output.show(report, style, sys.stderr)
        output.notes(report, sys.stderr)
        if packages is None:
            outcome = "" if request.check else "; nothing was written"
            sys.stderr.write(f"{summary(report)}{outcome}\n")
        else:
            paint = output.painter(sys.stdout)
            sys.stdout.writelines([_line(package, request.check, paint) for package in packages])
    else:
        _document(report, style, packages or (), check=request.check)
    return max(output.status(report), _lacks_types(report))


def _lacks_types(report: Report) -> bool:
    """Return whether nodes of a robot did not send the definitions of some topics."""
    return any(
        problem.code == codes.MISSING_DEFINITION.id and "does not define" in problem.message
        for problem in report
        if is_address(problem.where[0])
    )


def _document(
    report: Report, style: str, packages: Sequence[Generated] = (), *, check: bool = False
) -> None:
    """Write the outcome in a format for programs."""
    if style != "json":
        output.document(report, style, "gen", tuple(package.out for package in packages))
        return
    output.show(report, style, sys.stdout)
    for package in packages:
        output.fact(sys.stdout, "package", **package._asdict(), check=check)
    output.fact(sys.stdout, "summary", **output.counts(report))


def _line(package: Generated, check: bool, paint: Paint) -> str:
    """Return the line about a package: what was written, and the changes if it is only a part."""
    note = f" ({package.changes})"
    if check:
        note = " (up to date)"
    elif package.written >= package.files and not package.removed:
        note = ""
    imported = ["idlc_runtime"] * (package.runtime == "installed") + [*package.needs]
    needs = f"; imports {', '.join(imported)}" if imported and not check else ""
    verb = "wrote " if not check and (package.written or package.removed) else ""
    return (
        f"{verb}{paint('good', one_line(package.out))}: {counted(package.files, 'file')} from "
        f"{counted(package.interfaces, 'interface')}{note}{needs}\n"
    )


def _set_up_below(root: Root) -> Iterator[str]:
    """Yield the folders of packages that `idlc gen` compiles without arguments."""
    for folder in list_files((".",), root, Report()).packages:
        settings = load_settings(Root.at(folder), Report())
        request = in_package(with_settings(GenOptions((), scope(settings)), settings))
        if request.out and list_files(request.paths, request.scope.root, Report()).files:
            yield one_line(root.shown(folder))


def run_again(request: GenOptions, style: str) -> int:
    """Run now and after each change of a compiled file; Ctrl-C ends it with status 0."""
    try:
        seen = now = _snapshot(request)
        once(request, style)
        sys.stderr.write(f"watching {one_line(', '.join(request.paths))}; press Ctrl-C to stop\n")
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

    root = request.scope.root
    return snapshot(request.paths, request.scope.include, root) | stamps(files(request.paths, root))


def run(style: str, watch: bool, **arguments: Any) -> int:
    """Run the command and return the exit status."""
    settings, report = settings_here()
    if report.had_errors:  # of the settings
        if style == "text":
            output.show(report, style, sys.stderr)
        else:
            _document(report, style)
        return output.status(report)
    package = arguments["package"]
    words = [arguments.pop(name) for name in ("package", "include", "exclude", "distro")]
    again = shlex.join(("idlc", "gen", *options.typed("check", "style")))
    arguments["vendoring"] = arguments["vendoring"] or ""
    arguments["paths"], topics = split_topics(arguments["paths"], Root.here())
    typed = GenOptions(**arguments, topics=topics, scope=scope(settings, *words), again=again)
    request = in_package(with_settings(typed, settings))
    _refuse_what_has_no_effect(request, package)
    if request.check and (watch or request.force):
        raise click.UsageError("--check cannot be combined with --watch or --force")
    if watch and style in options.DOCUMENTS:
        raise click.UsageError("--watch needs --format text or json")
    if watch:
        return run_again(request, style)
    return once(request, style)


def _refuse_what_has_no_effect(request: GenOptions, package: str | None) -> None:
    """Raise a usage error without inputs or an output, and for options that do not apply."""
    if not request.paths or not (request.out or request.ament):
        missing = "-o OUT or --ament PREFIX" if request.paths else "PATH"
        message = f"missing {missing}; add it, or set it in [tool.idlc] of pyproject.toml"
        if not request.paths and (packages := list(_set_up_below(request.scope.root))):
            call = output.program()
            commands = (f"(cd {shlex.quote(path)} && {call} gen)" for path in packages)
            message = f"this folder contains several packages; run `{' && '.join(commands)}`"
        raise click.UsageError(message)
    root = request.scope.root
    meant = read_words(request.paths if package else (), root)
    if package and not meant["path"]:
        what = "a recording" if meant["recording"] else "an installed package"
        raise click.UsageError(f"--package applies to files, but {what} keeps its own package name")
