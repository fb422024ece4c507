"""The entry point: commands of hooks at once, all others through click."""

import contextlib
import gc
import os
import sys
from collections.abc import Sequence

from idlc.version import __version__


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status."""
    if arguments is not None:
        return _run(list(arguments))
    status = _run(sys.argv[1:])
    # the program ends: another garbage collection would take longer than checking a file
    gc.freeze()
    if "zenoh" in sys.modules:
        # threads of Zenoh that wait for Python, which has ended by then, take up to ten seconds
        with contextlib.suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)
    return status


def _run(words: list[str]) -> int:
    try:
        return _dispatch(words)
    except KeyboardInterrupt:  # while modules are imported
        sys.stderr.write("interrupted\n")
        return 130


def _dispatch(words: list[str]) -> int:
    from idlc.cli.exit_status import status_of

    if words in (["--version"], ["-V"]):
        return status_of(lambda: print(f"idlc {__version__}"))
    if words[:1] == ["check"] and not any(word.startswith("-") for word in words):
        # hooks call this for each commit, and importing click takes longer than checking a file
        from idlc.cli.run.check import check_paths

        return status_of(lambda: check_paths(tuple(words[1:])))
    if words[:1] == ["lsp"]:
        words = [word for word in words if not _is_added_by_editor(word)]
    if words == ["lsp"]:
        from idlc.cli.run.lsp import serve_editor

        return status_of(serve_editor)
    from idlc.cli.app import run

    return run(words)


def _is_added_by_editor(word: str) -> bool:
    """Return whether a word is one that editors add to a server's command, without an effect."""
    return word == "--stdio" or word.startswith("--clientProcessId=")
