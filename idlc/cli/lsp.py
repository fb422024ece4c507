"""`idlc lsp`."""

from __future__ import annotations

import click

from idlc.cli import options


@click.command("lsp", epilog=options.example("idlc lsp --check"))
@click.option("--check", is_flag=True, help="Print the server's capabilities as JSON, and exit.")
def command(check: bool) -> int:
    """Run the language server on standard input and output. Your editor starts it.

    The server implements the Language Server Protocol 3.17. It reads [tool.idlc] and the editor's
    settings. The language id of .msg, .srv and .action files is `rosmsg`.
    """
    from idlc.cli.run.lsp import serve_editor, show_capabilities

    return show_capabilities() if check else serve_editor()
