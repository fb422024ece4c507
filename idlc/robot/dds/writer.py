"""Writers: they send samples to the matched readers, and again to those that lack them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from typing import NamedTuple

from idlc.robot.dds import formats, wire
from idlc.robot.dds.formats import Address, Remote, Shared, is_cyclone
from idlc.robot.dds.reader import Reader
from idlc.robot.qos import HistoryPolicy, QoSProfile

#: Seconds between heartbeats for readers that lack something.
HEARTBEAT = 0.1
#: Bytes of a history; the newest sample is kept, however large it is.
MOST_HISTORY = 256 << 20


class RemoteReader(Remote):
    """A matched reader: the size of its fragments, and the first number that it lacks."""

    def __init__(self, guid: bytes, address: Address, reliable: bool, size: int, base: int) -> None:
        super().__init__(guid, address, reliable)
        self.size = size
        self.start = self.base = base
        self.count = -1
        #: True after it has said which number it wants, as it then has a heartbeat.
        self.is_told = False
        #: True until it answers the first heartbeat. A volatile reader of Cyclone DDS skips the
        #: samples that this heartbeat announces, so new samples wait for its answer.
        self.waits = False


class HistorySample(NamedTuple):
    """A sample in a history."""

    payload: bytes
    inline: bytes
    time: int
    written: float


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

    def __init__(self, guid: bytes, qos: QoSProfile, shared: Shared) -> None:
        self.guid = guid
        self.id = guid[wire.PREFIX :]
        self.qos = qos
        self.reliable = qos.is_reliable
        self.readers: dict[bytes, RemoteReader] = {}
        self.local: list[Reader] = []
        self.history: OrderedDict[int, HistorySample] = OrderedDict()
        self.last, self.is_closed = 0, False
        self._shared = shared
        self._count = 0
        self._bytes = 0
        self._depth = None if qos.history is HistoryPolicy.KEEP_ALL else qos.depth

    def match(self, guid: bytes, address: Address, qos: QoSProfile) -> None:
        """Send to a reader from now on, and what is kept if both sides want that."""
        if guid in self.readers:
            return
        self._expire()
        reliable = self.reliable and qos.is_reliable
        is_late = self.qos.is_latched and qos.is_latched
        first = next(iter(self.history), self.last + 1) if is_late else self.last + 1
        size = self._shared.fragment(address[0])
        reader = self.readers[guid] = RemoteReader(guid, address, reliable, size, first)
        if reliable:
            reader.waits = is_cyclone(guid) and not is_late
            self._shared.send(reader, self._heartbeat(reader))
            self._expect()
        elif is_late:  # such a reader never asks
            for number, sample in self.history.items():
                if self._shared.may_draw(reader.prefix, len(sample.payload)):
                    self._send(reader, number)

    def match_local(self, reader: Reader) -> None:
        """Deliver to a reader of the same participant."""
        self._expire()
        self.local.append(reader)
        if self.qos.is_latched and reader.qos.is_latched:
            for number, sample in [*self.history.items()]:
                self._deliver(reader, number, sample)

    def close(self) -> None:
        """Forget all readers."""
        self.is_closed = True
        self.readers.clear()
        self.local.clear()

    def unmatch(self, guid: bytes) -> None:
        """Forget a reader."""
        self.readers.pop(guid, None)

    def write(self, payload: bytes, inline: bytes = b"", time: int = 0) -> None:
        """Send a sample to all readers; it stays in the history."""
        payload = _padded(payload)
        self.last += 1
        sample = self.history[self.last] = HistorySample(payload, inline, time, self._shared.now)
        self._bytes += len(payload)
        while self._bytes > MOST_HISTORY or len(self.history) == (self._depth or 0) + 1:
            if len(self.history) == 1:
                break
            self._bytes -= len(self.history.popitem(last=False)[1].payload)
        for reader in self.readers.values():
            if reader.waits:
                continue
            if reader.reliable:
                self._send(reader, self.last, self._heartbeat(reader))
                self._expect()
            else:
                self._send(reader, self.last)
        for local in [*self.local]:
            self._deliver(local, self.last, sample)
        if not (self.reliable or self.qos.is_latched):
            self.history.clear()
            self._bytes = 0

    def _expire(self) -> None:
        """Forget the samples whose lifespan has ended."""
        limit = self._shared.now - self.qos.lifespan / 1e9
        while self.history and next(iter(self.history.values())).written < limit:
            self.forget(next(iter(self.history)))

    def forget(self, number: int) -> None:
        """Remove a sample from the history."""
        if (sample := self.history.pop(number, None)) is not None:
            self._bytes -= len(sample.payload)

    def _deliver(self, reader: Reader, number: int, sample: HistorySample) -> None:
        """Deliver a sample to a reader of the same participant."""
        payload, inline, time, _ = sample
        parameters = wire.parse_parameters(inline, 0, "<")[0] if inline else wire.NONE
        reader.deliver(
            wire.Data(reader.id, self.guid, number, parameters, payload, not payload, time)
        )

    def _send(
        self, reader: RemoteReader, number: int, *tail: bytes, chosen: Sequence[int] = ()
    ) -> None:
        """Send a sample to a reader; of its fragments only the chosen ones, if any are.

        `tail` follows in the same packet.
        """
        payload, inline, time, _ = self.history[number]
        if inline and payload and is_cyclone(reader.guid):
            payload, inline = formats.wrap(payload, inline), b""
        ids, size, stamp = (reader.id, self.id, number, inline), reader.size, formats.at_time(time)
        if len(payload) <= size:
            self._shared.send(reader, stamp, formats.format_data(*ids, payload), *tail)
            return
        count = -(-len(payload) // size)
        numbers = [first for first in chosen or range(1, count + 1) if 0 < first <= count]
        for first in numbers:
            part = formats.format_fragment(*ids, payload, first, size)
            self._shared.send(reader, stamp, part, *(tail if first == numbers[-1] else ()))

    def _heartbeat(self, reader: RemoteReader) -> bytes:
        self._count += 1
        first = max(next(iter(self.history), self.last + 1), reader.start)
        first, last = (reader.start, reader.start - 1) if reader.waits else (first, self.last)
        return formats.format_heartbeat(reader.id, self.id, first, last, self._count)

    def receive(self, guid: bytes, part: wire.AckNack | wire.NackFragment) -> None:
        """Send again what a reader asks for."""
        reader = self.readers.get(guid)
        if reader is None or not reader.reliable:
            return
        if isinstance(part, wire.AckNack):
            self._acknack(reader, part)
        else:
            self._nack_fragment(reader, part)

    def _acknack(self, reader: RemoteReader, part: wire.AckNack) -> None:
        """Send what a reader lacks, or say that it never comes."""
        if part.base > self.last + 1 or part.beat == reader.count:
            return  # the network repeats packets
        self._expire()
        reader.count = part.beat
        reader.base = max(reader.base, part.base)
        # Cyclone DDS counts its answers from 1, and its question after the match is 0
        if reader.waits and part.beat and part.base >= reader.start:
            reader.waits = False
            end = min(self.last + 1, part.base + wire.MOST_BITS)
            part = part._replace(missing=tuple(range(part.base, end)))
        reader.is_told |= part.base > 0 and not reader.waits
        gone = []
        for number in part.missing:
            sample = self.history.get(number) if number >= reader.start else None
            if sample is None:
                gone += [number] if number <= self.last else []
            elif self._shared.may_draw(reader.prefix, len(sample.payload)):
                self._send(reader, number)
        if gone and self._shared.may_draw(reader.prefix, 0):
            self._shared.send(reader, formats.format_gap(reader.id, self.id, gone))
        is_asking = part.missing or part.base == 0 or reader.waits
        if is_asking and self._shared.may_draw(reader.prefix, 0):
            self._shared.send(reader, self._heartbeat(reader))
            self._expect()

    def _nack_fragment(self, reader: RemoteReader, part: wire.NackFragment) -> None:
        """Send fragments again."""
        if part.number not in self.history:
            return
        may_draw = self._shared.may_draw
        chosen = [each for each in part.missing if may_draw(reader.prefix, reader.size)]
        if chosen:
            self._send(reader, part.number, self._heartbeat(reader), chosen=chosen)

    def _expect(self) -> None:
        """Send heartbeats until the readers have everything."""
        self._shared.due.setdefault(self.tick, self._shared.now + HEARTBEAT)

    def tick(self) -> None:
        """Send heartbeats to the readers that lack something."""
        for reader in self.readers.values():
            if reader.reliable and (reader.base <= self.last or not reader.is_told):
                self._shared.send(reader, self._heartbeat(reader))
                self._expect()
