"""`idlc lsp`, free of click and of all that the server imports when it needs it."""

from __future__ import annotations

import json
import sys

from idlc.editor.protocol import initialize_result
from idlc.editor.server import serve


def serve_editor() -> int:
    """Serve the client at the other end of standard input and output; return the exit status."""
    if sys.stdin.isatty():
        sys.stderr.write(
            "the language server waits for an editor on standard input; press Ctrl-C to stop it\n"
        )
    # a thread may still read when the program ends, so it is not sys.stdin that it waits in, and
    # what it waits in is never closed
    reader = open(sys.stdin.fileno(), "rb", closefd=False)  # noqa: SIM115
    # nor does anything stay in sys.stdout that cannot be written when the program ends
    writer = open(sys.stdout.fileno(), "wb", closefd=False)  # noqa: SIM115
    return serve(reader, writer)


def show_capabilities() -> int:
    """Write what the server can do; return the exit status."""
    sys.stdout.write(json.dumps(initialize_result({}), indent=2) + "\n")
    return 0
