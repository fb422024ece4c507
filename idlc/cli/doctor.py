"""`idlc doctor`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options


@click.command("doctor", epilog=options.example("idlc doctor"))
@options.scoped(options.include, options.distro, despite_errors=True)
@options.style
def command(**arguments: Any) -> None:
    """Check the installed programs, ROS 2 and packages.

    Each line begins with `ok` or `warn`, and a hint follows each warning. Attach the
    output of `--format json` to bug reports.
    """
    from idlc.cli.run.look import doctor

    return doctor(**arguments)
