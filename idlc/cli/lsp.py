"""`idlc lsp`."""

from __future__ import annotations

import sys

import click

from idlc.cli import options


@click.command("lsp", epilog=options.example("idlc lsp --check"))
@click.option("--check", is_flag=True, help="Print what the server can do, as JSON, and end.")
@click.option(
    "--stdio", is_flag=True, expose_value=False, help="Many editors add it; it is so anyway."
)
@click.option(
    "--clientProcessId",
    metavar="ID",
    expose_value=False,
    help="Some editors add it; they say the same when they begin.",
)
def command(check: bool) -> int:
    """Serve an editor, which starts this and talks to it over standard input and output.

    The protocol is the Language Server Protocol 3.17; the language id of .msg, .srv and .action
    files is `rosmsg`. Settings are those of [tool.idlc], and those that the editor sends.
    """
    if check:
        import json

        from idlc.editor.protocol import initialize_result

        sys.stdout.write(json.dumps(initialize_result({}), indent=2) + "\n")
        return 0
    from idlc.cli.direct import serve_editor

    return serve_editor()
