"""`idlc explain`."""

from __future__ import annotations

import re
import sys

import click

from idlc.cli import completion

EPILOG = """\
Example:

\b
  idlc explain wide-string
"""


@click.command("explain", epilog=EPILOG)
@click.argument("code", metavar="[CODE]", required=False, shell_complete=completion.codes)
@click.option("--all", "everything", is_flag=True, help="Every code, as one Markdown document.")
def command(code: str | None, everything: bool) -> int:
    """Explain a code: what it means, why, an example that triggers it and one that is right.

    CODE is an id such as IDL201 or a name such as unknown-type; without it, all are listed.
    """
    from idlc.cli import output
    from idlc.diagnostics import rulebook
    from idlc.diagnostics.code_pages import close_name, page

    if everything:
        sys.stdout.write(rulebook.document())
        return 0
    if code is None:
        sys.stdout.writelines(f"{line}\n" for line in rulebook.overview())
        return 0
    text = page(code)
    if text is None:
        close = close_name(code)
        hint = f"did you mean {close}?" if close else "`idlc explain` lists the codes"
        raise click.UsageError(f"no such code: {code}; {hint}")
    if output.colours(sys.stdout):
        _show(text)
    else:
        sys.stdout.write(text)
    return 0


def _show(text: str) -> None:
    """Write a page to a terminal, with the names of files, which Markdown would hide."""
    from rich.console import Console
    from rich.markdown import Markdown

    named = re.sub(r"^```(\S*[./]\S*)$", r"`\1`\n```text", text, flags=re.MULTILINE)
    Console(width=min(100, Console().width)).print(Markdown(named))
