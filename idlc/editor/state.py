"""The state of a language server: documents, workspaces, client capabilities and settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from idlc.diagnostics.source import Source, Span
from idlc.editor import parts, protocol
from idlc.editor.documents import Document, Places, file_of, inside, is_built_in, places, to_path
from idlc.editor.protocol import INVALID_REQUEST, RequestError
from idlc.editor.workspace import (
    OTHER_INPUTS,
    EditorSettings,
    Snapshot,
    Workspace,
    in_folder,
    stray_folder,
)
from idlc.language.tree import BYTE_ORDER_MARK
from idlc.model import ir
from idlc.model.link import Model
from idlc.project.find import KINDS, RULES
from idlc.project.root import Root

#: The files to watch on disk: all that a check may read.
WATCHED = (
    "**/*.{msg,srv,action}",
    f"**/{{{','.join(OTHER_INPUTS)}}}",
    f"**/{RULES}/*.py",
)
#: Problems that the client may have dropped, as it does with a document that it opens again. They
#: are published again, or withdrawn if there are none.
_DROPPED: tuple[int | None, bytes] = (None, b"")
#: A client's name for showing documents which are no files.
CONTENT = "textDocumentContent"


class InterfaceContext(NamedTuple):
    """A file that is checked: its workspace, the interface that it defines, and its text.

    `snapshot` is the workspace at this moment.
    """

    state: ServerState
    workspace: Workspace
    snapshot: Snapshot
    interface: ir.Interface
    source: Source

    @property
    def path(self) -> Path:
        """The file."""
        return self.snapshot.path_of(self.source)

    @property
    def model(self) -> Model | None:
        """A model of the interface, `None` if there are errors."""
        return self.snapshot.model_of(self.interface)


class Renaming(NamedTuple):
    """The last file that the client was requested to rename, with the edits of its users.

    `text` is the text after the edits of the document at `uri`, in which the user requested it.
    """

    old: Path
    new: Path
    uri: str
    text: str


class ServerState:
    """The state between the messages of a client; features read it to answer requests.

    `initialize` holds the parameters of that request. `notify` and `ask` send a method with its
    parameters to the client; `ask` may have a function that takes the answer.
    """

    def __init__(
        self, initialize: dict[str, Any], notify: Callable[..., None], ask: Callable[..., None]
    ) -> None:
        self.notify = notify
        self.ask = ask
        self.root = Root.here()
        self.documents: dict[str, Document] = {}
        self.settings = EditorSettings()
        self.renaming: Renaming | None = None
        #: Whether problems may have changed since they were published.
        self.is_changed = False
        #: The problems that were published for each document, and the document's version then.
        self.published: dict[str, tuple[int | None, bytes]] = {}
        #: What other documents decide of the features' answers for each document, and the
        #: document's version then.
        self.fingerprints: dict[str, tuple[int | None, object]] = {}
        self._folders: dict[Path, Workspace] = {}
        self._strays: dict[tuple[Path, tuple[str, ...]], Workspace] = {}
        self._notifications: dict[str, tuple[type, Callable[[Any], None]]] = {
            "textDocument/didOpen": (parts.DidOpen, self._open),
            "textDocument/didChange": (parts.DidChange, self._change),
            "textDocument/didSave": (parts.DocumentParams, lambda _: self.forget()),
            "textDocument/didClose": (parts.DocumentParams, self._close),
            "workspace/didChangeWatchedFiles": (parts.DidChangeFiles, self._change_files),
            "workspace/didRenameFiles": (parts.RenameFilesParams, self._rename_files),
            "workspace/didChangeWorkspaceFolders": (parts.DidChangeFolders, self._change_folders),
            "workspace/didChangeConfiguration": (parts.DidChangeSettings, self._change_settings),
            "initialized": (dict, self._initialized),
        }
        try:
            client = msgspec.convert(initialize, parts.Initialize)
        except msgspec.ValidationError:  # malformed capabilities from the client
            client = parts.Initialize()
        self.client = client.capabilities
        self.encoding = protocol.encoding(client.capabilities)
        watching = ("workspace", "didChangeWatchedFiles", "dynamicRegistration")
        self.is_watching = self.supports(*watching)
        self._use_settings(client.initialization_options)
        folders = client.workspace_folders
        if folders is None:
            folders = (parts.Uri(client.root_uri),) if client.root_uri else ()
        self._change_folders(parts.DidChangeFolders(parts.FolderChanges(folders, ())))

    def handle_notification(self, name: str, params: object) -> None:
        """Handle a notification; unknown ones are ignored."""
        if name in self._notifications:
            kind, handler = self._notifications[name]
            handler(msgspec.convert(params, kind))

    def supports(self, *path: str) -> bool:
        """Return whether the client has a capability, or names it in a list."""
        return protocol.supports(self.client, *path)

    def refresh(self, what: str) -> None:
        """Have the client request a feature again, such as `codeLens`, if it can."""
        if self.supports("workspace", what, "refreshSupport"):
            self.ask(f"workspace/{what}/refresh", None)

    # Workspaces: the client's, and one for each open file outside of them.

    def workspaces(self) -> list[Workspace]:
        """Return the workspaces of the client's folders and of stray files, innermost first."""
        strays: dict[Path, set[str]] = {}
        own = self._folders.values()
        for path in filter(None, (document.path for document in self.documents.values())):
            if path.suffix in KINDS and not any(workspace.lists(path) for workspace in own):
                folder, paths = stray_folder(path)
                strays.setdefault(folder, set()).update(paths)
        keys = [(folder, tuple(sorted(paths))) for folder, paths in strays.items()]
        self._strays = {key: self._strays.get(key) or self._workspace(*key) for key in keys}
        return self._known_workspaces()

    def workspace_of(self, path: Path) -> Workspace | None:
        """Return the innermost workspace that holds a file."""
        return next((workspace for workspace in self.workspaces() if workspace.holds(path)), None)

    def snapshots(self) -> Iterator[Snapshot]:
        """Yield the snapshot of each folder that can be read."""
        return filter(None, (workspace.snapshot() for workspace in self.workspaces()))

    def forget(self) -> None:
        """Have all folders read again when they are needed."""
        self.is_changed = True
        for workspace in self._known_workspaces():
            workspace.forget()

    def notice_changes(self) -> bool:
        """Have folders that changed on disk read again; return whether any did."""
        known = self._known_workspaces()
        changed = [workspace for workspace in known if not workspace.is_current()]
        for workspace in changed:
            workspace.forget()
        self.is_changed |= bool(changed)
        return bool(changed)

    def _known_workspaces(self) -> list[Workspace]:
        """Return the workspaces that `workspaces` returned last, in that order."""
        every = (*self._folders.values(), *self._strays.values())
        return sorted(every, key=lambda workspace: len(workspace.folder.parts), reverse=True)

    def _workspace(self, folder: Path, paths: tuple[str, ...] = ()) -> Workspace:
        return Workspace(folder, self.settings, self.texts, paths)

    def _add(self, folders: Iterable[Path]) -> None:
        """Add folders of the workspace, but no whole disk or home, which would take minutes."""
        for folder in folders:
            if folder not in (folder.parent, Path.home()):
                self._folders.setdefault(folder, self._workspace(folder))
        self._strays.clear()

    def _change_folders(self, params: parts.DidChangeFolders) -> None:
        for path in filter(None, (to_path(folder.uri) for folder in params.event.removed)):
            self._folders.pop(path, None)
        self._add(filter(None, (to_path(folder.uri) for folder in params.event.added)))
        self.is_changed = True

    # Documents and files.

    def context(self, uri: str) -> InterfaceContext | None:
        """Return the context of an interface file; `None` if it is not checked."""
        path = self.path(uri)
        workspace = self.workspace_of(path) if path else None
        snapshot = workspace.snapshot() if workspace else None
        if not (path and workspace and snapshot and path in snapshot.interfaces):
            return None
        return InterfaceContext(self, workspace, snapshot, *snapshot.interfaces[path])

    def path(self, uri: str) -> Path | None:
        """Return the path of a document."""
        document = self.documents.get(uri)
        return document.path if document else to_path(uri)

    def document_at(self, path: Path) -> Document | None:
        """Return the open document of a file; of two URIs for it, the one opened last."""
        opened = reversed(self.documents.values())
        return next((document for document in opened if document.path == path), None)

    def texts(self) -> dict[Path, bytes]:
        """Return the texts that count instead of the files on disk."""
        documents = self.documents.values()
        return {document.path: document.data for document in documents if document.path is not None}

    def uri(self, path: Path) -> str:
        """Return the URI of a file, as the client spells it if it is open."""
        document = self.document_at(path)
        return document.uri if document else path.as_uri()

    def offset(self, source: Source, position: parts.Position) -> int:
        """Return the character of a text at a position."""
        return self._places(source).offset(position)

    def range(self, span: Span) -> parts.Range:
        """Return the range of a span."""
        return self._places(span.source).range(span.start, span.end)

    def _places(self, source: Source) -> Places:
        """Return the places of a text; a client that keeps byte order marks counts them."""
        skips_mark = source.text.startswith(BYTE_ORDER_MARK) and not any(
            document.text.startswith(BYTE_ORDER_MARK) for document in self.documents.values()
        )
        return places(source.text, self.encoding, skips_mark=skips_mark)

    def location(self, span: Span, folder: Path) -> parts.Location:
        """Return the location of a span; a built-in interface is a document without a file.

        For clients that cannot show such a document, it is a file of the user's cache.
        """
        source = span.source
        if is_built_in(source):
            path = None if self.supports("workspace", CONTENT) else file_of(source)
            uri = path.as_uri() if path else f"idlc:/{inside(source)}"
            return parts.Location(uri, self.range(span))
        return parts.Location(self.uri(in_folder(folder, source.path)), self.range(span))

    def _open(self, params: parts.DidOpen) -> None:
        document = Document(params.text_document, self.root)
        self.documents[document.uri] = document
        self.published[document.uri] = _DROPPED
        self._follow(document.path, document.data)

    def _change(self, params: parts.DidChange) -> None:
        document = self.documents.get(params.text_document.uri)
        if document is None:
            raise RequestError(INVALID_REQUEST, f"{params.text_document.uri} is not open")
        document.version = params.text_document.version
        document.change(params.content_changes, self.encoding)
        self._follow(document.path, document.data)

    def _close(self, params: parts.DocumentParams) -> None:
        document = self.documents.pop(params.text_document.uri, None)
        if document is not None:
            self._follow(document.path)

    def _follow(self, path: Path | None, data: bytes | None = None) -> None:
        """Use a new text for a file; without one, that on disk, or of a document still open."""
        self.is_changed = True
        if path is not None:
            for workspace in self._known_workspaces():
                workspace.follow(path, data)

    def _change_files(self, params: parts.DidChangeFiles) -> None:
        for change in params.changes:
            self._follow(to_path(change.uri))

    def _rename_files(self, params: parts.RenameFilesParams) -> None:
        for file in params.files:
            self._follow(to_path(file.old_uri))
            self._follow(to_path(file.new_uri))

    def refresh_moved_lenses(self) -> None:
        """Have lenses requested again if the revision that they compare with has moved."""
        if [workspace for workspace in self._known_workspaces() if workspace.has_moved()]:
            self.refresh("codeLens")

    # Settings.

    def _initialized(self, _: object) -> None:
        """Register for changes of files and settings, and fetch the settings."""
        watchers = [{"globPattern": pattern} for pattern in WATCHED]
        options: dict[str, object] = {
            "didChangeWatchedFiles": {"watchers": watchers},
            "didChangeConfiguration": {"section": "idlc"},
        }
        registrations = [
            {"id": method, "method": method, "registerOptions": options[name]}
            for name in options
            if self.supports("workspace", name, "dynamicRegistration")
            for method in [f"workspace/{name}"]
        ]
        if registrations:
            self.ask("client/registerCapability", {"registrations": registrations})
        self._change_settings(parts.DidChangeSettings())

    def _change_settings(self, params: parts.DidChangeSettings) -> None:
        """Fetch the settings, or use those that a client sends which answers no such request."""
        if self.supports("workspace", "configuration"):
            query = {"items": [{"section": "idlc"}]}
            self.ask("workspace/configuration", query, lambda items: self._use_settings(*items[:1]))
        else:
            self._use_settings(params.settings)

    def _use_settings(self, settings: object = None) -> None:
        """Use settings; an editor without any sends `null`."""
        if settings is None:
            return
        self.is_changed = True
        own = settings.get("idlc", settings) if isinstance(settings, dict) else {}
        before = self.settings
        try:
            self.settings = msgspec.convert(own, EditorSettings)
        except msgspec.ValidationError as error:
            message = f"invalid settings for idlc: {error}"
            self.notify("window/showMessage", {"type": 2, "message": message})
        if self.settings != before:
            folders, self._folders = self._folders, {}
            self._add(folders)
