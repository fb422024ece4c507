"""The state of a language server: documents, workspaces, client capabilities and settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from idlc.diagnostics.source import Source, Span
from idlc.editor.documents import Document, Documents, file_of, inside, is_built_in
from idlc.editor.protocol import capabilities, positions, uris
from idlc.editor.protocol.framing import INVALID_REQUEST, RequestError
from idlc.editor.protocol.parts import (
    DidChange,
    DidChangeFiles,
    DidChangeFolders,
    DidChangeSettings,
    DidOpen,
    DocumentParams,
    Folder,
    Initialize,
    Location,
    Position,
    Range,
    RenameFilesParams,
)
from idlc.editor.workspace import OTHER_INPUTS, EditorOptions, Snapshot, Workspace, stray_folder
from idlc.model import ir
from idlc.project.find import KINDS
from idlc.project.root import Root

#: The files to watch on disk: all that a check may read.
WATCHED = ("**/*.{msg,srv,action}", f"**/{{{','.join(OTHER_INPUTS)}}}")
#: A client's name for watches of folders which are not below the workspace's.
RELATIVE = "relativePatternSupport"
#: A client's name for showing documents which are no files.
CONTENT = "textDocumentContent"


class Settings(EditorOptions, frozen=True, rename="camel", kw_only=True):
    """An editor's settings below `idlc`: options of `idlc check`, and of features.

    `against` is the version that the lens on breaking changes compares with.
    """

    inlay_hints: bool = True
    code_lens: bool = True
    default_lens: bool = True
    against: str = ""


class InterfaceContext(NamedTuple):
    """An interface file: the snapshot of its folder, the interface that it defines, its text."""

    snapshot: Snapshot
    interface: ir.Interface
    source: Source


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
        self,
        initialize: dict[str, Any],
        notify: Callable[..., None],
        ask: Callable[..., None],
    ) -> None:
        self.notify = notify
        self.ask = ask
        self.documents = Documents(Root.here())
        self.settings = Settings()
        self.renaming: Renaming | None = None
        #: Folders that lenses compare with a revision, with git's folders of references for each.
        self.repositories: dict[Path, tuple[Path, ...]] = {}
        #: Whether problems may have changed since they were published.
        self.is_changed = False
        #: Whether the client was requested to report changes on disk.
        self.is_watching = False
        #: The problems that were published for each document, and the document's version then.
        self.published: dict[str, tuple[int | None, bytes]] = {}
        #: A checksum of the features' answers for each document, and the document's version then.
        self.fingerprints: dict[str, tuple[int | None, int]] = {}
        self._options = EditorOptions()
        self._folders: dict[Path, Workspace] = {}
        self._strays: dict[tuple[Path, tuple[str, ...]], Workspace] = {}
        self._notifications: dict[str, tuple[type, Callable[[Any], None]]] = {
            "textDocument/didOpen": (DidOpen, self._open),
            "textDocument/didChange": (DidChange, self._change),
            "textDocument/didSave": (DocumentParams, self._save),
            "textDocument/didClose": (DocumentParams, self._close),
            "workspace/didChangeWatchedFiles": (DidChangeFiles, self._change_files),
            "workspace/didRenameFiles": (RenameFilesParams, self._rename_files),
            "workspace/didChangeWorkspaceFolders": (DidChangeFolders, self._change_folders),
            "workspace/didChangeConfiguration": (DidChangeSettings, self._change_settings),
            "initialized": (dict, self._initialized),
        }
        try:
            client = msgspec.convert(initialize, Initialize)
        except msgspec.ValidationError:  # malformed capabilities from the client
            client = Initialize()
        self.client = client.capabilities
        self.encoding = capabilities.encoding(client.capabilities)
        self._use_settings(client.initialization_options)
        folders = [folder.uri for folder in client.workspace_folders or ()]
        if client.workspace_folders is None:
            folders = [client.root_uri] if client.root_uri else []
        self._replace_folders([Folder(uri) for uri in folders], [])

    def handle_notification(self, name: str, params: object) -> None:
        """Handle a notification; unknown ones are ignored."""
        kind, handler = self._notifications.get(name, (None, None))
        if kind is not None and handler is not None:
            handler(msgspec.convert(params, kind))

    def supports(self, *path: str) -> bool:
        """Return whether the client has a capability, or names it in a list."""
        return capabilities.supports(self.client, *path)

    def refresh(self, what: str) -> None:
        """Have the client request a feature again, such as `codeLens`, if it can."""
        if self.supports("workspace", what, "refreshSupport"):
            self.ask(f"workspace/{what}/refresh", None)

    # Workspaces: the client's, and one for each open file outside of them.

    def workspaces(self) -> list[Workspace]:
        """Return the workspaces of the client's folders and of stray files, innermost first."""
        strays: dict[Path, list[tuple[str, ...]]] = {}
        for document in self.documents:
            path = document.path
            if path is None or path.suffix not in KINDS:
                continue
            if not any(workspace.holds(path) for workspace in self._folders.values()):
                folder, paths = stray_folder(path)
                strays.setdefault(folder, []).append(paths)
        folders = {(folder, _together(paths)): folder for folder, paths in strays.items()}
        self._strays = {
            key: self._strays.get(key) or self._workspace(folder, key[1])
            for key, folder in folders.items()
        }
        return self._known_workspaces()

    def workspace_of(self, path: Path) -> Workspace | None:
        """Return the innermost workspace that holds a file."""
        return next((workspace for workspace in self.workspaces() if workspace.holds(path)), None)

    def forget(self) -> None:
        """Have all folders read again when they are needed."""
        self.is_changed = True
        for workspace in self._known_workspaces():
            workspace.forget()

    def notice_changes(self) -> bool:
        """Have folders that changed on disk read again; return whether any did."""
        changed = [
            workspace for workspace in self._known_workspaces() if not workspace.is_current()
        ]
        for workspace in changed:
            workspace.forget()
        self.is_changed |= bool(changed)
        return bool(changed)

    def _known_workspaces(self) -> list[Workspace]:
        """Return the workspaces that `workspaces` returned last, in that order."""
        every = (*self._folders.values(), *self._strays.values())
        return sorted(every, key=lambda workspace: len(workspace.folder.parts), reverse=True)

    def _workspace(self, folder: Path, paths: tuple[str, ...] = ()) -> Workspace:
        return Workspace(folder, self._options, self.documents.texts, paths)

    def _add(self, folders: Iterable[Path]) -> None:
        """Add folders of the workspace, but no whole disk or home, which would take minutes."""
        for folder in folders:
            if folder not in (folder.parent, Path.home()):
                self._folders.setdefault(folder, self._workspace(folder))
        self._strays.clear()

    def _replace_folders(self, added: Any, removed: Any) -> None:
        for path in (uris.to_path(folder.uri) for folder in removed):
            if path is not None:
                self._folders.pop(path, None)
        self._add(path for folder in added if (path := uris.to_path(folder.uri)))
        self.is_changed = True

    def _change_folders(self, params: DidChangeFolders) -> None:
        self._replace_folders(params.event.added, params.event.removed)

    # Documents and files.

    def context(self, uri: str) -> InterfaceContext | None:
        """Return the context of an interface file; `None` if it is not checked."""
        path = self.path(uri)
        workspace = self.workspace_of(path) if path else None
        snapshot = workspace.snapshot() if workspace else None
        if path is None or snapshot is None or path not in snapshot.interfaces:
            return None
        interface, source = snapshot.interfaces[path]
        return InterfaceContext(snapshot, interface, source)

    def path(self, uri: str) -> Path | None:
        """Return the path of a document."""
        document = self.documents.get(uri)
        return document.path if document else uris.to_path(uri)

    def uri(self, path: Path) -> str:
        """Return the URI of a file, as the client spells it if it is open."""
        document = self.documents.at(path)
        return document.uri if document else uris.from_path(path)

    def offset(self, source: Source, position: Position) -> int:
        """Return the character of a text at a position."""
        return self._places(source).offset(position)

    def range(self, span: Span) -> Range:
        """Return the range of a span."""
        return self._places(span.source).range(span.start, span.end)

    def _places(self, source: Source) -> positions.Places:
        """Return the places of a text; a client that keeps byte order marks counts them."""
        skips_mark = positions.has_mark(source.text) and not any(
            positions.has_mark(document.text) for document in self.documents
        )
        return positions.places(source.text, self.encoding, skips_mark=skips_mark)

    def location(self, span: Span, snapshot: Snapshot) -> Location:
        """Return the location of a span; a built-in interface is a document without a file.

        For clients that cannot show such a document, it is a file of the user's cache.
        """
        source = span.source
        if is_built_in(source):
            path = None if self.supports("workspace", CONTENT) else file_of(source)
            uri = uris.from_path(path) if path else f"idlc:/{inside(source)}"
            return Location(uri, self.range(span))
        return Location(self.uri(snapshot.path_of(source)), self.range(span))

    def _open(self, params: DidOpen) -> None:
        document = self.documents.open(params.text_document)
        self.published.pop(document.uri, None)  # the client may have dropped it since
        self._follow(document, document.data)

    def _change(self, params: DidChange) -> None:
        document = self.documents.get(params.text_document.uri)
        if document is None:
            raise RequestError(INVALID_REQUEST, f"{params.text_document.uri} is not open")
        document.version = params.text_document.version
        document.change(params.content_changes, self.encoding)
        self._follow(document, document.data)

    def _close(self, params: DocumentParams) -> None:
        document = self.documents.close(params.text_document.uri)
        if document is not None:
            self._follow(document, None)

    def _save(self, _: DocumentParams) -> None:
        self.forget()

    def _follow(self, document: Document, data: bytes | None) -> None:
        """Use a new text for a document; `None` for the one on disk."""
        if document.path is not None:
            for workspace in self._known_workspaces():
                workspace.follow(document.path, data)
        self.is_changed = True

    def _change_files(self, params: DidChangeFiles) -> None:
        paths = {path for change in params.changes if (path := uris.to_path(change.uri))}
        of_git = {path for path in paths if self._is_of_git(path)}
        if of_git:
            self.refresh_moved_lenses()
        self._follow_disk(paths - of_git)

    def _rename_files(self, params: RenameFilesParams) -> None:
        moved = (uris.to_path(uri) for file in params.files for uri in (file.old_uri, file.new_uri))
        self._follow_disk(filter(None, moved))

    def _follow_disk(self, paths: Iterable[Path]) -> None:
        """Handle changes of files on disk; the text of an open document counts as before."""
        for path in paths:
            for workspace in self._known_workspaces():
                workspace.follow(path, None)
        self.is_changed = True

    # Git revisions, with which lenses compare.

    def follow_git(self, folder: Path, repository: Callable[[], Iterable[Path]]) -> None:
        """Have the client report when another commit is checked out for a folder, if it can."""
        if folder in self.repositories:
            return
        places = self.repositories[folder] = tuple(repository())
        if not (places and self.supports("workspace", "didChangeWatchedFiles", RELATIVE)):
            return
        watchers = [
            {"globPattern": {"baseUri": uris.from_path(place), "pattern": pattern}}
            for place in places
            for pattern in ("{HEAD,packed-refs}", "refs/**")
        ]
        method = "workspace/didChangeWatchedFiles"
        options = {"watchers": watchers}
        registration = {"id": uris.from_path(folder), "method": method, "registerOptions": options}
        self.ask("client/registerCapability", {"registrations": [registration]})

    def _is_of_git(self, path: Path) -> bool:
        """Return whether a file is one in which git records the commit that is checked out."""
        places = (place for places in self.repositories.values() for place in places)
        return any(path.is_relative_to(place) for place in places)

    def refresh_moved_lenses(self) -> None:
        """Have lenses requested again if the revision that they compare with has moved."""
        moved = [
            workspace.baseline(self.settings.against).has_moved()
            for workspace in self._known_workspaces()
            if workspace.folder in self.repositories and workspace.is_loaded
        ]
        if any(moved):
            self.refresh("codeLens")

    # Settings.

    def _initialized(self, _: object) -> None:
        """Register for changes of files and settings, and fetch the settings."""
        requested: list[tuple[str, dict[str, object]]] = []
        if self.supports("workspace", "didChangeWatchedFiles", "dynamicRegistration"):
            options: dict[str, object] = {
                "watchers": [{"globPattern": pattern} for pattern in WATCHED]
            }
            requested.append(("workspace/didChangeWatchedFiles", options))
            self.is_watching = True
        if self.supports("workspace", "didChangeConfiguration", "dynamicRegistration"):
            requested.append(("workspace/didChangeConfiguration", {"section": "idlc"}))
        if requested:
            registrations = [
                {"id": method, "method": method, "registerOptions": options}
                for method, options in requested
            ]
            self.ask("client/registerCapability", {"registrations": registrations})
        self._fetch_settings()

    def _fetch_settings(self) -> None:
        if self.supports("workspace", "configuration"):
            items = {"items": [{"section": "idlc"}]}
            self.ask(
                "workspace/configuration", items, lambda values: self._use_settings(*values[:1])
            )

    def _change_settings(self, params: DidChangeSettings) -> None:
        if self.supports("workspace", "configuration"):
            self._fetch_settings()
        else:
            self._use_settings(params.settings)

    def _use_settings(self, settings: object = None) -> None:
        """Use settings; an editor without any sends `null`."""
        if settings is None:
            return
        self.is_changed = True
        own = settings.get("idlc", settings) if isinstance(settings, dict) else {}
        try:
            self.settings = msgspec.convert(own, Settings)
        except msgspec.ValidationError as error:
            message = f"the settings of idlc are not used: {error}"
            self.notify("window/showMessage", {"type": 2, "message": message})
            return
        names = EditorOptions.__struct_fields__
        options = EditorOptions(**{name: getattr(self.settings, name) for name in names})
        if options != self._options:
            self._options = options
            folders, self._folders = self._folders, {}
            self._add(folders)


def _together(paths: Iterable[tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(sorted({path for some in paths for path in some}))
