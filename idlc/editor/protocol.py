"""The Language Server Protocol: messages in a stream of bytes, errors, and capabilities.

A message is a header with the length, and JSON.
"""

from __future__ import annotations

import re
from typing import Any, BinaryIO

from idlc.version import __version__

PARSE_ERROR = -32700
INVALID_REQUEST = -32600
METHOD_NOT_FOUND = -32601
INVALID_PARAMS = -32602
INTERNAL_ERROR = -32603
NOT_INITIALIZED = -32002
CANCELLED = -32800
REQUEST_FAILED = -32803


class RequestError(Exception):
    """A request that cannot be answered: a code, and the reason in words for people."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.message = message


#: Bytes of the longest message that is read; a document has 16 MiB at most.
MAX_BODY = 128 << 20
#: Bytes of the longest line in a header.
MAX_LINE = 8192
_LENGTH = re.compile(rb"content-length\s*:\s*(\d{1,15})\s*", re.IGNORECASE)


def read(stream: BinaryIO) -> bytes | None:
    """Return the next message, `None` at the end of the stream; raises RequestError if it is long.

    Lines that are no header are skipped.
    """
    length = None
    while line := stream.readline(MAX_LINE):
        if match := _LENGTH.fullmatch(line):
            length = int(match[1])
        elif line in (b"\r\n", b"\n") and length is not None:
            return _body(stream, length)
    return None


def _body(stream: BinaryIO, length: int) -> bytes | None:
    if length <= MAX_BODY:
        body = stream.read(length)
        return body if len(body) == length else None
    while length > 0:
        passed = len(stream.read(min(length, 1 << 20)))
        if not passed:
            return None
        length -= passed
    raise RequestError(INVALID_REQUEST, "the message is too long")


def write(stream: BinaryIO, body: bytes) -> None:
    """Write a message and flush the stream."""
    stream.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
    stream.flush()


#: The kinds of words, and what is said of one.
TYPES = ["type", "struct", "property", "enumMember", "number", "string", "comment", "operator"]
TYPES += ["keyword", "namespace"]
MODIFIERS = ["declaration", "readonly", "defaultLibrary"]
#: The encodings in which positions can be counted, and the default of the protocol.
ENCODINGS = ("utf-8", "utf-16", "utf-32")
DEFAULT_ENCODING = "utf-16"
_REQUESTS = ("textDocument", "diagnostic")
#: The command that declares a package in package.xml, for what is completed.
ADD_DEPENDENCY = "idlc.addDependency"
#: The command that gives a document's file, and its interface, another name.
RENAME_FILE = "idlc.renameFile"
#: The command that runs `idlc gen` for a document, and the kind of action that offers it.
UPDATE_GENERATED = "idlc.updateGenerated"
UPDATE_KIND = "source.updateGenerated.idlc"


def encoding(client: dict[str, Any]) -> str:
    """Return the first encoding of positions that a client offers and the server supports."""
    general = client.get("general")
    offered = general.get("positionEncodings") if isinstance(general, dict) else None
    return next((name for name in offered or () if name in ENCODINGS), DEFAULT_ENCODING)


def supports(client: object, *path: str) -> bool:
    """Return whether a client has a capability, or names it in a list."""
    value: Any = client
    for name in path:
        if isinstance(value, list):
            value = name in value
        else:
            value = value.get(name) if isinstance(value, dict) else None
    return value not in (None, False)


def requests_problems(client: object) -> bool:
    """Return whether a client requests problems, and does so again when the server asks for it.

    Others request those of a document when it changes. They would keep showing an error that a
    change elsewhere removed, so they get all problems pushed.
    """
    refreshes = supports(client, "workspace", "diagnostics", "refreshSupport")
    return refreshes and supports(client, *_REQUESTS)


def initialize_result(client: dict[str, Any]) -> dict[str, object]:
    """Return the answer to `initialize` for what a client can do."""
    own = {"positionEncoding": encoding(client), **CAPABILITIES}
    if supports(client, *_REQUESTS) and not requests_problems(client):
        del own["diagnosticProvider"]  # or the client shows what it requested beside what is pushed
    return {"capabilities": own, "serverInfo": {"name": "idlc", "version": __version__}}


_INTERFACE_FILES = {"filters": [{"pattern": {"glob": "**/*.{msg,srv,action}"}}]}
CAPABILITIES: dict[str, object] = {
    "textDocumentSync": {"openClose": True, "change": 2, "save": {"includeText": False}},
    "diagnosticProvider": {
        "identifier": "idlc",
        "interFileDependencies": True,
        "workspaceDiagnostics": True,
    },
    "completionProvider": {"triggerCharacters": ["/", "=", "[", "(", " "], "resolveProvider": True},
    "codeActionProvider": {"codeActionKinds": ["quickfix", "source.fixAll.idlc", UPDATE_KIND]},
    "renameProvider": {"prepareProvider": True},
    "inlayHintProvider": True,
    "codeLensProvider": {"resolveProvider": True},
    "semanticTokensProvider": {
        "legend": {"tokenTypes": TYPES, "tokenModifiers": MODIFIERS},
        "full": True,
        "range": True,
    },
    "foldingRangeProvider": True,
    "selectionRangeProvider": True,
    "documentLinkProvider": {},
    "executeCommandProvider": {"commands": [ADD_DEPENDENCY, RENAME_FILE, UPDATE_GENERATED]},
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
        "fileOperations": {"willRename": _INTERFACE_FILES, "didRename": _INTERFACE_FILES},
        "workspaceFolders": {"supported": True, "changeNotifications": True},
    },
}
