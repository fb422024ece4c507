"""The messages of a topic for programs with asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any, TypeVar

from idlc.robot.nodes.endpoints import Subscription
from idlc.robot.nodes.interfaces import Interface, MessageLike
from idlc.robot.qos import QoSProfile

M = TypeVar("M", bound=MessageLike)


class Stream(Subscription[M], AsyncIterator[M]):
    """The messages of a topic for asyncio: `async for message in node.subscribe(...)`.

    It needs no executor. It ends when the context is shut down, or at `close`.
    """

    def __init__(self, node: Any, topic: str, interface: Interface, qos: QoSProfile) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._arrived = asyncio.Event()
        self._is_closed = False
        super().__init__(node, topic, interface, lambda _: None, qos)
        node.context.wake_at_shutdown(self)

    def wake(self) -> None:
        """Look at the queue and the context; for any thread."""
        loop = self._loop
        if loop is not None and not self._is_queued and not loop.is_closed():
            self._is_queued = True
            loop.call_soon_threadsafe(self._arrived.set)

    async def __anext__(self) -> M:
        self._loop = asyncio.get_running_loop()
        while not self._is_closed and self.node.context.ok():
            self._is_queued = False
            self._arrived.clear()
            item = self.next_message()
            if item is not None:
                message: M = item[0]
                return message
            await self._arrived.wait()
        self.close()
        raise StopAsyncIteration

    def close(self) -> None:
        """Withdraw the subscription."""
        self.node.destroy_subscription(self)

    def destroy(self) -> None:
        """Withdraw the subscription, and end the iteration."""
        super().destroy()
        self._is_closed = True
        self.wake()

    async def aclose(self) -> None:
        """Withdraw the subscription, for `contextlib.aclosing`."""
        self.close()
