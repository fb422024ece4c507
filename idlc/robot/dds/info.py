"""The topic `ros_discovery_info`, by which ROS 2 on DDS says which node has which endpoints."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import NamedTuple

from idlc.robot.dds.wire import GUID, WireError

TOPIC = "ros_discovery_info"
TYPE = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
_MOST_NODES = 1024
_MOST_ENDS = 4096
_MOST_NAME = 512
#: Bytes of a message.
_MOST = 2**20


class NodeInfo(NamedTuple):
    """A node, and the GUIDs of its endpoints."""

    namespace: str
    name: str
    readers: tuple[bytes, ...]
    writers: tuple[bytes, ...]


class _Cursor:
    """Reads CDR; raises WireError where it ends early or is too large."""

    def __init__(self, payload: bytes) -> None:
        self.order = "<" if payload[1:2] == b"\x01" else ">"
        self.data = payload[4:]
        self.at = 0

    def take(self, size: int) -> bytes:
        """Return bytes."""
        if size > len(self.data) - self.at:
            raise WireError("cut off")
        self.at += size
        return self.data[self.at - size : self.at]

    def count(self, most: int) -> int:
        """Return a length."""
        self.at += -self.at % 4
        (number,) = struct.unpack(self.order + "I", self.take(4))
        if number > most:
            raise WireError("too many")
        return int(number)

    def text(self) -> str:
        """Return a string."""
        data = self.take(self.count(_MOST_NAME))
        try:
            return data.rstrip(b"\0").decode("ascii")
        except UnicodeDecodeError:
            raise WireError("a name that is not ASCII") from None

    def gids(self, size: int) -> tuple[bytes, ...]:
        """Return GUIDs."""
        return tuple(self.take(size)[:GUID] for _ in range(self.count(_MOST_ENDS)))


def parse_info(payload: bytes) -> tuple[bytes, tuple[NodeInfo, ...]]:
    """Return the GUID of a participant and its nodes; raise WireError.

    The ids have 24 bytes on Humble and 16 since; only one of the two fits the payload.
    """
    if len(payload) > _MOST:
        raise WireError("too large")
    try:
        return _parse(payload, GUID)
    except WireError:
        return _parse(payload, 24)


def _parse(payload: bytes, size: int) -> tuple[bytes, tuple[NodeInfo, ...]]:
    cursor = _Cursor(payload)
    guid = cursor.take(size)[:GUID]
    nodes = tuple(
        NodeInfo(cursor.text(), cursor.text(), cursor.gids(size), cursor.gids(size))
        for _ in range(cursor.count(_MOST_NODES))
    )
    if len(cursor.data) - cursor.at > 3:  # more than the padding
        raise WireError("a rest")
    return guid, nodes


def format_info(prefix: bytes, nodes: Iterable[NodeInfo]) -> bytes:
    """Return the message about the own participant."""
    data = bytearray(prefix + b"\x00\x00\x01\xc1")

    def add_count(number: int) -> None:
        data.extend(bytes(-len(data) % 4) + struct.pack("<I", number))

    nodes = [*nodes]
    add_count(len(nodes))
    for node in nodes:
        for text in (node.namespace, node.name):
            name = text.encode() + b"\0"
            add_count(len(name))
            data.extend(name)
        for guids in (node.readers, node.writers):
            add_count(len(guids))
            data.extend(b"".join(guids))
    return b"\x00\x01\x00\x00" + bytes(data)
