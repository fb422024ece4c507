"""`idlc lsp`."""

from __future__ import annotations

import sys

import click

EPILOG = """\
Example:

\b
  idlc lsp --check
"""


@click.command("lsp", epilog=EPILOG)
@click.option("--check", is_flag=True, help="Print what the server can do, as JSON, and end.")
def command(check: bool) -> int:
    """Serve an editor, which starts this and talks to it over standard input and output.

    The protocol is the Language Server Protocol 3.17; the language id of .msg, .srv and .action
    files is `rosmsg`. Settings are those of [tool.idlc], and those that the editor sends.
    """
    if check:
        import json

        from idlc.lsp.capabilities import answer
        from idlc.lsp.world import World

        sys.stdout.write(json.dumps(answer(World()), indent=2) + "\n")
        return 0
    from idlc.lsp.server import serve

    if sys.stdin.isatty():
        sys.stderr.write("an editor starts this, and talks to it; Ctrl-C ends it\n")
    # a thread may still read when the program ends, so it is not sys.stdin that it waits in, and
    # what it waits in is never closed
    reader = open(sys.stdin.fileno(), "rb", closefd=False)  # noqa: SIM115
    return serve(reader, sys.stdout.buffer)
