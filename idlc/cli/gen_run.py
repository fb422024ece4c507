"""One run of `idlc gen`: what it says and the status that it ends with."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from idlc.cli import output, reports
from idlc.diagnostics.formats.terminal import counted, summary
from idlc.diagnostics.report import Report
from idlc.diagnostics.visible import one_line
from idlc.driver.generate.gen import GenOptions, gen
from idlc.driver.generate.result import Generated


def refuse(report: Report, style: str) -> None:
    """Show problems that leave nothing to be done."""
    if style == "text":
        output.show(report, style, sys.stderr)
    else:
        _document(report, style)


def once(wanted: GenOptions, style: str) -> int:
    """Run once, show what happened and return the exit status."""
    report = Report()
    packages = gen(wanted, report)
    if style == "text":
        _tell(report, packages, wanted.check)
    else:
        _document(report, style, packages, check=wanted.check)
    return output.status(report)


def _document(
    report: Report, style: str, packages: Sequence[Generated] = (), *, check: bool = False
) -> None:
    """Write what happened in a format for programs."""
    if style != "json":
        from idlc.driver.check import Checked  # with its rules, which a run does without

        folders = tuple(package.out for package in packages)
        reports.write(report, style, Checked(folders), sys.stdout, command="gen")
        return
    output.show(report, style, sys.stdout)
    for package in packages:
        output.fact(sys.stdout, "package", **package._asdict(), check=check)
    output.fact(sys.stdout, "summary", **output.counts(report))


def _tell(report: Report, packages: Sequence[Generated], check: bool) -> None:
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    if report.had_errors:
        outcome = "" if check else "; nothing was written"
        sys.stderr.write(f"{summary(report)}{outcome}\n")
    else:
        for package in packages:
            sys.stdout.write(_line(package, check))


def _line(package: Generated, check: bool) -> str:
    """Return the line about a package: what it is, and what was done if only a part was written."""
    done = []
    if check:
        done.append("up to date")
    elif not package.written and not package.removed:
        done.append("unchanged")
    elif package.written < package.files or package.removed:
        done += [f"{package.written} written"] if package.written else []
        done += [f"{package.removed} removed"] if package.removed else []
    note = f" ({', '.join(done)})" if done else ""
    needs = "" if check or not package.needs else f"; imports {', '.join(package.needs)}"
    return (
        f"{package.package}: {counted(package.interfaces, 'interface')} → "
        f"{counted(package.files, 'file')} in {one_line(package.out)}{note}{needs}\n"
    )
