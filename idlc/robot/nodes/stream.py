"""The messages of a topic for programs with asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import suppress

from idlc.robot.nodes.endpoints import Subscription
from idlc.robot.nodes.interfaces import M


class Stream(Subscription[M]):
    """A subscription that wakes a coroutine, and needs no executor."""

    def open(self) -> None:
        """Declare the subscriber; the running event loop gets the messages."""
        self._loop = asyncio.get_running_loop()
        self._arrived = asyncio.Event()
        self.node.context.sleepers.add(self)
        super().open()

    def wake(self) -> None:
        """Look at the queue and the context; for any thread."""
        if not self._is_queued:
            self._is_queued = True
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._arrived.set)

    async def messages(self) -> AsyncGenerator[M, None]:
        """Yield the messages, until the context is shut down or the subscription destroyed."""
        try:
            while self in self.node.endpoints and self.node.context.ok():
                self._arrived.clear()
                self._is_queued = False
                if (message := self.next_message()) is not None:
                    yield message
                else:
                    await self._arrived.wait()
        finally:
            self.node.destroy_subscription(self)
