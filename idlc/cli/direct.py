"""The body of `idlc check`, free of click."""

from __future__ import annotations

import sys


def check_paths(
    paths: tuple[str, ...],
    *,
    select: str | None = None,
    ignore: str | None = None,
    fix: bool = False,
    diff: bool = False,
    strict: bool = False,
    style: str = "text",
    prefix: str | None = None,
    package: str | None = None,
    include: tuple[str, ...] = (),
    exclude: tuple[str, ...] = (),
    distro: str | None = None,
) -> int:
    """Check paths, or those in pyproject.toml, or the working folder; return the exit status.

    `select` and `ignore` are lists of rules with commas.
    """
    from idlc.check.select import selection
    from idlc.cli import output
    from idlc.diagnostics import terminal
    from idlc.diagnostics.terminal import counted
    from idlc.diagnostics.text import one_line
    from idlc.project.settings import scope, settings_here
    from idlc.tasks.check import CheckOptions, CheckResult, check

    settings, report = settings_here()
    chosen = selection(settings, report).with_lists(select, ignore)
    checked = CheckResult(())
    if prefix is not None:
        from idlc.tasks.check_prefix import check_prefix

        checked = check_prefix(prefix, settings.root, report)
    elif not report.had_errors:
        where = scope(settings, package, include, exclude, distro)
        options = CheckOptions(paths or settings.paths or (".",), where, chosen, fix, diff)
        checked = check(options, report)
    files, fixed = checked.files, checked.fixed
    match style:
        case "text":
            stream = sys.stderr if diff else sys.stdout  # a diff alone can be applied
            paint = output.painter(stream)
            for name, (old, new) in checked.texts.items() if diff else ():
                output.diff(name, old, new, sys.stdout)
            output.show(report, style, stream, fixable=True)
            if len(report) > terminal.MANY:
                stream.writelines(terminal.statistics(report))
            done = f"{fixed} {'would be fixed' if diff else 'fixed'}, " if fixed else ""
            what = counted(len(files), "file")
            if not files and checked.packages:
                what = f"{counted(checked.packages, 'package')} without interfaces"
            which = f" for {', '.join(checked.distros)}" if checked.distros else ""
            rest = paint("good", f"no problems in {what}{which}")
            stream.write(f"{done}{terminal.summary(report) if len(report) else rest}\n")
            if fixable := sum(bool(problem.edits) for problem in report):
                star = paint("hint", "[*]")
                stream.write(f"{star} {counted(fixable, 'problem')} fixable with `--fix`\n")
            sys.stderr.writelines(f"note: {one_line(note)}\n" for note in checked.notes)
        case "json":
            output.show(report, style, sys.stdout)
            facts: dict[str, object] = {"files": len(files), **({"fixed": fixed} if fixed else {})}
            facts |= {"distros": list(checked.distros)} if checked.distros else {}
            output.fact(sys.stdout, "summary", **output.counts(report), **facts)
        case _:
            output.document(report, style, "check", files, strict=strict)
    return output.status(report) or int((strict and len(report) > 0) or (diff and fixed > 0))


def serve_editor() -> int:
    """Serve the client at the other end of standard input and output; return the exit status."""
    from idlc.editor.server import serve

    if sys.stdin.isatty():
        sys.stderr.write(
            "the language server waits for an editor on standard input; press Ctrl-C to stop it\n"
        )
    # a thread may still read when the program ends, so it is not sys.stdin that it waits in, and
    # what it waits in is never closed
    reader = open(sys.stdin.fileno(), "rb", closefd=False)  # noqa: SIM115
    # nor does anything stay in sys.stdout that cannot be written when the program ends
    writer = open(sys.stdout.fileno(), "wb", closefd=False)  # noqa: SIM115
    return serve(reader, writer)
