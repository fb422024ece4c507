"""One client's session: how it begins and ends, and what the client says of its documents."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import msgspec

from idlc.lsp import capabilities, uris
from idlc.lsp.documents import Document
from idlc.lsp.methods import METHODS
from idlc.lsp.protocol import (
    INVALID_REQUEST,
    METHOD_NOT_FOUND,
    NOT_INITIALIZED,
    DidChange,
    DidChangeFiles,
    DidChangeFolders,
    DidChangeSettings,
    DidOpen,
    Folder,
    Initialize,
    Message,
    OfDocument,
    RequestError,
)
from idlc.lsp.world import World

#: What is watched on disk: what a check may read.
WATCHED = (
    "**/*.{msg,srv,action}",
    "**/{package.xml,pyproject.toml,CMakeLists.txt,setup.py,setup.cfg,idlc.lock}",
)


class Session:
    """A session; `notify` and `ask` send something to the client."""

    def __init__(self, notify: Callable[..., None], ask: Callable[..., None]) -> None:
        self.is_shut_down = False
        self._notify = notify
        self._ask = ask
        self.world = World(ask, notify)
        self._begun = False
        self._client: int | None = None
        self._changed = False
        self._told: dict[str, bytes] = {}
        self._taken: dict[str, tuple[type, Callable[[Any], None]]] = {
            "textDocument/didOpen": (DidOpen, self._open),
            "textDocument/didChange": (DidChange, self._change),
            "textDocument/didSave": (OfDocument, self._save),
            "textDocument/didClose": (OfDocument, self._close),
            "workspace/didChangeWatchedFiles": (DidChangeFiles, self._change_files),
            "workspace/didChangeWorkspaceFolders": (DidChangeFolders, self._change_folders),
            "workspace/didChangeConfiguration": (DidChangeSettings, self._change_settings),
            "initialized": (dict, self._initialized),
        }

    def client_is_gone(self) -> bool:
        """Return whether the process of the client has ended; where that can be asked."""
        if self._client is None or os.name != "posix":
            return False
        try:
            os.kill(self._client, 0)
        except ProcessLookupError:
            return True
        except OSError:
            return False
        return False

    def answer(self, request: Message) -> object:
        """Return the answer to a request; raises RequestError."""
        name = request.method
        if self.is_shut_down or (self._begun and name == "initialize"):
            raise RequestError(INVALID_REQUEST, f"`{name}` is not for now")
        if name == "initialize":
            return self._initialize(msgspec.json.decode(request.params, type=Initialize))
        if not self._begun:
            raise RequestError(NOT_INITIALIZED, "`initialize` comes first")
        if name == "shutdown":
            self.is_shut_down = True
            return None
        if name not in METHODS:
            raise RequestError(METHOD_NOT_FOUND, f"there is no method `{name}`")
        method = METHODS[name]
        return method.load()(self.world, msgspec.json.decode(request.params, type=method.params))

    def take(self, notification: Message) -> None:
        """Take a notification; those that are not known, or not for now, are passed over."""
        kind, take = self._taken.get(str(notification.method), (None, None))
        if kind is not None and take is not None and self._begun and not self.is_shut_down:
            take(msgspec.json.decode(notification.params, type=kind))

    def _initialize(self, given: Initialize) -> object:
        self._begun = True
        self._client = given.process_id
        world = self.world
        world.client = given.capabilities
        world.encoding = capabilities.encoding(given.capabilities)
        roots = [one.uri for one in given.workspace_folders or ()]
        if given.workspace_folders is None:
            roots = [given.root_uri] if given.root_uri else []
        wrong = world.settle(given.initialization_options)
        self._folders([Folder(uri) for uri in roots], [])
        if wrong:
            self._notify("window/showMessage", {"type": 2, "message": wrong})
        return capabilities.answer(world)

    def _initialized(self, _: object) -> None:
        """Ask for what may change without the editor's documents."""
        world = self.world
        wanted: list[tuple[str, dict[str, object]]] = []
        if world.supports("workspace", "didChangeWatchedFiles", "dynamicRegistration"):
            options: dict[str, object] = {
                "watchers": [{"globPattern": pattern} for pattern in WATCHED]
            }
            wanted.append(("workspace/didChangeWatchedFiles", options))
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
        self._changed = True

    def _change_files(self, given: DidChangeFiles) -> None:
        paths = {uris.to_path(one.uri) for one in given.changes}
        self.world.projects.changed_on_disk(filter(None, paths))
        self._changed = True

    def settle(self) -> None:
        """Tell the client which problems there are now, where that changed."""
        if not (self._begun and self._changed) or self.is_shut_down:
            return
        self._changed = False
        from idlc.lsp.publish import diagnostics

        found = diagnostics(self.world)
        new = {uri: msgspec.json.encode(some) for uri, some in found.items()}
        gone = self._told.keys() - new.keys()
        changed = {uri for uri, some in new.items() if self._told.get(uri) != some} | gone
        self._told = new
        if capabilities.pulls(self.world):
            if changed and self.world.supports("workspace", "diagnostics", "refreshSupport"):
                self._ask("workspace/diagnostic/refresh", None)
            return
        for uri in sorted(changed):
            document = self.world.documents.get(uri)
            version = {} if document is None else {"version": document.version}
            params = {"uri": uri, "diagnostics": msgspec.Raw(new.get(uri, b"[]")), **version}
            self._notify("textDocument/publishDiagnostics", params)
