"""Editors that make the edits which a server answers, each as a real one does it.

No edit is made to a range that does not hold the text which it is about.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from lsprotocol import types as lsp
from lsprotocol.converters import get_converter

from idlc.editor.documents import Places
from idlc.editor.parts import Position
from idlc.editor.server import Server as LanguageServer

INTERFACES = (".msg", ".srv", ".action")


class Behaviour(NamedTuple):
    """What an editor does around a rename, beside making the edits."""

    #: Whether it tells the server of CMakeLists.txt, too.
    syncs_cmake: bool
    #: Whether it asks `workspace/willRenameFiles`, also about what an answer of the server renames.
    asks: bool
    #: Whether it saves what a rename edited.
    saves: bool
    #: Whether it tells of changes on disk.
    watches: bool
    document_changes: bool = True
    annotations: bool = False
    resource_operations: tuple[lsp.ResourceOperationKind, ...] = (lsp.ResourceOperationKind.Rename,)

    @property
    def capabilities(self) -> lsp.ClientCapabilities:
        notes = lsp.ChangeAnnotationsSupportOptions() if self.annotations else None
        return lsp.ClientCapabilities(
            workspace=lsp.WorkspaceClientCapabilities(
                workspace_edit=lsp.WorkspaceEditClientCapabilities(
                    document_changes=self.document_changes or None,
                    resource_operations=self.resource_operations,
                    change_annotation_support=notes,
                ),
                did_change_watched_files=lsp.DidChangeWatchedFilesClientCapabilities(
                    dynamic_registration=self.watches
                ),
            )
        )


BEHAVIOURS = {
    "vscode": Behaviour(True, True, True, True, annotations=True),
    # the plugin tells of CMakeLists.txt; what a rename edited stays unsaved
    "neovim": Behaviour(True, False, False, False, document_changes=False),
    "emacs": Behaviour(False, False, True, True),
    "helix": Behaviour(False, True, True, True),
}


class Server:
    """A language server without a process, which takes and answers what a client sends."""

    def __init__(self, *folders: Path, capabilities: lsp.ClientCapabilities) -> None:
        self.told: list[tuple[Any, ...]] = []
        self._server = LanguageServer(io.BytesIO(), io.BytesIO())
        self._server.notify = self._server.ask = self._hear
        self._converter = get_converter()
        given = [lsp.WorkspaceFolder(uri=one.as_uri(), name=one.name) for one in folders]
        params = lsp.InitializeParams(capabilities=capabilities, workspace_folders=given)
        self.ask(lsp.INITIALIZE, params)
        self.tell(lsp.INITIALIZED, lsp.InitializedParams())

    def _hear(self, *words: Any) -> None:
        self.told.append(words)

    def ask(self, method: str, params: object) -> Any:
        """Return the answer to a request; raises RequestError."""
        body = {"jsonrpc": "2.0", "id": 1, "result": self.answer(method, params)}
        return self._converter.structure(body, lsp.METHOD_TO_TYPES[method][1]).result

    def answer(self, method: str, params: object) -> Any:
        """Return the answer to a request as JSON; raises RequestError."""
        answer = self._server.answer(method, self._converter.unstructure(params))
        return json.loads(self._server.encode(answer))

    def applied(self) -> lsp.WorkspaceEdit:
        """Return the edit that the server asked for, which is one."""
        (edit,) = (given["edit"] for name, given, *_ in self.told if "applyEdit" in name)
        given = json.loads(self._server.encode(edit))
        return self._converter.structure(given, lsp.WorkspaceEdit)

    def tell(self, method: str, params: object) -> None:
        """Send a notification."""
        self._server.handle_notification(method, self._converter.unstructure(params))
        self._server.publish_problems()

    def publish_problems(self) -> None:
        """Let the server say what a loop does after messages."""
        self._server.publish_problems()

    def rest(self) -> None:
        """Send nothing for a while."""
        self._server.rest()


class Simulated:
    """An editor with buffers over a folder; `roots` are the folders of its workspace."""

    def __init__(self, folder: Path, behaviour: Behaviour, roots: Iterable[Path] = ()) -> None:
        self.folder = folder
        self.behaviour = behaviour
        self.server = Server(*(roots or (folder,)), capabilities=behaviour.capabilities)
        self.coding = "utf-8"
        self.texts: dict[Path, str] = {}
        self._versions: dict[Path, int] = {}

    def files(self) -> dict[str, str]:
        """Return the workspace as its user sees it: buffers before what is on disk."""
        paths = {one for one in self.folder.rglob("*") if one.is_file() and ".git" not in one.parts}
        return {
            one.relative_to(self.folder).as_posix(): self.text(one)
            for one in sorted(paths | self.texts.keys())
        }

    def text(self, path: Path) -> str:
        """Return the text of a buffer, or else of its file."""
        return self.texts[path] if path in self.texts else path.read_text(encoding=self.coding)

    def open(self, path: Path) -> None:
        """Read a file into a buffer, if it is in none."""
        if path not in self.texts:
            self.texts[path] = path.read_text(encoding=self.coding)
            self._versions[path] = 1
            if self._is_synced(path):
                item = lsp.TextDocumentItem(path.as_uri(), "rosmsg", 1, self.texts[path])
                self.server.tell(
                    lsp.TEXT_DOCUMENT_DID_OPEN, lsp.DidOpenTextDocumentParams(text_document=item)
                )

    def write(self, path: Path, text: str) -> None:
        """Change a buffer."""
        self.open(path)
        self.texts[path] = text
        self._versions[path] += 1
        if self._is_synced(path):
            version = self._versions[path]
            params = lsp.DidChangeTextDocumentParams(
                lsp.VersionedTextDocumentIdentifier(version=version, uri=path.as_uri()),
                [lsp.TextDocumentContentChangeWholeDocument(text=text)],
            )
            self.server.tell(lsp.TEXT_DOCUMENT_DID_CHANGE, params)

    def save(self, *paths: Path) -> None:
        """Write buffers to disk."""
        for path in paths:
            path.write_text(self.texts[path], encoding=self.coding, newline="")
            if self._is_synced(path):
                document = lsp.TextDocumentIdentifier(uri=path.as_uri())
                params = lsp.DidSaveTextDocumentParams(text_document=document)
                self.server.tell(lsp.TEXT_DOCUMENT_DID_SAVE, params)
        self.tell_of_changes(paths)

    def close(self, path: Path) -> None:
        """Drop a buffer."""
        del self.texts[path]
        if self._is_synced(path):
            document = lsp.TextDocumentIdentifier(uri=path.as_uri())
            params = lsp.DidCloseTextDocumentParams(text_document=document)
            self.server.tell(lsp.TEXT_DOCUMENT_DID_CLOSE, params)

    def ask_rename(self, path: Path, line: int, column: int, new: str) -> lsp.WorkspaceEdit | None:
        """Return the answer to a rename at a place of a buffer."""
        self.open(path)
        params = lsp.RenameParams(
            text_document=lsp.TextDocumentIdentifier(uri=path.as_uri()),
            position=lsp.Position(line=line, character=column),
            new_name=new,
        )
        answer: lsp.WorkspaceEdit | None = self.server.ask(lsp.TEXT_DOCUMENT_RENAME, params)
        return answer

    def apply(self, edit: lsp.WorkspaceEdit, old: str) -> None:
        """Make an edit that replaces a name everywhere, in the order of its parts."""
        touched: list[Path] = []
        for uri, edits in (edit.changes or {}).items():
            touched.append(self._edit(uri, None, edits, old))
        for one in edit.document_changes or ():
            if isinstance(one, lsp.TextDocumentEdit):
                document = one.text_document
                touched.append(self._edit(document.uri, document.version, one.edits, old))
            else:
                assert isinstance(one, lsp.RenameFile)
                self.move(path_of(one.old_uri), path_of(one.new_uri))
        if self.behaviour.saves:
            self.save(*(path for path in touched if path in self.texts))

    def move(self, old: Path, new: Path) -> None:
        """Rename a file; an editor that asks the server about it first makes those edits."""
        moved = [lsp.FileRename(old_uri=old.as_uri(), new_uri=new.as_uri())]
        if self.behaviour.asks:
            params = lsp.RenameFilesParams(files=moved)
            answer = self.server.ask(lsp.WORKSPACE_WILL_RENAME_FILES, params)
            if answer is not None:
                self.apply(answer, old.stem)
        self.move_silently(old, new)

    def move_silently(self, old: Path, new: Path) -> None:
        """Rename a file with its buffer, as an undo does."""
        assert not new.exists()
        old.rename(new)
        if old in self.texts:
            text = self.texts[old]
            self.close(old)
            self.open(new)
            self.write(new, text)
        if self.behaviour.asks:
            moved = [lsp.FileRename(old_uri=old.as_uri(), new_uri=new.as_uri())]
            self.server.tell(lsp.WORKSPACE_DID_RENAME_FILES, lsp.RenameFilesParams(files=moved))
        self.tell_of_changes((old, new))

    def problems(self) -> set[tuple[str, str, int]]:
        """Return file, code and line of the problems that the server has."""
        answer = self.server.ask(
            lsp.WORKSPACE_DIAGNOSTIC, lsp.WorkspaceDiagnosticParams(previous_result_ids=[])
        )
        return {
            (path_of(one.uri).relative_to(self.folder).as_posix(), problem.code, line)
            for one in answer.items
            for problem in one.items
            for line in [problem.range.start.line]
        }

    def _is_synced(self, path: Path) -> bool:
        is_cmake = path.name == "CMakeLists.txt"
        return path.suffix in INTERFACES or (is_cmake and self.behaviour.syncs_cmake)

    def tell_of_changes(self, paths: Iterable[Path]) -> None:
        """Tell the server which files are others on disk, if the editor watches them."""
        if self.behaviour.watches:
            kinds = lsp.FileChangeType
            changes = [
                lsp.FileEvent(
                    uri=path.as_uri(), type=kinds.Changed if path.exists() else kinds.Deleted
                )
                for path in paths
            ]
            params = lsp.DidChangeWatchedFilesParams(changes=changes)
            self.server.tell(lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES, params)

    def _edit(self, uri: str, version: int | None, edits: Iterable[Any], old: str) -> Path:
        path = path_of(uri)
        self.open(path)
        assert version in (None, self._versions[path])
        text = self.texts[path]
        places = Places(text, "utf-16")
        ranges: Mapping[tuple[int, int], Any] = {
            (_offset(places, one.range.start), _offset(places, one.range.end)): one for one in edits
        }
        assert len(ranges) == len(list(edits))
        for start, end in sorted(ranges, reverse=True):
            assert text[start:end] == old, (path, text, start, end)
            text = text[:start] + ranges[start, end].new_text + text[end:]
        self.write(path, text)
        return path


def path_of(uri: str) -> Path:
    assert uri.startswith("file://")
    return Path(uri.removeprefix("file://"))


def _offset(places: Places, position: lsp.Position) -> int:
    return places.offset(Position(position.line, position.character))
