"""Commands that show what there is: `list`, `docs`, `doctor` and `explain`."""

from __future__ import annotations

import re
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any

import click

from idlc.cli import output
from idlc.cli.streams import colours
from idlc.diagnostics.explain import close_name, overview, page
from idlc.diagnostics.report import Report, ReportedError
from idlc.diagnostics.terminal import Paint, counted
from idlc.diagnostics.text import one_line
from idlc.project import library
from idlc.project.settings import Scope, scope, settings_here


def in_scope(
    command: Callable[..., str | None], scoping: Sequence[Any], *, despite_errors: bool
) -> int:
    """Call a command with the `scope` that options mean, and a `report`, which is shown then.

    Unless `despite_errors`, it is not called if the settings have errors. The text that it returns
    is written after the report.
    """
    settings, report = settings_here()
    text = None
    with suppress(ReportedError):
        if not despite_errors:
            report.raise_errors()
        text = command(scope=scope(settings, *scoping), report=report)
    output.show(report, "text", sys.stderr)
    output.notes(report, sys.stderr)
    sys.stdout.write(text or "")
    return output.status(report)


def list_names(packages: tuple[str, ...], style: str, scope: Scope, report: Report) -> None:
    """List packages, or the interfaces in some."""
    listed = [] if packages else library.packages(scope, report)
    names = library.interfaces(packages, scope, report) if packages else []
    if style == "json":
        for package in listed:
            output.fact(sys.stdout, "package", **package._asdict())
        for name in names:
            output.fact(sys.stdout, "interface", name=name)
        return
    paint = output.painter(sys.stdout)
    width = max((len(package.name) for package in listed), default=0)
    for name, number, path in listed:
        place = one_line(path) if path else "built in"
        head = f"{paint('type', name)}{' ' * (width - len(name))}"
        sys.stdout.write(f"{head}  {counted(number, 'interface'):>14}  {place}\n")
    sys.stdout.writelines(f"{name}\n" for name in names)


def write_docs(paths: tuple[str, ...], out: str, scope: Scope, report: Report) -> str:
    """Write a site, and return the line about it."""
    from idlc.tasks.docs import docs

    pages = docs(paths or scope.paths or (".",), out, scope, report)
    return f"{counted(pages, 'page')} written; open {out}/index.html\n" if pages else ""


def doctor(style: str, scope: Scope, report: Report) -> None:  # noqa: ARG001 - no problem of files
    """Write a line for each finding."""
    from idlc.tasks.doctor import examine

    paint = output.painter(sys.stdout)
    for finding in examine(scope, output.program):
        subject, text, hint = finding
        if style == "json":
            output.fact(sys.stdout, subject, good=not hint, text=text, hint=hint)
        else:
            sign = "warn" if hint else "ok"
            head = paint("warning" if hint else "good", f"{sign:4}")
            sys.stdout.write(f"{head}  {subject:10}  {one_line(text)}\n")
            if hint:
                sys.stdout.write(f"{'':18}= {paint('hint', 'hint')}: {one_line(hint)}\n")


#: Longer lines are hard to read.
WIDTH = 88


def explain(code: str | None) -> int:
    """Show a page, all pages, or the list of the codes; return the exit status."""
    if code is None:
        paint = output.painter(sys.stdout)
        *lines, advice = overview()
        shown = (line if line.startswith(" ") else paint("bold", line) for line in lines)
        sys.stdout.writelines(f"{line}\n" for line in (*shown, advice))
        return 0
    text = page(code)
    if text is None:
        close = close_name(code)
        hint = f"did you mean {close}?" if close else "`idlc explain` lists the codes"
        raise click.UsageError(f"no such code: `{code}`; {hint}")
    if sys.stdout.isatty() or colours(sys.stdout):
        width = min(shutil.get_terminal_size((WIDTH, 24)).columns, WIDTH)
        sys.stdout.writelines(_page(text, width, output.painter(sys.stdout)))
    else:
        sys.stdout.write(text)
    return 0


def _page(text: str, width: int, paint: Paint) -> Iterator[str]:
    """Yield the lines of a page for a terminal: files under their names, and no Markdown."""
    for number, part in enumerate(re.split(r"(?m)^```", text)):
        head, _, body = part.partition("\n")
        if number % 2:
            yield f"    {paint('comment', head)}\n" if head not in ("", "console") else ""
            yield f"{textwrap.indent(body, '    ')}\n"
            continue
        for paragraph in filter(None, map(str.strip, part.split("\n\n"))):
            if paragraph.startswith("#"):
                yield f"{paint('bold', paragraph.lstrip('# '))}\n\n"
                continue
            # a wrapped line does not break within code
            whole = re.sub("`[^`]*`", lambda code: code[0].replace(" ", "\xa0"), paragraph)
            lines = textwrap.fill(whole, width, break_long_words=False, break_on_hyphens=False)
            code = re.sub("`([^`]+)`", lambda match: paint("type", match[1]), lines)
            yield f"{code}\n\n".replace("\xa0", " ")
