"""Structures of the Language Server Protocol (3.17): what clients send, and parts of answers.

Names are the protocol's, with underscores in Python.
"""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
from msgspec import Meta

Number = Annotated[int, Meta(ge=0)]


class Part(msgspec.Struct, rename="camel", omit_defaults=True, frozen=True):
    """A part of a message, encoded in camel case and without values that are defaults."""


class Position(Part, frozen=True, order=True):
    """A place in a document: line and character from 0, in units of the agreed encoding."""

    line: Number
    character: Number


class Range(Part, frozen=True):
    """From one position up to another."""

    start: Position
    end: Position


class Location(Part, frozen=True):
    """A range in a document."""

    uri: str
    range: Range


class TextEdit(Part, frozen=True):
    """A range and the text that replaces it."""

    range: Range
    new_text: str


class Uri(Part, frozen=True):
    """A document, file or folder."""

    uri: str


class VersionedUri(Uri, frozen=True):
    """A document, with its version where the sender knows it."""

    version: int | None = None


class DocumentItem(Part, frozen=True):
    """A document with its text."""

    uri: str
    language_id: str
    version: int
    text: str


class Change(Part, frozen=True):
    """A new text for a range, or for the whole document."""

    text: str
    range: Range | None = None


class DidOpen(Part, frozen=True):
    """textDocument/didOpen."""

    text_document: DocumentItem


class DocumentParams(Part, frozen=True):
    """The parameters of a request about a whole document."""

    text_document: VersionedUri


class DidChange(DocumentParams, frozen=True):
    """textDocument/didChange."""

    content_changes: tuple[Change, ...]


class PositionParams(DocumentParams, frozen=True):
    """The parameters of a request about a position in a document."""

    position: Position


class PositionsParams(DocumentParams, frozen=True):
    """The parameters of a request about several positions in a document."""

    positions: tuple[Position, ...]


class RangeParams(DocumentParams, frozen=True):
    """The parameters of a request about a range of a document."""

    range: Range


class ReferenceContext(Part, frozen=True):
    """The context of a request for references, which may include the definition."""

    include_declaration: bool = True


class ReferenceParams(PositionParams, frozen=True):
    """textDocument/references."""

    context: ReferenceContext = ReferenceContext()


class ActionContext(Part, frozen=True):
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


class WorkspaceDiagnosticParams(Part, frozen=True):
    """workspace/diagnostic."""

    previous_result_ids: tuple[PreviousResult, ...] = ()


class WorkspaceSymbolParams(Part, frozen=True):
    """workspace/symbol."""

    query: str = ""


class FileRename(Part, frozen=True):
    """The old and the new URI of a file."""

    old_uri: str
    new_uri: str


class RenameFilesParams(Part, frozen=True):
    """workspace/willRenameFiles."""

    files: tuple[FileRename, ...]


class Command(Part, frozen=True):
    """workspace/executeCommand."""

    command: str
    arguments: tuple[Any, ...] = ()


class Lens(Part, frozen=True):
    """A text above a line; it gets its `command`, which has the text, when it is shown."""

    range: Range
    command: dict[str, str] | None = None
    data: Any = None


#: completionItem/resolve: the item as the server sent it, with additions of the client.
CompletionItem = dict[str, Any]


class Initialize(Part, frozen=True):
    """A client's capabilities, settings and folders."""

    root_uri: str | None = None
    capabilities: dict[str, Any] = {}
    initialization_options: Any = None
    workspace_folders: tuple[Uri, ...] | None = None


class FolderChanges(Part, frozen=True):
    """The folders that were added to the workspace, and the removed ones."""

    added: tuple[Uri, ...]
    removed: tuple[Uri, ...]


class DidChangeFolders(Part, frozen=True):
    """workspace/didChangeWorkspaceFolders."""

    event: FolderChanges


class DidChangeFiles(Part, frozen=True):
    """workspace/didChangeWatchedFiles."""

    changes: tuple[Uri, ...]


class DidChangeSettings(Part, frozen=True):
    """workspace/didChangeConfiguration."""

    settings: Any = None
