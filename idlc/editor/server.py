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
from types import ModuleType
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, TypeAlias

from idlc.editor.protocol import capabilities, framing
from idlc.editor.protocol.framing import (
    CANCELLED,
    INTERNAL_ERROR,
    INVALID_PARAMS,
    INVALID_REQUEST,
    METHOD_NOT_FOUND,
    NOT_INITIALIZED,
    PARSE_ERROR,
    RequestError,
)

if TYPE_CHECKING:
    from idlc.editor.state import ServerState


class Method(NamedTuple):
    """A function of a module in `idlc.editor.features`, and the type of its parameters."""

    module: str
    function: str
    params: str

    def prepare(self) -> ModuleType:
        """Import and return its module."""
        return import_module(f"idlc.editor.features.{self.module}")

    def call(self, state: ServerState, params: object) -> object:
        """Return the function's answer; raises ValidationError for wrong parameters."""
        import msgspec

        request = msgspec.convert(
            params, getattr(import_module("idlc.editor.protocol.parts"), self.params)
        )
        answer: object = getattr(self.prepare(), self.function)(state, request)
        return answer


METHODS = {
    "textDocument/diagnostic": Method("diagnostics", "document", "DocumentParams"),
    "workspace/diagnostic": Method("diagnostics", "workspace", "WorkspaceDiagnosticParams"),
    "textDocument/completion": Method("completion", "complete", "PositionParams"),
    "completionItem/resolve": Method("completion", "resolve", "CompletionItem"),
    "textDocument/codeAction": Method("actions", "actions", "CodeActionParams"),
    "textDocument/prepareRename": Method("rename", "prepare", "PositionParams"),
    "textDocument/rename": Method("rename", "rename", "RenameParams"),
    "workspace/willRenameFiles": Method("rename", "files", "RenameFilesParams"),
    "workspace/executeCommand": Method("commands", "execute", "Command"),
    "textDocument/hover": Method("hover", "hover", "PositionParams"),
    "textDocument/definition": Method("navigation", "definition", "PositionParams"),
    "textDocument/typeDefinition": Method("navigation", "type_definition", "PositionParams"),
    "textDocument/references": Method("navigation", "references", "ReferenceParams"),
    "textDocument/documentHighlight": Method("navigation", "highlights", "PositionParams"),
    "textDocument/documentSymbol": Method("structure", "document", "DocumentParams"),
    "workspace/symbol": Method("structure", "workspace", "WorkspaceSymbolParams"),
    "textDocument/inlayHint": Method("lenses", "hints", "RangeParams"),
    "textDocument/codeLens": Method("lenses", "lenses", "DocumentParams"),
    "codeLens/resolve": Method("lenses", "resolve", "Lens"),
    "textDocument/semanticTokens/full": Method("tokens", "document", "DocumentParams"),
    "textDocument/semanticTokens/range": Method("tokens", "part", "RangeParams"),
    "textDocument/foldingRange": Method("structure", "folds", "DocumentParams"),
    "textDocument/selectionRange": Method("structure", "selections", "PositionsParams"),
    "textDocument/documentLink": Method("structure", "links", "DocumentParams"),
    "workspace/textDocumentContent": Method(
        "navigation", "built_in_text", "TextDocumentContentParams"
    ),
    "textDocument/formatting": Method("formatting", "document", "DocumentParams"),
    "textDocument/rangeFormatting": Method("formatting", "part", "RangeParams"),
    "textDocument/onTypeFormatting": Method("formatting", "typed", "PositionParams"),
}


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
Message: TypeAlias = "dict[str, Any]"
Arrival: TypeAlias = "Message | RequestError | None"
Answer: TypeAlias = Callable[[Any], None]


def serve(reader: BinaryIO, writer: BinaryIO) -> int:
    """Serve a client until it ends that or is gone, and return the exit status."""
    return Server(reader, writer).run()


class Server:
    """A server between two streams."""

    def __init__(self, reader: BinaryIO, writer: BinaryIO) -> None:
        self._reader = reader
        self._writer = writer
        self._arrivals: queue.SimpleQueue[Arrival] = queue.SimpleQueue()
        #: The number of requests of each id that wait for their answer, and the cancelled ids.
        self._waiting: Counter[int | str | None] = Counter()
        self._cancelled: set[int | str] = set()
        self._lock = threading.Lock()
        self._count = 0
        self._asked: dict[int, Answer] = {}
        #: Makes the state after `initialize`, when it is needed: its imports take long.
        self._make_state: Callable[[], ServerState] | None = None
        self._state: ServerState | None = None
        self._client_process: object = None
        self._is_shut_down = False

    @property
    def state(self) -> ServerState:
        """The state, made at its first use; only after `initialize`."""
        if self._state is None:
            assert self._make_state is not None
            self._state = self._make_state()
        return self._state

    def _begin(self, initialize: dict[str, Any]) -> ServerState:
        from idlc.editor.state import ServerState

        return ServerState(initialize, self.notify, self.ask)

    @property
    def _live_state(self) -> ServerState | None:
        """The state if there is one and the client has not ended the session."""
        return None if self._is_shut_down else self._state

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
                    since = self._tidy()
                try:
                    arrival = self._arrivals.get(timeout=wait)
                except queue.Empty:
                    wait = min(2 * wait, PATIENCE)
                    if since:
                        since = self._tidy()
                    elif self._client_is_gone():
                        return 1
                    else:
                        self._attempt("idle", self.idle)
                    continue
                in_a_row += 1
                since += 1
                wait = QUIET
                if arrival is None or _is_exit(arrival):
                    return 0 if self._is_shut_down else 1
                self._dispatch(arrival)
        except (OSError, ValueError):  # nobody reads what is written
            return 1

    def answer(self, name: str, params: object) -> object:
        """Return the answer to a request; raises RequestError."""
        if self._is_shut_down or (self._make_state is not None and name == "initialize"):
            raise RequestError(INVALID_REQUEST, f"`{name}` is not for now")
        if name == "initialize":
            if not isinstance(params, dict):
                raise RequestError(INVALID_PARAMS, "`initialize` needs an object")
            self._make_state = lambda: self._begin(params)
            self._client_process = params.get("processId")
            client = params.get("capabilities")
            return capabilities.answer(client if isinstance(client, dict) else {})
        if self._make_state is None:
            raise RequestError(NOT_INITIALIZED, "`initialize` comes first")
        if name == "shutdown":
            self._is_shut_down = True
            return None
        if name not in METHODS:
            raise RequestError(METHOD_NOT_FOUND, f"there is no method `{name}`")
        return METHODS[name].call(self.state, params)

    def handle_notification(self, name: str, params: object) -> None:
        """Handle a notification; unknown ones, and those out of session, are ignored."""
        if self._make_state is not None and not self._is_shut_down:
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
        if (state := self._live_state) is not None and state.is_changed:
            from idlc.editor.publish import publish

            publish(state)

    def idle(self) -> None:
        """Poll for changes while the client is idle."""
        if (state := self._live_state) is not None:
            from idlc.editor.publish import idle

            idle(state)

    def prepare(self) -> None:
        """Import all features, so that their first answers take no longer, and poll for changes."""
        if (state := self._live_state) is None:
            return
        if any(True for _ in state.documents):
            for method in METHODS.values():
                method.prepare()
        from idlc.editor.publish import rest

        rest(state)

    def _client_is_gone(self) -> bool:
        """Return whether the process of the client has ended, where the system can tell."""
        client = self._client_process
        if not isinstance(client, int) or not 0 < client < MAX_PROCESS or os.name != "posix":
            return False
        try:
            os.kill(client, 0)
        except ProcessLookupError:
            return True
        except OSError:
            return False
        return False

    def _tidy(self) -> int:
        """Do work that nobody waits for; return 0, the messages since then."""
        self._attempt("preparation", self.prepare)
        gc.collect()
        return 0

    def _read(self) -> None:
        """Put each message into the queue of the loop; `None` comes last."""
        while True:
            try:
                body = framing.read(self._reader)
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
            except framing.TooLongError:
                self._arrivals.put(RequestError(INVALID_REQUEST, "the message is too long"))
            except RequestError as error:
                self._arrivals.put(error)
            except (OSError, ValueError):  # the stream was closed
                break
        self._arrivals.put(None)

    def _dispatch(self, arrival: Message | RequestError) -> None:
        if isinstance(arrival, RequestError):
            self._fail(None, arrival)
        elif "method" not in arrival:
            self._handle_answer(arrival)
        elif "id" in arrival:
            self._answer(arrival)
        else:
            name, params = arrival["method"], arrival.get("params")
            self._attempt(name, lambda: self.handle_notification(name, params))

    def _handle_answer(self, arrival: Message) -> None:
        """Handle the client's answer to a request; an answer to no request is ignored."""
        id_ = arrival.get("id")
        take = self._asked.pop(id_, None) if isinstance(id_, int) else None
        if take is not None and "result" in arrival:
            self._attempt("answer", lambda: take(arrival["result"]))

    def _answer(self, request: Message) -> None:
        id_, name = request["id"], request["method"]
        if self._is_cancelled(id_):
            self._fail(id_, RequestError(CANCELLED, "cancelled"))
            return
        failure, result = self._result(lambda: self.answer(name, _params(request)))
        if failure is None:
            self._write({"jsonrpc": "2.0", "id": id_, "result": result})
            return
        if failure.code == INTERNAL_ERROR:
            self._log(f"{name}: {failure.message}")
        self._fail(id_, failure)

    def _is_cancelled(self, id_: int | str) -> bool:
        """Return whether the request that is to be answered now was cancelled."""
        with self._lock:
            self._waiting[id_] -= 1
            if not self._waiting[id_]:
                del self._waiting[id_]
            is_cancelled = id_ in self._cancelled
            self._cancelled.discard(id_)
        return is_cancelled

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
                return RequestError(INVALID_PARAMS, str(error)), None
            return RequestError(INTERNAL_ERROR, f"{kind}: {error}"), None

    def _fail(self, id_: int | str | None, error: RequestError) -> None:
        details = {"code": error.code, "message": error.message}
        self._write({"jsonrpc": "2.0", "id": id_, "error": details})

    def _log(self, message: str) -> None:
        self.notify("window/logMessage", {"type": 1, "message": f"idlc: {message}"})

    def notify(self, method: str, params: object) -> None:
        """Send a notification to the client."""
        self._write({"jsonrpc": "2.0", "method": method, "params": params})

    def ask(self, method: str, params: object, answer: Answer | None = None) -> None:
        """Send a request to the client; `answer` takes its result."""
        id_ = self._count
        self._count += 1
        if answer is not None:
            self._asked[id_] = answer
        self._write({"jsonrpc": "2.0", "id": id_, "method": method, "params": params})

    def _write(self, message: object) -> None:
        framing.write(self._writer, self.encode(message))


def _message(body: bytes) -> Message:
    """Return a message; raises RequestError if it is none."""
    try:
        message = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise RequestError(PARSE_ERROR, str(error)) from error
    if not isinstance(message, dict):
        raise RequestError(INVALID_REQUEST, "a message is an object")
    if not isinstance(message.get("method", ""), str):
        raise RequestError(INVALID_REQUEST, "the name of a method is a string")
    id_ = message.get("id")
    if type(id_) not in (int, str, type(None)) or not _is_text(id_):
        raise RequestError(INVALID_REQUEST, "an id is an integer or a string")
    return message


def _params(request: Message) -> object:
    """Return the parameters of a request; raises RequestError for malformed strings."""
    if not _is_text(request):
        raise RequestError(INVALID_PARAMS, "a string has one half of a surrogate pair")
    return request.get("params")


def _is_text(value: object) -> bool:
    """Return whether all strings in a value of JSON can be encoded, as halves of pairs cannot."""
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except (UnicodeEncodeError, RecursionError):
        return False
    return True


def _cancelled(message: Message) -> int | str:
    """Return the id of the request that is cancelled; raises RequestError."""
    params = message.get("params")
    id_ = params.get("id") if isinstance(params, dict) else None
    if not isinstance(id_, (int, str)):
        raise RequestError(INVALID_REQUEST, "an id is an integer or a string")
    return id_


def _is_exit(arrival: Message | RequestError) -> bool:
    return isinstance(arrival, dict) and arrival.get("method") == "exit"
