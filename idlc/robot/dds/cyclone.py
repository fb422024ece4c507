"""Requests and replies as rmw_cyclonedds sends them.

The payload begins with 8 bytes that its client chose, and the number of the request. Others name a
request by inline parameters, and would take these bytes for fields.
"""

from __future__ import annotations

import struct

from idlc.robot.dds import discovery, wire
from idlc.robot.dds.shared import Received, is_cyclone

#: The encapsulation, and what follows it.
_HEAD, _START = 4, 20


def _order(payload: bytes) -> str:
    return "<" if payload[1] & 1 else ">"


def wrap(payload: bytes, inline: bytes) -> bytes:
    """Return a request or reply for Cyclone DDS; `inline` names the request."""
    named = discovery.related(wire.parse_parameters(inline, 0, "<")[0])
    if named is None:
        return payload
    client, number = named
    (client_id,) = struct.unpack_from("<8xQ", client)
    head = struct.pack(_order(payload) + "Qq", client_id, number)
    return payload[:_HEAD] + head + payload[_HEAD:]


def unwrap(received: Received, start: bytes) -> tuple[bytes, tuple[bytes, int] | None]:
    """Return the payload of a request or reply, and the client and number that it names.

    Of a client of Cyclone DDS, the name is 8 bytes, which follow `start`.
    """
    payload = received.payload
    if not is_cyclone(received.writer):
        return payload, discovery.related(received.parameters)
    if len(payload) < _START:
        return payload, None
    client_id, number = struct.unpack_from(_order(payload) + "Qq", payload, _HEAD)
    name = start + struct.pack("<Q", client_id)
    return payload[:_HEAD] + payload[_START:], (name, number)
