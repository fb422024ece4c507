"""The structures that rules check."""

from __future__ import annotations

from collections.abc import Iterable

from idlc.model import derive, ir
from idlc.model.link import Model


def sections(model: Model) -> Iterable[ir.Message]:
    """Return every structure of the model's own files."""
    return (part for interface in model.own for part in derive.sections(interface))
