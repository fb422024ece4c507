"""The body of `idlc lsp`, free of click."""

from __future__ import annotations

import sys


def run() -> int:
    """Serve the client at the other end of standard input and output; return the exit status."""
    from idlc.lsp.server import serve

    if sys.stdin.isatty():
        sys.stderr.write("an editor starts this, and talks to it; Ctrl-C ends it\n")
    # a thread may still read when the program ends, so it is not sys.stdin that it waits in, and
    # what it waits in is never closed
    reader = open(sys.stdin.fileno(), "rb", closefd=False)  # noqa: SIM115
    # nor does anything stay in sys.stdout that cannot be written when the program ends
    writer = open(sys.stdout.fileno(), "wb", closefd=False)  # noqa: SIM115
    return serve(reader, writer)
