"""`idlc fmt`: formatting each file."""

from __future__ import annotations

import sys
from contextlib import suppress

from idlc.cli import output
from idlc.compiler.compiler import stage
from idlc.diagnostics.report import ReportedError
from idlc.diagnostics.terminal import counted
from idlc.diagnostics.text import one_line
from idlc.model import ir
from idlc.project.find import find
from idlc.project.settings import scope, settings_here
from idlc.project.write import rewrite
from idlc.tasks.fmt import laid_out


def run(paths: tuple[str, ...], check: bool, diff: bool, exclude: tuple[str, ...]) -> int:
    """Run the command and return the exit status."""
    settings, report = settings_here()
    write = not (check or diff)
    done = "changed" if write else "would change"
    broken, clean = "with errors skipped", "already formatted"
    numbers = dict.fromkeys((done, broken, clean), 0)
    with suppress(ReportedError):
        report.raise_errors()  # of the settings
        left_out = scope(settings, exclude=exclude).exclude
        for file in find(paths or settings.paths or (".",), settings.root, report, left_out):
            source = settings.root.read_source(file.path, file.shown, report)
            if source is None:
                continue
            with stage("format", file.shown):
                name = ir.TypeName("package", file.kind, file.name)
                new = laid_out(source, name, report)
            if new is None or new == source.text:
                numbers[broken if new is None else clean] += 1
                continue
            numbers[done] += 1
            if write:
                rewrite(file.path, file.shown, source.text, new, report)
            if diff:
                output.diff(file.shown, source.text, new, sys.stdout)
            else:
                sys.stdout.write(f"{done} {one_line(file.shown)}\n")
    output.show(report, "text", sys.stderr)
    shown = [f"{counted(count, 'file')} {what}" for what, count in numbers.items() if count]
    if shown:
        (sys.stderr if diff else sys.stdout).write(f"{', '.join(shown)}\n")
    return output.status(report) or int(not write and bool(numbers[done]))
