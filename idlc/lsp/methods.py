"""Which function answers each request on documents, and what it is asked with.

The modules of features are imported when they are needed.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

from idlc.lsp.protocol import AskedDocument, AskedWorkspace


class Method(NamedTuple):
    """A function of a module in `idlc.lsp.features`, and the type of what it is asked with."""

    module: str
    function: str
    params: Any

    def load(self) -> Callable[..., Any]:
        """Return the function, which takes the world and what it is asked with."""
        found: Callable[..., Any] = getattr(
            import_module(f"idlc.lsp.features.{self.module}"), self.function
        )
        return found


METHODS = {
    "textDocument/diagnostic": Method("pull", "document", AskedDocument),
    "workspace/diagnostic": Method("pull", "workspace", AskedWorkspace),
}
