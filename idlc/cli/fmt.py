"""`idlc fmt`."""

from __future__ import annotations

import sys

import click

from idlc.cli import options


@click.command(
    "fmt",
    epilog=options.example(
        "mkdir -p demo/msg",
        "echo 'float64   speed 0.5# [m/s]' > demo/msg/Drive.msg",
        "idlc fmt demo",
    ),
)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option("--check", is_flag=True, help="Write nothing; fail if a file would change.")
@click.option(
    "--diff", is_flag=True, help="Write nothing; show the changes and fail if there are any."
)
@options.exclude
def command(paths: tuple[str, ...], check: bool, diff: bool, exclude: tuple[str, ...]) -> int:
    """Normalize whitespace and keep deliberate alignment.

    idlc keeps single spaces between words, and two spaces before a comment. It keeps wider gaps if
    they align words of the same kind, or if all lines of a block have them. Otherwise, it aligns
    the word with the lines above and below, or moves it next to the previous word. It puts spaces
    on both sides of `=` or on neither side, and keeps at most two consecutive empty lines. If idlc
    changes a file, it also removes trailing whitespace and adds a missing final newline.

    Formatting never changes the meaning of a file. idlc skips files with syntax errors. PATH works
    as in `idlc check`.
    """
    from idlc.cli import output
    from idlc.compiler.compiler import stage
    from idlc.diagnostics.terminal import counted
    from idlc.diagnostics.text import one_line
    from idlc.model import ir
    from idlc.project.find import find
    from idlc.project.settings import scope, settings_here
    from idlc.project.write import rewrite
    from idlc.tasks.fmt import laid_out

    settings, report = settings_here()
    write = not (check or diff)
    done = "changed" if write else "would change"
    broken, clean = "with errors skipped", "already formatted"
    numbers = dict.fromkeys((done, broken, clean), 0)
    if not report.had_errors:
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
