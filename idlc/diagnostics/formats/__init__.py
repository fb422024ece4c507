"""How a report is shown: as text and JSON lines by `terminal`, or as one whole document.

A module of the name of each format in DOCUMENTS has a function `document`.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from idlc.diagnostics.report import Diagnostic

#: What CI systems read.
DOCUMENTS = ("github", "sarif", "junit", "gitlab")


class Run(NamedTuple):
    """What a document tells besides problems: the command, idlc's version and the files read.

    `strict` is whether warnings fail as errors do.
    """

    command: str
    version: str
    files: tuple[str, ...] = ()
    strict: bool = False


def document(style: str, diagnostics: Iterable[Diagnostic], run: Run) -> str:
    """Return problems in one of the formats."""
    text: str = import_module(f"{__name__}.{style}").document(diagnostics, run)
    return text
