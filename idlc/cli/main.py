"""The entry point: the version at once, everything else through click."""

import sys
from collections.abc import Sequence

from idlc import __version__


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words in (["--version"], ["-V"]):
        sys.stdout.write(f"idlc {__version__}\n")
        return 0
    from idlc.cli.run import run

    return run(words)
