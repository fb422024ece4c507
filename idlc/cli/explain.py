"""`idlc explain`."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator

import click

from idlc.cli import completion, options


@click.command("explain", epilog=options.example("idlc explain wide-string"))
@click.argument("code", metavar="[CODE]", required=False, shell_complete=completion.codes)
@click.option("--all", "everything", is_flag=True, help="Every code, as one Markdown document.")
def command(code: str | None, everything: bool) -> int:
    """Explain a code: what it means, why, an example that triggers it and one that is right.

    CODE is an id such as IDL201 or a name such as unknown-type; without it, all are listed.
    """
    from idlc.cli import output
    from idlc.diagnostics import explain

    if everything:
        sys.stdout.write(explain.document())
        return 0
    if code is None:
        sys.stdout.writelines(f"{line}\n" for line in explain.overview())
        return 0
    text = explain.page(code)
    if text is None:
        close = explain.close_name(code)
        hint = f"did you mean {close}?" if close else "`idlc explain` lists the codes"
        raise click.UsageError(f"no such code: {code}; {hint}")
    if output.colours(sys.stdout):
        sys.stdout.writelines(_coloured(text))
    else:
        sys.stdout.write(text)
    return 0


def _coloured(text: str) -> Iterator[str]:
    """Yield the lines of a page for a terminal: files under their names, and no Markdown."""
    fenced = False
    for line in text.splitlines():
        if line.startswith("```"):
            fenced = not fenced
            if (file := line.strip("`")) not in ("", "console"):
                yield f"    \x1b[2m{file}\x1b[0m\n"
        elif fenced:
            yield f"    {line}".rstrip() + "\n"
        elif line.startswith("#"):
            yield f"\x1b[1m{line.lstrip('# ')}\x1b[0m\n"
        else:
            yield re.sub("`([^`]+)`", "\x1b[36m\\1\x1b[0m", line) + "\n"
