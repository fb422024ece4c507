"""What client and server can do, as they say it to each other."""

from __future__ import annotations

from typing import Any

from idlc import __version__
from idlc.lsp import dependencies, positions, token_kinds
from idlc.lsp.world import World


def encoding(client: dict[str, Any]) -> str:
    """Return the first encoding of positions that a client offers and the server knows."""
    general = client.get("general")
    offered = general.get("positionEncodings") if isinstance(general, dict) else None
    known = [one for one in offered or () if one in positions.ENCODINGS]
    return known[0] if known else positions.DEFAULT


def pulls(world: World) -> bool:
    """Return whether the client asks for problems itself; it would show pushed ones again."""
    return world.supports("textDocument", "diagnostic")


def answer(world: World) -> dict[str, object]:
    """Return the answer to `initialize`."""
    return {
        "capabilities": {"positionEncoding": world.encoding, **CAPABILITIES},
        "serverInfo": {"name": "idlc", "version": __version__},
    }


CAPABILITIES: dict[str, object] = {
    "textDocumentSync": {"openClose": True, "change": 2, "save": {"includeText": False}},
    "diagnosticProvider": {
        "identifier": "idlc",
        "interFileDependencies": True,
        "workspaceDiagnostics": True,
    },
    "completionProvider": {"triggerCharacters": ["/", "=", "[", "(", " "]},
    "codeActionProvider": {"codeActionKinds": ["quickfix", "source.fixAll.idlc"]},
    "renameProvider": {"prepareProvider": True},
    "inlayHintProvider": True,
    "codeLensProvider": {"resolveProvider": True},
    "semanticTokensProvider": {
        "legend": {"tokenTypes": token_kinds.TYPES, "tokenModifiers": token_kinds.MODIFIERS},
        "full": True,
        "range": True,
    },
    "foldingRangeProvider": True,
    "selectionRangeProvider": True,
    "documentLinkProvider": {},
    "executeCommandProvider": {"commands": [dependencies.COMMAND]},
    "hoverProvider": True,
    "definitionProvider": True,
    "typeDefinitionProvider": True,
    "referencesProvider": True,
    "documentHighlightProvider": True,
    "documentSymbolProvider": True,
    "workspaceSymbolProvider": True,
    "documentFormattingProvider": True,
    "documentRangeFormattingProvider": True,
    "documentOnTypeFormattingProvider": {"firstTriggerCharacter": "\n"},
    "workspace": {
        "textDocumentContent": {"schemes": ["idlc"]},
        "fileOperations": {
            "willRename": {"filters": [{"pattern": {"glob": "**/*.{msg,srv,action}"}}]}
        },
        "workspaceFolders": {"supported": True, "changeNotifications": True},
    },
}
