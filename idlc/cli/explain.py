"""`idlc explain`."""

from __future__ import annotations

import sys

import click

EPILOG = """\
Example:

\b
  idlc explain IDL603
"""


@click.command("explain", epilog=EPILOG)
@click.argument("code", metavar="CODE")
def command(code: str) -> int:
    """Explain a code: what it means, why, an example that triggers it and one that is right."""
    from idlc.cli import terminal
    from idlc.text.codes import CODES
    from idlc.text.pages import close_code, page

    text = page(code)
    if text is None:
        close = close_code(code)
        hint = f"did you mean {close}?" if close else f"codes run from {min(CODES)} to {max(CODES)}"
        raise click.UsageError(f"no such code: {code}; {hint}")
    if terminal.colours(sys.stdout):
        from rich.console import Console
        from rich.markdown import Markdown

        Console(width=min(100, Console().width)).print(Markdown(text))
    else:
        sys.stdout.write(text)
    return 0
