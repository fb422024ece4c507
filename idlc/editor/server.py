"""The loop of the server: messages are answered in the order in which they arrive.

A thread reads, so that a cancellation arrives before its request is begun, and so that many
changes in a row are followed by one check. No message of a client ends the server.
"""

from __future__ import annotations

import gc
import json
import os
import queue
import threading
from collections import Counter
from collections.abc import Callable
from importlib import import_module
from itertools import count
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias

from idlc.editor import protocol
from idlc.editor.protocol import RequestError

if TYPE_CHECKING:
    from idlc.editor.state import ServerState

#: Functions that answer, each with its module and the type of its parameters. The state is their
#: first argument.
METHODS = {
    "textDocument/diagnostic": ("problems", "document", "DocumentParams"),
    "workspace/diagnostic": ("problems", "workspace", "WorkspaceDiagnosticParams"),
    "textDocument/completion": ("completion", "complete", "PositionParams"),
    "completionItem/resolve": ("completion", "resolve", "CompletionItem"),
    "textDocument/codeAction": ("actions", "actions", "CodeActionParams"),
    "workspace/executeCommand": ("actions", "execute", "CommandParams"),
    "textDocument/prepareRename": ("rename", "prepare", "PositionParams"),
    "textDocument/rename": ("rename", "rename", "RenameParams"),
    "workspace/willRenameFiles": ("rename", "files", "RenameFilesParams"),
    "textDocument/definition": ("navigation", "definition", "PositionParams"),
    "textDocument/references": ("navigation", "references", "ReferenceParams"),
    "workspace/textDocumentContent": ("navigation", "built_in_text", "Uri"),
    "workspace/symbol": ("structure", "workspace", "WorkspaceSymbolParams"),
    "textDocument/selectionRange": ("structure", "selections", "PositionsParams"),
    "codeLens/resolve": ("descriptions", "resolve", "Lens"),
}
#: Those about an interface file: its context is their first argument. Last is the answer where no
#: such file is checked.
FILE_METHODS: dict[str, tuple[str, str, str, object]] = {
    "textDocument/hover": ("descriptions", "hover", "PositionParams", None),
    "textDocument/inlayHint": ("descriptions", "hints", "RangeParams", ()),
    "textDocument/codeLens": ("descriptions", "lenses", "DocumentParams", ()),
    "textDocument/typeDefinition": ("navigation", "type_definition", "PositionParams", None),
    "textDocument/documentHighlight": ("navigation", "highlights", "PositionParams", ()),
    "textDocument/documentSymbol": ("structure", "symbols", "DocumentParams", ()),
    "textDocument/foldingRange": ("structure", "folds", "DocumentParams", ()),
    "textDocument/documentLink": ("structure", "links", "DocumentParams", ()),
    "textDocument/semanticTokens/full": ("structure", "tokens", "DocumentParams", {"data": ()}),
    "textDocument/semanticTokens/range": ("structure", "tokens_in", "RangeParams", {"data": ()}),
    "textDocument/formatting": ("actions", "format_document", "DocumentParams", ()),
    "textDocument/rangeFormatting": ("actions", "format_range", "RangeParams", ()),
    "textDocument/onTypeFormatting": ("actions", "format_typed", "PositionParams", ()),
}


def feature(name: str) -> Any:
    """Import and return the function that answers a method."""
    module, function = (FILE_METHODS.get(name) or METHODS[name])[:2]
    return getattr(import_module(f"idlc.editor.{module}"), function)


#: No process has a higher number.
MAX_PROCESS = 1 << 31


#: Messages in a row after which problems are published although more are waiting.
MOST_IN_A_ROW = 500
#: Seconds without a message after which the server is idle. It doubles before each next poll for
#: changes on disk and for whether the client still lives.
QUIET = 0.3
#: Seconds between such polls at most.
PATIENCE = 10.0
#: An arrival: a message, the error for a malformed one, or the end.
RpcMessage: TypeAlias = "dict[str, Any]"
Incoming: TypeAlias = "RpcMessage | RequestError | None"
Responder: TypeAlias = Callable[[Any], None]


def serve(reader: BinaryIO, writer: BinaryIO) -> int:
    """Serve a client until it ends that or is gone, and return the exit status."""
    return Server(reader, writer).run()


class Server:
    """A server between two streams."""

    def __init__(self, reader: BinaryIO, writer: BinaryIO) -> None:
        self._reader = reader
        self._writer = writer
        self._arrivals: queue.SimpleQueue[Incoming] = queue.SimpleQueue()
        #: The number of requests of each id that wait for their answer, and the cancelled ids.
        self._waiting: Counter[int | str | None] = Counter()
        self._cancelled: set[int | str] = set()
        self._lock = threading.Lock()
        self._ids = count()
        self._asked: dict[int, Responder] = {}
        #: The parameters of `initialize`. The state is made of them when it is needed: its imports
        #: take long.
        self._initialize: dict[str, Any] | None = None
        self._state: ServerState | None = None
        self._is_shut_down = False

    @property
    def state(self) -> ServerState:
        """The state, made at its first use; only after `initialize`."""
        if self._state is None:
            from idlc.editor.state import ServerState

            assert self._initialize is not None
            self._state = ServerState(self._initialize, self.notify, self.ask)
        return self._state

    def run(self) -> int:
        """Serve, and return the exit status."""
        threading.Thread(target=self._read, daemon=True).start()
        # searching for garbage takes longer than any answer, and there is hardly any
        gc.disable()
        in_a_row = since = 0
        wait = PATIENCE
        try:
            while True:
                if in_a_row and (in_a_row >= MOST_IN_A_ROW or self._arrivals.empty()):
                    in_a_row = 0
                    self._attempt("problems", self.publish_problems)
                if since >= MOST_IN_A_ROW:
                    since = 0
                    self._attempt("preparation", self.rest)
                try:
                    arrival = self._arrivals.get(timeout=wait)
                except queue.Empty:
                    wait = min(2 * wait, PATIENCE)
                    if not since and self._client_is_gone():
                        return 1
                    since = 0
                    self._attempt("preparation", self.rest)
                    continue
                in_a_row += 1
                since += 1
                wait = QUIET
                if arrival is None or _is_exit(arrival):
                    return 0 if self._is_shut_down else 1
                self._dispatch(arrival)
        except (OSError, ValueError):  # nobody reads what is written
            return 1
        finally:
            gc.enable()

    def answer(self, name: str, params: object) -> object:
        """Return the answer to a request; raises RequestError."""
        if self._is_shut_down or (self._initialize is not None and name == "initialize"):
            raise RequestError(protocol.INVALID_REQUEST, f"`{name}` is not supported")
        if name == "initialize":
            if not isinstance(params, dict):
                raise RequestError(protocol.INVALID_PARAMS, "`initialize` needs an object")
            self._initialize = params
            client = params.get("capabilities")
            return protocol.initialize_result(client if isinstance(client, dict) else {})
        if self._initialize is None:
            raise RequestError(protocol.NOT_INITIALIZED, "`initialize` comes first")
        if name == "shutdown":
            self._is_shut_down = True
            return None
        if name not in METHODS and name not in FILE_METHODS:
            raise RequestError(protocol.METHOD_NOT_FOUND, f"there is no method `{name}`")
        return self._call(name, params)

    def _call(self, name: str, params: object) -> object:
        """Return a function's answer; raises ValidationError for wrong parameters."""
        import msgspec

        from idlc.editor import parts

        kind = (FILE_METHODS.get(name) or METHODS[name])[2]
        request = msgspec.convert(params, getattr(parts, kind))
        if name in METHODS:
            return feature(name)(self.state, request)
        context = self.state.context(request.text_document.uri)
        return feature(name)(context, request) if context else FILE_METHODS[name][3]

    def handle_notification(self, name: str, params: object) -> None:
        """Handle a notification; unknown ones, and those out of session, are ignored."""
        if self._initialize is not None and not self._is_shut_down:
            self.state.handle_notification(name, params)

    def encode(self, message: object) -> bytes:
        """Return a message as JSON."""
        if self._state is None:
            return json.dumps(message).encode()
        import msgspec

        try:
            return msgspec.json.encode(message)
        except UnicodeEncodeError:  # strings of a client that have half a surrogate pair
            return json.dumps(msgspec.to_builtins(message)).encode()

    def publish_problems(self) -> None:
        """Send the client the problems of each document for which they changed."""
        if self._state is not None and self._state.is_changed and not self._is_shut_down:
            from idlc.editor.problems import publish

            publish(self._state)

    def rest(self) -> None:
        """Do work that nobody waits for: poll for changes, and import all features."""
        if self._state is not None and not self._is_shut_down:
            if self._state.documents:
                for name in (*METHODS, *FILE_METHODS):
                    feature(name)  # so that its first answer takes no longer
            from idlc.editor.problems import rest

            rest(self._state)
        gc.collect()

    def _client_is_gone(self) -> bool:
        """Return whether the process of the client has ended, where the system can tell."""
        client = (self._initialize or {}).get("processId")
        if not isinstance(client, int) or not 0 < client < MAX_PROCESS or os.name != "posix":
            return False
        try:
            os.kill(client, 0)
        except OSError as error:
            return isinstance(error, ProcessLookupError)
        return False

    def _read(self) -> None:
        """Put each message into the queue of the loop; `None` comes last."""
        while True:
            try:
                body = protocol.read(self._reader)
                if body is None:
                    break
                message = _message(body)
                if message.get("method") == "$/cancelRequest":
                    id_ = _cancelled(message)
                    with self._lock:
                        if id_ in self._waiting:
                            self._cancelled.add(id_)
                    continue
                if "method" in message and "id" in message:
                    with self._lock:
                        self._waiting[message["id"]] += 1
                self._arrivals.put(message)
            except RequestError as error:
                self._arrivals.put(error)
            except (OSError, ValueError):  # the stream was closed
                break
        self._arrivals.put(None)

    def _dispatch(self, arrival: RpcMessage | RequestError) -> None:
        if isinstance(arrival, RequestError):
            self._fail(None, arrival)
        elif "method" not in arrival:
            id_ = arrival.get("id")
            take = self._asked.pop(id_, None) if isinstance(id_, int) else None
            if take is not None and "result" in arrival:
                self._attempt("answer", lambda: take(arrival["result"]))
        elif "id" in arrival:
            self._answer(arrival)
        else:
            name, params = arrival["method"], arrival.get("params")
            self._attempt(name, lambda: self.handle_notification(name, params))

    def _answer(self, request: RpcMessage) -> None:
        id_, name = request["id"], request["method"]
        with self._lock:
            self._waiting[id_] -= 1
            if not self._waiting[id_]:
                del self._waiting[id_]
            is_cancelled = id_ in self._cancelled
            self._cancelled.discard(id_)
        if is_cancelled:
            self._fail(id_, RequestError(protocol.CANCELLED, "cancelled"))
            return
        failure, result = self._result(lambda: self.answer(name, _params(request)))
        if failure is None:
            self._write({"jsonrpc": "2.0", "id": id_, "result": result})
            return
        if failure.code == protocol.INTERNAL_ERROR:
            self._log(f"{name}: {failure.message}")
        self._fail(id_, failure)

    def _attempt(self, what: str, action: Callable[[], object]) -> None:
        """Run an action that has no answer; failures are only logged."""
        failure, _ = self._result(action)
        if failure is not None:
            self._log(f"{what}: {failure.message}")

    def _result(self, action: Callable[[], object]) -> tuple[RequestError | None, object]:
        try:
            return None, action()
        except RequestError as error:
            return error, None
        except BrokenPipeError:
            raise
        except Exception as error:
            kind = type(error).__name__
            if kind == "ValidationError":  # msgspec's, which is not imported here
                return RequestError(protocol.INVALID_PARAMS, str(error)), None
            return RequestError(protocol.INTERNAL_ERROR, f"{kind}: {error}"), None

    def _fail(self, id_: int | str | None, error: RequestError) -> None:
        details = {"code": error.code, "message": error.message}
        self._write({"jsonrpc": "2.0", "id": id_, "error": details})

    def _log(self, message: str) -> None:
        self.notify("window/logMessage", {"type": 1, "message": f"idlc: {message}"})

    def notify(self, method: str, params: object) -> None:
        """Send a notification to the client."""
        self._write({"jsonrpc": "2.0", "method": method, "params": params})

    def ask(self, method: str, params: object, answer: Responder | None = None) -> None:
        """Send a request to the client; `answer` takes its result."""
        id_ = next(self._ids)
        if answer is not None:
            self._asked[id_] = answer
        self._write({"jsonrpc": "2.0", "id": id_, "method": method, "params": params})

    def _write(self, message: object) -> None:
        protocol.write(self._writer, self.encode(message))


def _message(body: bytes) -> RpcMessage:
    """Return a message; raises RequestError if it is none."""
    try:
        message = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise RequestError(protocol.PARSE_ERROR, str(error)) from error
    if not isinstance(message, dict):
        raise RequestError(protocol.INVALID_REQUEST, "a message is an object")
    if not isinstance(message.get("method", ""), str):
        raise RequestError(protocol.INVALID_REQUEST, "the name of a method is a string")
    id_ = message.get("id")
    if type(id_) not in (int, str, type(None)) or not _is_text(id_):
        raise RequestError(protocol.INVALID_REQUEST, "an id is an integer or a string")
    return message


def _params(request: RpcMessage) -> object:
    """Return the parameters of a request; raises RequestError for malformed strings."""
    if not _is_text(request):
        raise RequestError(protocol.INVALID_PARAMS, "a string has one half of a surrogate pair")
    return request.get("params")


def _is_text(value: object) -> bool:
    """Return whether all strings in a value of JSON can be encoded, as halves of pairs cannot."""
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except (UnicodeEncodeError, RecursionError):
        return False
    return True


def _cancelled(message: RpcMessage) -> int | str:
    """Return the id of the request that is cancelled; raises RequestError."""
    params = message.get("params")
    id_ = params.get("id") if isinstance(params, dict) else None
    if not isinstance(id_, (int, str)):
        raise RequestError(protocol.INVALID_REQUEST, "an id is an integer or a string")
    return id_


def _is_exit(arrival: RpcMessage | RequestError) -> bool:
    return isinstance(arrival, dict) and arrival.get("method") == "exit"
