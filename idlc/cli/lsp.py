"""`idlc lsp`."""

from __future__ import annotations

import sys

import click

from idlc.cli import options


@click.command("lsp", epilog=options.example("idlc lsp --check"))
@click.option("--check", is_flag=True, help="Print the server's capabilities as JSON, and exit.")
def command(check: bool) -> int:
    """Run the language server on standard input and output. Your editor starts it.

    The server implements the Language Server Protocol 3.17. It reads [tool.idlc] and the editor's
    settings. The language id of .msg, .srv and .action files is `rosmsg`.
    """
    if check:
        import json

        from idlc.editor.protocol import initialize_result

        sys.stdout.write(json.dumps(initialize_result({}), indent=2) + "\n")
        return 0
    from idlc.cli.direct import serve_editor

    return serve_editor()
