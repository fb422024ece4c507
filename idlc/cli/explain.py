"""`idlc explain`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import completion, options


@click.command("explain", epilog=options.example("idlc explain wide-string"))
@click.argument("code", metavar="[CODE]", required=False, shell_complete=completion.codes)
@click.option("--all", "everything", is_flag=True, help="Print all rules as one Markdown document.")
def command(**arguments: Any) -> int:
    """Explain what a rule reports and why, with a bad and a good example.

    CODE is an id such as IDL201 or a name such as unknown-type. Without CODE, idlc lists all rules.
    """
    from idlc.cli.run.look import explain

    return explain(**arguments)
