"""Writers: they send samples to the matched readers, and again to those that lack them."""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple

from idlc.robot.dds import formats, wire
from idlc.robot.dds.reader import Address, Outgoing, Reader, Received
from idlc.robot.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

#: Seconds between heartbeats for readers that lack something.
HEARTBEAT = 0.1
#: Bytes of a history; the newest sample is kept, however large it is.
MOST_HISTORY = 256 << 20
#: Bytes that one question of a reader draws.
_MOST_RESENT = 4 << 20


class RemoteReader:
    """What a writer knows of a reader: its address, and the first number that it lacks."""

    def __init__(self, guid: bytes, address: Address, reliable: bool, size: int, base: int) -> None:
        self.guid = guid
        self.address = address
        self.reliable = reliable
        #: The most bytes of a fragment.
        self.size = size
        self.start = self.base = base
        self.count = -1
        #: True after it has said which number it wants, as it then has a heartbeat.
        self.is_told = False


class Sample(NamedTuple):
    """A sample in a history."""

    payload: bytes
    inline: bytes
    time: int


def _padded(payload: bytes) -> bytes:
    """Return a payload of whole words; the options of its encapsulation tell what was added."""
    pad = -len(payload) % 4
    return payload[:3] + bytes([pad]) + payload[4:] + bytes(pad) if pad else payload


def unpadded(payload: bytes) -> bytes:
    """Return a payload as its program wrote it."""
    pad = payload[3] & 3 if len(payload) > 7 else 0
    return payload[:3] + b"\0" + payload[4:-pad] if pad else payload


class Writer:
    """Sends samples to the matched readers, and again to those that lack them."""

    def __init__(self, guid: bytes, qos: QoSProfile) -> None:
        self.guid = guid
        self.qos = qos
        self.reliable = qos.reliability is not ReliabilityPolicy.BEST_EFFORT
        self.readers: dict[bytes, RemoteReader] = {}
        self.local: list[Reader] = []
        self.history: OrderedDict[int, Sample] = OrderedDict()
        self.last = 0
        #: When the next heartbeat is due; `None` if all readers have everything.
        self.deadline: float | None = None
        self._count = 0
        self._bytes = 0
        self._depth = None if qos.history is HistoryPolicy.KEEP_ALL else qos.depth

    def match(
        self, guid: bytes, address: Address, qos: QoSProfile, size: int, now: float
    ) -> list[Outgoing]:
        """Send to a reader from now on, and what is kept if both sides want that."""
        out: list[Outgoing] = []
        if guid in self.readers:
            return out
        reliable = self.reliable and qos.reliability is not ReliabilityPolicy.BEST_EFFORT
        is_late = self.qos.is_latched and qos.is_latched
        first = next(iter(self.history), self.last + 1) if is_late else self.last + 1
        reader = self.readers[guid] = RemoteReader(guid, address, reliable, size, first)
        if reliable:
            self.deadline = now
        elif is_late:  # such a reader never asks
            for number, sample in self.history.items():
                self._send(reader, number, sample, out)
        return out + self.tick(now)

    def match_local(self, reader: Reader) -> None:
        """Deliver to a reader of the same participant."""
        self.local.append(reader)
        if self.qos.is_latched and reader.qos.is_latched:
            for number, sample in self.history.items():
                reader.deliver(Received(self.guid, number, *self._parsed(sample)))

    def unmatch(self, guid: bytes) -> None:
        """Forget a reader."""
        self.readers.pop(guid, None)

    def write(self, payload: bytes, inline: bytes, time: int, now: float) -> list[Outgoing]:
        """Send a sample to all readers; it stays in the history."""
        payload = _padded(payload)
        self.last += 1
        sample = self.history[self.last] = Sample(payload, inline, time)
        self._bytes += len(payload)
        while self._bytes > MOST_HISTORY or len(self.history) == (self._depth or 0) + 1:
            if len(self.history) == 1:
                break
            self._bytes -= len(self.history.popitem(last=False)[1].payload)
        out: list[Outgoing] = []
        for reader in self.readers.values():
            self._send(reader, self.last, sample, out)
            if reader.reliable:
                out[-1] = out[-1]._replace(parts=(*out[-1].parts, self._heartbeat(reader)))
                self.deadline = self.deadline or now + HEARTBEAT
        for local in self.local:
            local.deliver(Received(self.guid, self.last, *self._parsed(sample)))
        if not (self.reliable or self.qos.is_latched):
            self.history.clear()
            self._bytes = 0
        return out

    def forget(self, number: int) -> None:
        """Remove a sample from the history."""
        if (sample := self.history.pop(number, None)) is not None:
            self._bytes -= len(sample.payload)

    @staticmethod
    def _parsed(sample: Sample) -> tuple[wire.Parameters, bytes, bool, int]:
        inline = wire.parse_parameters(sample.inline, 0, "<")[0] if sample.inline else wire.NONE
        return inline, sample.payload, not sample.payload, sample.time

    def _send(
        self,
        reader: RemoteReader,
        number: int,
        sample: Sample,
        out: list[Outgoing],
        chosen: tuple[int, ...] = (),
    ) -> None:
        """Send a sample to a reader; of its fragments only the chosen ones, if any are."""
        payload, inline, time = sample
        ids = reader.guid[wire.PREFIX :], self.guid[wire.PREFIX :]
        stamp, prefix = formats.at_time(time), reader.guid[: wire.PREFIX]
        if len(payload) <= reader.size:
            part = formats.format_data(*ids, number, inline, payload)
            out.append(Outgoing(reader.address, prefix, (stamp, part)))
            return
        count = -(-len(payload) // reader.size)
        for first in chosen or range(1, count + 1):
            if 0 < first <= count:
                part = formats.format_fragment(*ids, number, inline, payload, first, reader.size)
                out.append(Outgoing(reader.address, prefix, (stamp, part)))

    def _heartbeat(self, reader: RemoteReader) -> bytes:
        self._count += 1
        first = max(next(iter(self.history), self.last + 1), reader.start)
        ids = reader.guid[wire.PREFIX :], self.guid[wire.PREFIX :]
        return formats.format_heartbeat(*ids, first, self.last, self._count)

    def acknack(self, guid: bytes, part: wire.AckNack, now: float) -> list[Outgoing]:
        """Send what a reader lacks, or say that it never comes."""
        reader, out = self.readers.get(guid), list[Outgoing]()
        if reader is None or not reader.reliable or part.base > self.last + 1:
            return out
        if part.beat == reader.count:
            return out  # the network repeated it
        reader.count = part.beat
        reader.base = max(reader.base, part.base)
        reader.is_told |= part.base > 0
        room = _MOST_RESENT
        for number in part.missing:
            sample = self.history.get(number) if number >= reader.start else None
            if sample is not None and room > 0:
                room -= len(sample.payload)
                self._send(reader, number, sample, out)
            elif sample is None and number <= self.last:
                ids = guid[wire.PREFIX :], self.guid[wire.PREFIX :]
                gap = formats.format_gap(*ids, number, number + 1)
                out.append(Outgoing(reader.address, guid[: wire.PREFIX], (gap,)))
        if part.missing or part.base == 0:
            self._beat(reader, out)
            self.deadline = self.deadline or now + HEARTBEAT
        return out

    def nack_fragment(self, guid: bytes, part: wire.NackFragment) -> list[Outgoing]:
        """Send fragments again."""
        reader, sample = self.readers.get(guid), self.history.get(part.number)
        out: list[Outgoing] = []
        if reader and sample and reader.reliable and part.missing:
            self._send(reader, part.number, sample, out, part.missing)
            self._beat(reader, out)
        return out

    def _beat(self, reader: RemoteReader, out: list[Outgoing]) -> None:
        prefix = reader.guid[: wire.PREFIX]
        out.append(Outgoing(reader.address, prefix, (self._heartbeat(reader),)))

    def tick(self, now: float) -> list[Outgoing]:
        """Send heartbeats to the readers that lack something, if they are due."""
        out: list[Outgoing] = []
        if self.deadline is None or now < self.deadline:
            return out
        for reader in self.readers.values():
            if reader.reliable and (reader.base <= self.last or not reader.is_told):
                self._beat(reader, out)
        self.deadline = now + HEARTBEAT if out else None
        return out
