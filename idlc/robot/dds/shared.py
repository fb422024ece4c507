"""What the ends of a participant share: the time, packets to send, and room for samples."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

from idlc.robot.dds import wire

#: The IP address and the port of a socket.
Address: TypeAlias = tuple[str, int]
#: Bytes of all samples that cannot be delivered yet.
MOST_WAITING = 512 << 20


def is_cyclone(guid: bytes) -> bool:
    """Return whether an end is of Cyclone DDS, with which GUIDs there begin."""
    return guid.startswith(b"\x01\x10")


class Outgoing(NamedTuple):
    """Parts of a packet for a participant at an address."""

    address: Address
    prefix: bytes
    parts: tuple[bytes, ...]


class Remote:
    """The other end of a connection."""

    def __init__(self, guid: bytes, address: Address, reliable: bool) -> None:
        self.guid = guid
        self.prefix, self.id = guid[: wire.PREFIX], guid[wire.PREFIX :]
        self.address = address
        self.reliable = reliable


class Shared:
    """What the ends of a participant share: the time, packets to send, and room for samples.

    `fragment` returns the most bytes of a fragment for a host. Of the room, a participant gets at
    most as much as is left for the others.
    """

    def __init__(self, fragment: Callable[[str], int]) -> None:
        self.fragment = fragment
        self.now = 0.0
        #: What the ends have to do, and when.
        self.due: dict[Callable[[], None], float] = {}
        self._packets: list[Outgoing] = []
        self._used: Counter[bytes] = Counter()

    def send(self, end: Remote, *parts: bytes) -> None:
        """Send parts of a packet to an end."""
        self._packets.append(Outgoing(end.address, end.prefix, parts))

    def tick(self) -> None:
        """Do what is due."""
        for action in [action for action, time in self.due.items() if time <= self.now]:
            del self.due[action]
            action()

    def collect(self) -> list[Outgoing]:
        """Return the packets to send, once."""
        packets, self._packets = self._packets, []
        return packets

    def take(self, prefix: bytes, size: int) -> bool:
        """Take bytes for samples of a participant; return whether there was room."""
        if self._used[prefix] + size > MOST_WAITING - self._used.total():
            return False
        self._used[prefix] += size
        return True

    def free(self, prefix: bytes, size: int) -> None:
        """Give bytes back."""
        self._used[prefix] -= size
        if not self._used[prefix]:
            del self._used[prefix]


class Received(NamedTuple):
    """A sample as a reader's callback gets it; without a payload, an instance ended."""

    writer: bytes
    number: int
    parameters: wire.Parameters
    payload: bytes
    is_key: bool
    time: int
