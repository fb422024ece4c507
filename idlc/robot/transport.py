"""The interface between idlc.robot and a middleware; `zenoh_transport.py` is the one for Zenoh.

Payloads and attachments are bytes. Callbacks run on threads of the middleware: they hand over to
a queue, return at once, and never close anything. All `close` methods may be called twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, Protocol, TypeAlias

from idlc.robot.keys import Entity
from idlc.runtime.typeinfo import structure_of


class Sample(NamedTuple):
    """A message or a reply; the attachment is empty if the sender sent none."""

    payload: bytes
    attachment: bytes


#: Middlewares pad messages to a multiple of four bytes.
MOST_PADDING = 3


def unread_bytes(payload: bytes, message: Any) -> int:
    """Return how many bytes of a payload its message does not have, 0 if it may be padding."""
    try:
        unread = len(payload) - len(message.serialize())
    except (TypeError, ValueError):  # what others sent need not be valid
        return 0
    if unread <= MOST_PADDING:
        return 0
    from idlc.recordings.lengths import estimated_size

    estimated = estimated_size(structure_of(type(message)), payload)
    return 0 if 0 <= len(payload) - estimated <= MOST_PADDING else unread


#: Receives each reply, and at the end once `None`.
OnReply: TypeAlias = Callable[[Sample | None], None]


class Closeable(Protocol):
    """A declaration that lasts until it is closed."""

    def close(self) -> None:
        """Withdraw the declaration; afterwards, no new callback starts."""


class Sender(Closeable, Protocol):
    """A declared publisher."""

    def put(self, payload: bytes, *, attachment: bytes) -> None:
        """Send a message."""


class Request(Protocol):
    """A request that a service received; the attachment is empty if the client sent none."""

    payload: bytes
    attachment: bytes

    def reply(self, payload: bytes, attachment: bytes) -> None:
        """Send the reply and finish; it may run later, on any thread."""

    def drop(self) -> None:
        """Finish without a reply, so that the client does not wait for one."""


class Transport(Protocol):
    """A connection to other programs; the `session` of its own entities is its `id`.

    If `connects_all` is true, ends with QoS that does not fit are connected, too.
    """

    id: str
    connects_all: bool

    def gid(self, entity: Entity) -> bytes:
        """Return the 16 bytes by which others know an endpoint of this connection."""

    def publisher(self, entity: Entity) -> Sender:
        """Declare a publisher; one that is latched keeps its last messages."""

    def subscriber(self, entity: Entity, callback: Callable[[Sample], None]) -> Closeable:
        """Call `callback` with each message; a latched profile also gets earlier ones."""

    def service(self, entity: Entity, callback: Callable[[Request], None]) -> Closeable:
        """Call `callback` with each request."""

    def call(
        self,
        entity: Entity,
        payload: bytes,
        attachment: bytes,
        callback: OnReply,
        *,
        timeout: float,
    ) -> None:
        """Send a request of a client.

        The end comes when all services have replied, or after `timeout` seconds.
        """

    def announce(self, entity: Entity) -> Closeable:
        """Show a node or an endpoint to all sessions while the declaration lasts."""

    def watch(self, domain: int, callback: Callable[[Entity, bool], None]) -> Closeable:
        """Call `callback` with each entity of a domain, now and later: True appears, False goes."""

    def entities(self, domain: int | None, timeout: float) -> Iterable[Entity]:
        """Yield the entities of a domain that exist now; `None`: of all that can be seen.

        Raises TimeoutError after `timeout` seconds if answers may be missing.
        """

    def pump(self, timeout: float, is_idle: Callable[[], bool]) -> bool:
        """Receive on this thread for `timeout` seconds at most, while `is_idle()`.

        Callbacks run on this thread then. Returns False at once if another thread receives.
        """

    def wake(self) -> None:
        """End `pump`; for any thread, also in signal handlers."""

    def notes(self) -> list[str]:
        """Return sentences about what this connection cannot show."""

    def close(self) -> None:
        """Close the connection; all declarations end with it."""
