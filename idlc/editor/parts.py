"""Structures of the Language Server Protocol (3.17): what clients send, and parts of answers.

Names are the protocol's, with underscores in Python.
"""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
from msgspec import Meta

UInteger = Annotated[int, Meta(ge=0)]


class ProtocolStruct(msgspec.Struct, rename="camel", omit_defaults=True, frozen=True):
    """A part of a message, encoded in camel case and without values that are defaults."""


class Position(ProtocolStruct, frozen=True, order=True):
    """A place in a document: line and character from 0, in units of the agreed encoding."""

    line: UInteger
    character: UInteger


class Range(ProtocolStruct, frozen=True):
    """From one position up to another."""

    start: Position
    end: Position


class Location(ProtocolStruct, frozen=True):
    """A range in a document."""

    uri: str
    range: Range


class TextEdit(ProtocolStruct, frozen=True):
    """A range and the text that replaces it."""

    range: Range
    new_text: str


class Uri(ProtocolStruct, frozen=True):
    """A document, file or folder."""

    uri: str


class VersionedUri(Uri, frozen=True):
    """A document, with its version where the sender knows it."""

    version: int | None = None


class DocumentItem(ProtocolStruct, frozen=True):
    """A document with its text."""

    uri: str
    language_id: str
    version: int
    text: str


class ContentChange(ProtocolStruct, frozen=True):
    """A new text for a range, or for the whole document."""

    text: str
    range: Range | None = None


class DidOpen(ProtocolStruct, frozen=True):
    """textDocument/didOpen."""

    text_document: DocumentItem


class DocumentParams(ProtocolStruct, frozen=True):
    """The parameters of a request about a whole document."""

    text_document: VersionedUri


class DidChange(DocumentParams, frozen=True):
    """textDocument/didChange."""

    content_changes: tuple[ContentChange, ...]


class PositionParams(DocumentParams, frozen=True):
    """The parameters of a request about a position in a document."""

    position: Position


class PositionsParams(DocumentParams, frozen=True):
    """The parameters of a request about several positions in a document."""

    positions: tuple[Position, ...]


class RangeParams(DocumentParams, frozen=True):
    """The parameters of a request about a range of a document."""

    range: Range


class ReferenceContext(ProtocolStruct, frozen=True):
    """The context of a request for references, which may include the definition."""

    include_declaration: bool = True


class ReferenceParams(PositionParams, frozen=True):
    """textDocument/references."""

    context: ReferenceContext = ReferenceContext()


class ActionContext(ProtocolStruct, frozen=True):
    """The kinds of actions that are requested; all without `only`."""

    only: tuple[str, ...] | None = None


class CodeActionParams(RangeParams, frozen=True):
    """textDocument/codeAction."""

    context: ActionContext = ActionContext()


class RenameParams(PositionParams, frozen=True):
    """textDocument/rename."""

    new_name: str


class PreviousResult(Uri, frozen=True):
    """An earlier answer on a document."""

    value: str


class WorkspaceDiagnosticParams(ProtocolStruct, frozen=True):
    """workspace/diagnostic."""

    previous_result_ids: tuple[PreviousResult, ...] = ()


class WorkspaceSymbolParams(ProtocolStruct, frozen=True):
    """workspace/symbol."""

    query: str = ""


class FileRename(ProtocolStruct, frozen=True):
    """The old and the new URI of a file."""

    old_uri: str
    new_uri: str


class RenameFilesParams(ProtocolStruct, frozen=True):
    """workspace/willRenameFiles."""

    files: tuple[FileRename, ...]


class CommandParams(ProtocolStruct, frozen=True):
    """workspace/executeCommand."""

    command: str
    arguments: tuple[Any, ...] = ()


class Lens(ProtocolStruct, frozen=True):
    """A text above a line; it gets its `command`, which has the text, when it is shown."""

    range: Range
    command: dict[str, str] | None = None
    data: Any = None


#: completionItem/resolve: the item as the server sent it, with additions of the client.
CompletionItem = dict[str, Any]


class Initialize(ProtocolStruct, frozen=True):
    """A client's capabilities, settings and folders."""

    root_uri: str | None = None
    capabilities: dict[str, Any] = {}
    initialization_options: Any = None
    workspace_folders: tuple[Uri, ...] | None = None


class FolderChanges(ProtocolStruct, frozen=True):
    """The folders that were added to the workspace, and the removed ones."""

    added: tuple[Uri, ...]
    removed: tuple[Uri, ...]


class DidChangeFolders(ProtocolStruct, frozen=True):
    """workspace/didChangeWorkspaceFolders."""

    event: FolderChanges


class DidChangeFiles(ProtocolStruct, frozen=True):
    """workspace/didChangeWatchedFiles."""

    changes: tuple[Uri, ...]


class DidChangeSettings(ProtocolStruct, frozen=True):
    """workspace/didChangeConfiguration."""

    settings: Any = None
