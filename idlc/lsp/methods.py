"""Which function answers each request on documents, and what it is asked with.

The modules of features are imported when they are needed.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any, NamedTuple


class Method(NamedTuple):
    """A function of a module in `idlc.lsp.features`, and the type of what it is asked with."""

    module: str
    function: str
    params: str

    def prepare(self) -> ModuleType:
        """Import and return its module."""
        return import_module(f"idlc.lsp.features.{self.module}")

    def call(self, world: Any, params: object) -> object:
        """Return what the function answers; raises ValidationError for wrong parameters."""
        import msgspec

        asked = msgspec.convert(
            params, getattr(import_module("idlc.lsp.protocol.parts"), self.params)
        )
        answer: object = getattr(self.prepare(), self.function)(world, asked)
        return answer


METHODS = {
    "textDocument/diagnostic": Method("pull", "document", "OfDocument"),
    "workspace/diagnostic": Method("pull", "workspace", "AskedWorkspace"),
    "textDocument/completion": Method("completion", "complete", "AtPosition"),
    "completionItem/resolve": Method("completion", "resolve", "CompletionItem"),
    "textDocument/codeAction": Method("actions", "actions", "AskedActions"),
    "textDocument/prepareRename": Method("rename", "prepare", "AtPosition"),
    "textDocument/rename": Method("rename", "rename", "AskedRename"),
    "workspace/willRenameFiles": Method("rename", "files", "AskedFileRenames"),
    "workspace/executeCommand": Method("commands", "execute", "Command"),
    "textDocument/hover": Method("hover", "hover", "AtPosition"),
    "textDocument/definition": Method("navigation", "definition", "AtPosition"),
    "textDocument/typeDefinition": Method("navigation", "type_definition", "AtPosition"),
    "textDocument/references": Method("navigation", "references", "AskedReferences"),
    "textDocument/documentHighlight": Method("navigation", "highlights", "AtPosition"),
    "textDocument/documentSymbol": Method("symbols", "document", "OfDocument"),
    "workspace/symbol": Method("symbols", "workspace", "AskedSymbols"),
    "textDocument/inlayHint": Method("hints", "hints", "OfRange"),
    "textDocument/codeLens": Method("lenses", "lenses", "OfDocument"),
    "codeLens/resolve": Method("lenses", "resolve", "Lens"),
    "textDocument/semanticTokens/full": Method("tokens", "document", "OfDocument"),
    "textDocument/semanticTokens/range": Method("tokens", "part", "OfRange"),
    "textDocument/foldingRange": Method("structure", "folds", "OfDocument"),
    "textDocument/selectionRange": Method("structure", "selections", "AtPositions"),
    "textDocument/documentLink": Method("structure", "links", "OfDocument"),
    "workspace/textDocumentContent": Method("content", "text", "AskedContent"),
    "textDocument/formatting": Method("formatting", "document", "OfDocument"),
    "textDocument/rangeFormatting": Method("formatting", "part", "OfRange"),
    "textDocument/onTypeFormatting": Method("formatting", "typed", "AtPosition"),
}
