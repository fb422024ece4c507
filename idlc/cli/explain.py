"""`idlc explain`."""

from __future__ import annotations

import re
import shutil
import sys
import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from idlc.cli import completion, options
from idlc.cli.streams import colours

if TYPE_CHECKING:
    from idlc.diagnostics.terminal import Paint

#: Longer lines are hard to read.
WIDTH = 88


@click.command("explain", epilog=options.example("idlc explain wide-string"))
@click.argument("code", metavar="[CODE]", required=False, shell_complete=completion.codes)
def command(code: str | None) -> int:
    """Explain what a rule reports and why, with a bad and a good example.

    CODE is an id such as IDL201 or a name such as unknown-type. Without CODE, idlc lists all rules.
    """
    from idlc.cli import output
    from idlc.diagnostics import explain

    if code is None:
        paint = output.painter(sys.stdout)
        *lines, advice = explain.overview()
        shown = (line if line.startswith(" ") else paint("bold", line) for line in lines)
        sys.stdout.writelines(f"{line}\n" for line in (*shown, advice))
        return 0
    text = explain.page(code)
    if text is None:
        close = explain.close_name(code)
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
