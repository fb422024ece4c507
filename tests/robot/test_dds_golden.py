"""Packets of other implementations of DDS, read to the field.

`tests/ros/programs/dds_capture.py` captured them on loopback.
"""

from typing import NamedTuple

import pytest

from idlc.robot.dds import discovery, graph, wire
from tests.support.paths import GOLDEN
from tests.support.refresh import refreshed, wanted

FILES = sorted((GOLDEN / "dds").glob("*.txt"))
ENDPOINTS = {writer for writer, _ in discovery.SEDP.values()}


class Nodes(NamedTuple):
    participant: bytes
    nodes: tuple


def shown(value):
    """Return a value as text: bytes as hexadecimal, and of long ones the beginning."""
    if isinstance(value, bytes):
        text = value.hex() if len(value) <= 24 else f"{value[:24].hex()}... {len(value)} bytes"
        return text or "nothing"
    if isinstance(value, dict):
        return " ".join(f"{name:04x}={','.join(map(shown, each))}" for name, each in value.items())
    return str(value)


def fields(value):
    return ", ".join(f"{name}: {shown(each)}" for name, each in value._asdict().items())


def meaning(part):
    """Yield what a sample says of a participant, an endpoint or nodes."""
    if not isinstance(part, wire.Data) or part.is_key:
        return
    if part.writer == discovery.SPDP_WRITER:
        yield discovery.parse_participant(part.payload)
    elif part.writer in ENDPOINTS:
        yield discovery.parse_endpoint(part.payload)
    elif part.writer[3] == 3 and len(part.payload) > 60:
        try:
            yield Nodes(*graph.parse_info(part.payload))
        except wire.WireError:
            return


def described(data):
    packet = wire.parse_packet(data)
    yield f"from {shown(packet.prefix)}, vendor {shown(packet.vendor)}"
    for destination, part in packet.parts:
        yield f"{type(part).__name__} for {shown(destination)}: {fields(part)}"
        if isinstance(part, wire.Data) and (guid := discovery.ended(part)):
            yield f"  the end of {shown(guid)}"
        for value in meaning(part):
            yield f"  {type(value).__name__}: {fields(value)}"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_packets_are_read_to_the_field(path):
    text = path.read_text(encoding="ascii")
    packets = [line for line in text.splitlines() if line.startswith("52545053")]
    lines = []
    for packet in packets:
        lines += [packet, *(f"  {line}" for line in described(bytes.fromhex(packet))), ""]
    if wanted(path.name):
        path.write_text("\n".join(lines), encoding="ascii")
        refreshed()
    assert text.splitlines() == lines[:-1]


def test_each_kind_of_part_was_captured():
    text = "".join(path.read_text(encoding="ascii") for path in FILES)
    kinds = ("Data", "Fragment", "Heartbeat", "AckNack", "NackFragment", "Gap")
    missing = [kind for kind in kinds if f"\n  {kind} for " not in text]
    assert missing == []
