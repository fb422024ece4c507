"""What a client says of its documents, folders and settings, and the problems that it is told."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import msgspec

from idlc.editor.documents import Document
from idlc.editor.protocol import capabilities, uris
from idlc.editor.protocol.framing import INVALID_REQUEST, RequestError
from idlc.editor.protocol.parts import (
    AskedFileRenames,
    DidChange,
    DidChangeFiles,
    DidChangeFolders,
    DidChangeSettings,
    DidOpen,
    Folder,
    Initialize,
    OfDocument,
)
from idlc.editor.workspace import AROUND
from idlc.editor.world import RELATIVE, World

#: What is watched on disk: what a check may read.
WATCHED = ("**/*.{msg,srv,action}", f"**/{{{','.join(AROUND)}}}")
#: What is shown in a document that may change with another.
_SHOWN = ("inlayHint", "codeLens", "semanticTokens")


class Workbench:
    """The world of a session; `notify` and `ask` send something to the client."""

    def __init__(
        self, said: dict[str, Any], notify: Callable[..., None], ask: Callable[..., None]
    ) -> None:
        self._notify = notify
        self._ask = ask
        self._changed = False
        #: Whether the client was asked to tell of changes on disk.
        self._is_watching = False
        #: The problems that were told of each document, and the version that they were of.
        self._told: dict[str, tuple[int | None, bytes]] = {}
        #: What features show of each document, as a number, and the version that they show.
        self._prints: dict[str, tuple[int | None, int]] = {}
        self._taken: dict[str, tuple[type, Callable[[Any], None]]] = {
            "textDocument/didOpen": (DidOpen, self._open),
            "textDocument/didChange": (DidChange, self._change),
            "textDocument/didSave": (OfDocument, self._save),
            "textDocument/didClose": (OfDocument, self._close),
            "workspace/didChangeWatchedFiles": (DidChangeFiles, self._change_files),
            "workspace/didRenameFiles": (AskedFileRenames, self._rename_files),
            "workspace/didChangeWorkspaceFolders": (DidChangeFolders, self._change_folders),
            "workspace/didChangeConfiguration": (DidChangeSettings, self._change_settings),
            "initialized": (dict, self._initialized),
        }
        self.world = World(ask, notify)
        try:
            given = msgspec.convert(said, Initialize)
        except msgspec.ValidationError:  # from a client that is of another mind
            given = Initialize()
        self.world.client = given.capabilities
        self.world.encoding = capabilities.encoding(given.capabilities)
        self._settle(given.initialization_options)
        roots = [one.uri for one in given.workspace_folders or ()]
        if given.workspace_folders is None:
            roots = [given.root_uri] if given.root_uri else []
        self._folders([Folder(uri) for uri in roots], [])

    def take(self, name: str, params: object) -> None:
        """Take a notification; one that is not known is passed over."""
        kind, take = self._taken.get(name, (None, None))
        if kind is not None and take is not None:
            take(msgspec.convert(params, kind))

    def _initialized(self, _: object) -> None:
        """Ask for what may change without the editor's documents."""
        world = self.world
        wanted: list[tuple[str, dict[str, object]]] = []
        if world.supports("workspace", "didChangeWatchedFiles", "dynamicRegistration"):
            options: dict[str, object] = {
                "watchers": [{"globPattern": pattern} for pattern in WATCHED]
            }
            wanted.append(("workspace/didChangeWatchedFiles", options))
            self._is_watching = True
        if world.supports("workspace", "didChangeConfiguration", "dynamicRegistration"):
            wanted.append(("workspace/didChangeConfiguration", {"section": "idlc"}))
        if wanted:
            registrations = [
                {"id": method, "method": method, "registerOptions": options}
                for method, options in wanted
            ]
            self._ask("client/registerCapability", {"registrations": registrations})
        self._fetch_settings()

    def _fetch_settings(self) -> None:
        if self.world.supports("workspace", "configuration"):
            items = {"items": [{"section": "idlc"}]}
            self._ask("workspace/configuration", items, lambda found: self._settle(*found[:1]))

    def _settle(self, settings: object = None) -> None:
        """Use settings; an editor without any says `null`."""
        if settings is None:
            return
        wrong = self.world.settle(settings)
        if wrong:
            self._notify("window/showMessage", {"type": 2, "message": wrong})
        self._changed = True

    def _change_settings(self, given: DidChangeSettings) -> None:
        if self.world.supports("workspace", "configuration"):
            self._fetch_settings()
        else:
            self._settle(given.settings)

    def _change_folders(self, given: DidChangeFolders) -> None:
        self._folders(given.event.added, given.event.removed)

    def _folders(self, added: Any, removed: Any) -> None:
        projects = self.world.projects
        projects.remove(path for one in removed if (path := uris.to_path(one.uri)))
        projects.add(path for one in added if (path := uris.to_path(one.uri)))
        self._changed = True

    def _open(self, given: DidOpen) -> None:
        document = self.world.documents.open(given.text_document)
        self._told.pop(document.uri, None)  # the client may have dropped it since
        self._follow(document, document.data)

    def _change(self, given: DidChange) -> None:
        document = self.world.documents.get(given.text_document.uri)
        if document is None:
            raise RequestError(INVALID_REQUEST, f"{given.text_document.uri} is not open")
        document.version = given.text_document.version
        document.change(given.content_changes, self.world.encoding)
        self._follow(document, document.data)

    def _close(self, given: OfDocument) -> None:
        document = self.world.documents.close(given.text_document.uri)
        if document is not None:
            self._follow(document, None)

    def _follow(self, document: Document, data: bytes | None) -> None:
        self.world.projects.follow(document, data)
        self._changed = True

    def _save(self, _: OfDocument) -> None:
        self.world.projects.forget()

    def _change_files(self, given: DidChangeFiles) -> None:
        paths = {path for one in given.changes if (path := uris.to_path(one.uri))}
        gits = {path for path in paths if self.world.is_gits(path)}
        if gits:
            self.world.lenses_moved()
        self.world.projects.changed_on_disk(paths - gits)
        self._changed = True

    def _rename_files(self, given: AskedFileRenames) -> None:
        moved = (uris.to_path(uri) for one in given.files for uri in (one.old_uri, one.new_uri))
        self.world.projects.changed_on_disk(filter(None, moved))
        self._changed = True

    def idle(self) -> None:
        """Look for what a client does not tell, while it says nothing."""
        if not self.world.supports("workspace", "didChangeWatchedFiles", RELATIVE):
            self.world.lenses_moved()
        self.rest()

    def rest(self) -> None:
        """Do what can wait until the client says nothing."""
        if not self._is_watching and self.world.projects.notice_changes():
            self.settle()
        self._refresh()

    def _refresh(self) -> None:
        """Have the client ask again for what it shows where another document changed that."""
        before = self._prints
        self._prints = self._fingerprints(self.world.documents)
        for uri, (version, found) in self._prints.items():
            old_version, old = before.get(uri, (None, found))
            if old_version == version and old != found:  # or the client asks by itself
                for one in _SHOWN:
                    self.world.refresh(one)
                return

    def _fingerprints(self, documents: Iterable[Document]) -> dict[str, tuple[int | None, int]]:
        if not any(self.world.supports("workspace", one, "refreshSupport") for one in _SHOWN):
            return {}
        from idlc.editor.features.tokens import fingerprints

        return {one.uri: (one.version, found) for one, found in fingerprints(self.world, documents)}

    def settle(self) -> None:
        """Tell the client which problems there are now, where that changed."""
        if not (self._changed or self.world.projects.have_news):
            return
        self._changed = self.world.projects.have_news = False
        new_documents = [one for one in self.world.documents if one.uri not in self._prints]
        self._prints |= self._fingerprints(new_documents) if new_documents else {}
        from idlc.editor.publish import diagnostics

        found = diagnostics(self.world)
        versions = {one.uri: one.version for one in self.world.documents}
        new = {
            uri: (versions.get(uri), msgspec.json.encode(found.get(uri, ())))
            for uri in (*found, *versions)
        }
        gone = self._told.keys() - new.keys()
        changed = {uri for uri, some in new.items() if self._told.get(uri) != some} | gone
        self._told = new
        # a client that asks for problems itself would show pushed ones again
        if self.world.supports("textDocument", "diagnostic"):
            if changed and self.world.supports("workspace", "diagnostics", "refreshSupport"):
                self._ask("workspace/diagnostic/refresh", None)
            return
        for uri in sorted(changed):
            version, some = new.get(uri, (None, b"[]"))
            params: dict[str, object] = {"uri": uri, "diagnostics": msgspec.Raw(some)}
            params |= {} if version is None else {"version": version}
            self._notify("textDocument/publishDiagnostics", params)
