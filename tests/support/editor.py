"""An editor without a window: pygls, which knows nothing of idlc, as the client of `idlc lsp`.

It refuses what is not of the protocol's types, and is used without coroutines.
"""

from __future__ import annotations

import asyncio
import sys
import threading
from pathlib import Path
from typing import Any

from lsprotocol import types as lsp
from pygls.lsp.client import BaseLanguageClient

from tests.support.waiting import LIMIT, join


class Editor:
    """A client with a server of its own."""

    def __init__(
        self,
        *folders: Path,
        capabilities: Any = None,
        options: Any = None,
        command: tuple[str, ...] = (sys.executable, "-m", "idlc", "lsp"),
    ) -> None:
        self.problems: dict[str, list[lsp.Diagnostic]] = {}
        self.versions: dict[str, int | None] = {}
        self.told: list[str] = []
        self._news = threading.Condition()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._client = BaseLanguageClient("tests", "1")
        self._listen()
        # lsprotocol takes an action that has a command for nothing but that command
        converter = self._client.protocol._converter
        converter.register_structure_hook(
            lsp.Command | lsp.CodeAction,
            lambda given, _: converter.structure(given, lsp.CodeAction),
        )
        self._wait(self._client.start_io(*command))
        self.process = self._client._server
        self.answer = self.ask(
            lsp.INITIALIZE,
            lsp.InitializeParams(
                capabilities=capabilities or lsp.ClientCapabilities(),
                initialization_options=options,
                workspace_folders=[
                    lsp.WorkspaceFolder(uri=one.as_uri(), name=one.name) for one in folders
                ],
            ),
        )
        self.tell(lsp.INITIALIZED, lsp.InitializedParams())

    def _listen(self) -> None:
        @self._client.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def _(params: lsp.PublishDiagnosticsParams) -> None:
            with self._news:
                self.problems[params.uri] = list(params.diagnostics)
                self.versions[params.uri] = params.version
                self._news.notify_all()

        @self._client.feature(lsp.WINDOW_LOG_MESSAGE)
        @self._client.feature(lsp.WINDOW_SHOW_MESSAGE)
        def _(params: Any) -> None:
            self.told.append(params.message)

    def _wait(self, coroutine: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(LIMIT)

    def ask(self, method: str, params: Any = None) -> Any:
        """Return the answer to a request; raises pygls' JsonRpcException."""

        async def send() -> Any:
            return await self._client.protocol.send_request_async(method, params)

        return self._wait(send())

    def tell(self, method: str, params: Any = None) -> None:
        """Send a notification."""

        async def send() -> None:
            self._client.protocol.notify(method, params)

        self._wait(send())

    def open(self, path: Path | str, text: str | None = None, language: str = "rosmsg") -> str:
        """Open a file, or a text that is not saved, and return its URI."""
        uri = path if isinstance(path, str) else path.as_uri()
        if text is None:
            text = Path(path).read_bytes().decode()
        item = lsp.TextDocumentItem(uri=uri, language_id=language, version=1, text=text)
        self.tell(lsp.TEXT_DOCUMENT_DID_OPEN, lsp.DidOpenTextDocumentParams(text_document=item))
        return uri

    def change(self, uri: str, text: str, version: int = 2, where: lsp.Range | None = None) -> None:
        """Change a document, as a whole or where a range says."""
        one = (
            lsp.TextDocumentContentChangeWholeDocument(text=text)
            if where is None
            else lsp.TextDocumentContentChangePartial(text=text, range=where)
        )
        self.tell(
            lsp.TEXT_DOCUMENT_DID_CHANGE,
            lsp.DidChangeTextDocumentParams(
                text_document=lsp.VersionedTextDocumentIdentifier(version=version, uri=uri),
                content_changes=[one],
            ),
        )

    def answer_edits(self, taken: list[lsp.WorkspaceEdit]) -> None:
        """Take the edits that the server asks for; nothing is written."""

        @self._client.feature(lsp.WORKSPACE_APPLY_EDIT)
        def _(params: lsp.ApplyWorkspaceEditParams) -> lsp.ApplyWorkspaceEditResult:
            taken.append(params.edit)
            return lsp.ApplyWorkspaceEditResult(applied=True)

    def answer_all(self) -> list[tuple[str, Any]]:
        """Return where everything that the server asks for from now on is noted."""
        asked: list[tuple[str, Any]] = []

        def note(method: str) -> None:
            @self._client.feature(method)
            def _(*params: Any) -> None:
                asked.append((method, *params[:1]) if params else (method, None))

        note(lsp.CLIENT_REGISTER_CAPABILITY)
        note(lsp.WORKSPACE_CODE_LENS_REFRESH)
        note(lsp.WORKSPACE_DIAGNOSTIC_REFRESH)
        return asked

    def close(self, uri: str) -> None:
        """Close a document."""
        self.tell(
            lsp.TEXT_DOCUMENT_DID_CLOSE,
            lsp.DidCloseTextDocumentParams(text_document=lsp.TextDocumentIdentifier(uri=uri)),
        )

    def wait(self, uri: str, version: int | None = None) -> list[lsp.Diagnostic]:
        """Return the problems that the server tells of a document, or of a version of it."""
        with self._news:
            came = self._news.wait_for(
                lambda: uri in self.problems and version in (None, self.versions[uri]),
                LIMIT,
            )
        assert came, f"nothing was told of {uri}; {self.told}"
        return self.problems[uri]

    def pull(self, uri: str) -> list[lsp.Diagnostic]:
        """Return the problems of a document, as the server answers."""
        document = lsp.TextDocumentIdentifier(uri=uri)
        answer = self.ask(
            lsp.TEXT_DOCUMENT_DIAGNOSTIC, lsp.DocumentDiagnosticParams(text_document=document)
        )
        return list(answer.items)

    def quit(self) -> None:
        """End the server as an editor does."""
        self.ask(lsp.SHUTDOWN)
        self.tell(lsp.EXIT)
        self._wait(self._client.stop())
        self._loop.call_soon_threadsafe(self._loop.stop)
        join(self._thread)
        self._loop.close()


def at(line: int, character: int) -> lsp.Position:
    return lsp.Position(line=line, character=character)


def between(line: int, start: int, end: int) -> lsp.Range:
    return lsp.Range(start=at(line, start), end=at(line, end))
