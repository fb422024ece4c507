"""Which function answers each request on documents, and what it is asked with.

The modules of features are imported when they are needed.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

from idlc.lsp import protocol


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
    "textDocument/diagnostic": Method("pull", "document", protocol.OfDocument),
    "workspace/diagnostic": Method("pull", "workspace", protocol.AskedWorkspace),
    "textDocument/completion": Method("completion", "complete", protocol.AtPosition),
    "textDocument/codeAction": Method("actions", "actions", protocol.AskedActions),
    "textDocument/prepareRename": Method("rename", "prepare", protocol.AtPosition),
    "textDocument/rename": Method("rename", "rename", protocol.AskedRename),
    "workspace/willRenameFiles": Method("rename", "files", protocol.AskedFileRenames),
    "workspace/executeCommand": Method("commands", "execute", protocol.Command),
    "textDocument/hover": Method("hover", "hover", protocol.AtPosition),
    "textDocument/definition": Method("navigation", "definition", protocol.AtPosition),
    "textDocument/typeDefinition": Method("navigation", "type_definition", protocol.AtPosition),
    "textDocument/references": Method("navigation", "references", protocol.AskedReferences),
    "textDocument/documentHighlight": Method("navigation", "highlights", protocol.AtPosition),
    "textDocument/documentSymbol": Method("symbols", "document", protocol.OfDocument),
    "workspace/symbol": Method("symbols", "workspace", protocol.AskedSymbols),
    "textDocument/inlayHint": Method("hints", "hints", protocol.OfRange),
    "textDocument/codeLens": Method("lenses", "lenses", protocol.OfDocument),
    "codeLens/resolve": Method("lenses", "resolve", protocol.Lens),
    "textDocument/semanticTokens/full": Method("tokens", "document", protocol.OfDocument),
    "textDocument/semanticTokens/range": Method("tokens", "part", protocol.OfRange),
    "textDocument/foldingRange": Method("structure", "folds", protocol.OfDocument),
    "textDocument/selectionRange": Method("structure", "selections", protocol.AtPositions),
    "textDocument/documentLink": Method("structure", "links", protocol.OfDocument),
    "workspace/textDocumentContent": Method("content", "text", protocol.AskedContent),
    "textDocument/formatting": Method("formatting", "document", protocol.OfDocument),
    "textDocument/rangeFormatting": Method("formatting", "part", protocol.OfRange),
    "textDocument/onTypeFormatting": Method("formatting", "typed", protocol.AtPosition),
}
