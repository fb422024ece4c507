"""One client's session: how it begins and ends, and who takes what the client says.

An editor waits for the first answer, and other imports than these take longer than the rest.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

from idlc.lsp.methods import METHODS
from idlc.lsp.protocol import capabilities
from idlc.lsp.protocol.errors import (
    INVALID_PARAMS,
    INVALID_REQUEST,
    METHOD_NOT_FOUND,
    NOT_INITIALIZED,
    RequestError,
)

if TYPE_CHECKING:
    from idlc.lsp.workbench import Workbench

#: No process has a higher number.
MAX_PROCESS = 1 << 31


class Session:
    """A session; `notify` and `ask` send something to the client."""

    def __init__(self, notify: Callable[..., None], ask: Callable[..., None]) -> None:
        self.is_shut_down = False
        self._notify = notify
        self._ask = ask
        self._given: dict[str, Any] | None = None

    @cached_property
    def workbench(self) -> Workbench:
        """The documents, and what is known of them."""
        from idlc.lsp.workbench import Workbench

        assert self._given is not None
        return Workbench(self._given, self._notify, self._ask)

    def client_is_gone(self) -> bool:
        """Return whether the process of the client has ended; where that can be asked."""
        client = (self._given or {}).get("processId")
        if not isinstance(client, int) or not 0 < client < MAX_PROCESS or os.name != "posix":
            return False
        try:
            os.kill(client, 0)
        except ProcessLookupError:
            return True
        except OSError:
            return False
        return False

    def answer(self, name: str, params: object) -> object:
        """Return the answer to a request; raises RequestError."""
        if self.is_shut_down or (self._given is not None and name == "initialize"):
            raise RequestError(INVALID_REQUEST, f"`{name}` is not for now")
        if name == "initialize":
            if not isinstance(params, dict):
                raise RequestError(INVALID_PARAMS, "`initialize` needs an object")
            self._given = params
            client = params.get("capabilities")
            return capabilities.answer(client if isinstance(client, dict) else {})
        if self._given is None:
            raise RequestError(NOT_INITIALIZED, "`initialize` comes first")
        if name == "shutdown":
            self.is_shut_down = True
            return None
        if name not in METHODS:
            raise RequestError(METHOD_NOT_FOUND, f"there is no method `{name}`")
        return METHODS[name].call(self.workbench.world, params)

    def take(self, name: str, params: object) -> None:
        """Take a notification; those that are not known, or not for now, are passed over."""
        if self._given is not None and not self.is_shut_down:
            self.workbench.take(name, params)

    def encode(self, message: object) -> bytes:
        """Return a message as JSON."""
        if "workbench" not in self.__dict__:
            return json.dumps(message).encode()
        import msgspec

        try:
            return msgspec.json.encode(message)
        except UnicodeEncodeError:  # words of a client that are no text
            return json.dumps(msgspec.to_builtins(message)).encode()

    def idle(self) -> None:
        """Do what can be done while the client says nothing."""
        if "workbench" in self.__dict__ and not self.is_shut_down:
            self.workbench.idle()

    def prepare(self) -> None:
        """Import what answers, so that the first time takes no longer than others; look around."""
        if "workbench" not in self.__dict__ or self.is_shut_down:
            return
        if any(True for _ in self.workbench.world.documents):
            for method in METHODS.values():
                method.prepare()
        self.workbench.rest()

    def settle(self) -> None:
        """Tell the client which problems there are now, where that changed."""
        if "workbench" in self.__dict__ and not self.is_shut_down:
            self.workbench.settle()
