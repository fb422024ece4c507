"""`idlc explain`."""

from __future__ import annotations

import re
import sys

import click

EPILOG = """\
Example:

\b
  idlc explain IDL603
"""


@click.command("explain", epilog=EPILOG)
@click.argument("code", metavar="[CODE]", required=False)
@click.option("--all", "everything", is_flag=True, help="Every code, as one Markdown document.")
def command(code: str | None, everything: bool) -> int:
    """Explain a code: what it means, why, an example that triggers it and one that is right."""
    if everything:
        from idlc.text.rulebook import document

        sys.stdout.write(document())
        return 0
    if code is None:
        raise click.UsageError("give a CODE such as IDL201, or --all")
    from idlc.cli import terminal
    from idlc.text.codes import CODES
    from idlc.text.pages import close_code, page

    text = page(code)
    if text is None:
        close = close_code(code)
        hint = f"did you mean {close}?" if close else f"codes run from {min(CODES)} to {max(CODES)}"
        raise click.UsageError(f"no such code: {code}; {hint}")
    if terminal.colours(sys.stdout):
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
