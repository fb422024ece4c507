"""Run a command with the options that click read."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from idlc.cli.app import app
from idlc.cli.exit_status import ended


def run(words: list[str]) -> int:
    """Run a command and return the exit status."""
    return ended(lambda: _through_click(words))


def _through_click(words: list[str]) -> object:
    try:
        return app.main(words, prog_name=_called_as(), standalone_mode=False)
    except click.ClickException as error:
        error.show()
        return 2
    except click.Abort as error:
        raise KeyboardInterrupt from error


def _called_as() -> str:
    name = Path(sys.argv[0]).stem
    return name if name == "rosidlc" else "idlc"
