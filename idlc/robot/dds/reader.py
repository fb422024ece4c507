"""Readers: they deliver the samples of writers in order, and ask for what is missing."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

from idlc.robot.dds import formats, wire
from idlc.robot.qos import QoSProfile, ReliabilityPolicy

#: The IP address and the port of a socket.
Address: TypeAlias = tuple[str, int]
#: Bytes of a sample, and of the samples of one writer that cannot be delivered yet.
MOST_SAMPLE = 64 << 20
MOST_WAITING = 64 << 20
#: Numbers that a reader asks for at a time, and samples of which it holds fragments.
_AHEAD = 256
_MOST_PARTIAL = 8
#: Cyclone DDS as a vendor.
_CYCLONE = b"\x01\x10"


class Outgoing(NamedTuple):
    """Parts of a packet for a participant at an address."""

    address: Address
    prefix: bytes
    parts: tuple[bytes, ...]


class Received(NamedTuple):
    """A sample as a reader's callback gets it; without a payload, an instance ended."""

    writer: bytes
    number: int
    parameters: wire.Parameters
    payload: bytes
    is_key: bool
    time: int


class _Partial:
    """Fragments of a sample by their numbers."""

    def __init__(self, part: wire.Fragment) -> None:
        self.size, self.total = part.size, part.total
        self.parameters, self.time = part.parameters, part.time
        self.parts: dict[int, bytes] = {}
        self.count = -(-part.total // part.size)

    def add(self, part: wire.Fragment) -> int:
        """Add fragments; return how many bytes were new."""
        added, number = 0, part.first
        for at in range(0, len(part.payload), part.size):
            piece = part.payload[at : at + part.size]
            if number <= self.count and number not in self.parts:
                piece = piece[: self.total - (number - 1) * self.size]
                self.parts[number] = piece
                added += len(piece)
            number += 1
        return added

    def missing(self) -> list[int]:
        """Return the numbers of missing fragments, of 256 from the first of them."""
        numbers = range(1, self.count + 1)
        first = next((number for number in numbers if number not in self.parts), 0)
        return [n for n in range(first, min(first + _AHEAD, self.count + 1)) if n not in self.parts]


class RemoteWriter:
    """What a reader knows of a writer, and the samples of it that wait for earlier ones."""

    def __init__(self, guid: bytes, address: Address, reliable: bool) -> None:
        self.guid = guid
        self.address = address
        self.reliable = reliable
        #: The number of the next sample to deliver. Of a reliable writer it is `None` until the
        #: first heartbeat: the writer may know the reader, and send to it, before the reader knows
        #: the writer. Gaps tell what a late reader has missed.
        self.next: int | None = None
        #: The number of the newest sample that it has told of.
        self.last = 0
        self.early: dict[int, Received | None] = {}
        self.partial: OrderedDict[int, _Partial] = OrderedDict()
        self.bytes = 0
        self.count = 0


class Reader:
    """Delivers the samples of the matched writers in order: reliable ones without gaps."""

    def __init__(self, guid: bytes, qos: QoSProfile, deliver: Callable[[Received], None]) -> None:
        self.guid = guid
        self.qos = qos
        self.deliver = deliver
        self.reliable = qos.reliability is not ReliabilityPolicy.BEST_EFFORT
        self.writers: dict[bytes, RemoteWriter] = {}
        #: Samples that were not delivered, because they were too large or too many.
        self.lost = 0

    @property
    def is_complete(self) -> bool:
        """True if each writer has told what it has, and nothing of that is missing."""
        return all(
            writer.next is not None and writer.next > writer.last
            for writer in self.writers.values()
            if writer.reliable
        )

    def match(self, guid: bytes, address: Address, qos: QoSProfile) -> None:
        """Receive from a writer."""
        reliable = self.reliable and qos.reliability is not ReliabilityPolicy.BEST_EFFORT
        if guid not in self.writers:
            self.writers[guid] = RemoteWriter(guid, address, reliable)

    def unmatch(self, guid: bytes) -> None:
        """Forget a writer."""
        self.writers.pop(guid, None)

    def ask(self, guid: bytes) -> Outgoing | None:
        """Return the question by which a writer learns that this reader is there."""
        writer = self.writers[guid]
        if not writer.reliable:
            return None
        writer.count += 1
        ids = self.guid[wire.PREFIX :], guid[wire.PREFIX :]
        # 0 asks where to begin; Cyclone DDS calls it malformed
        first = 1 if guid.startswith(_CYCLONE) else 0
        part = formats.format_acknack(*ids, writer.next or first, [], writer.count)
        # it is not final: the writer has to answer
        part = part[:1] + bytes([part[1] & ~2]) + part[2:]
        return Outgoing(writer.address, guid[: wire.PREFIX], (part,))

    def data(self, guid: bytes, part: wire.Data) -> None:
        """Take a sample."""
        writer = self.writers.get(guid)
        if writer is not None:
            self._take(writer, Received(guid, *part[2:]))

    def _take(self, writer: RemoteWriter, sample: Received) -> None:
        if writer.next is None and not writer.reliable:
            writer.next = sample.number
        if writer.next is not None and sample.number < writer.next:
            return
        if not writer.reliable:
            writer.next = sample.number + 1
            self.deliver(sample)
            return
        if writer.next == sample.number:
            # without the way through the dictionary, as nearly all samples arrive in order
            self._drop_partial(writer, sample.number)
            writer.next += 1
            self.deliver(sample)
        elif sample.number not in writer.early:
            size = len(sample.payload)
            if len(writer.early) >= _AHEAD or writer.bytes + size > MOST_WAITING:
                return  # the writer has to send it again
            self._drop_partial(writer, sample.number)
            writer.early[sample.number] = sample
            writer.bytes += size
        if writer.early:
            self._drain(writer)

    def _drain(self, writer: RemoteWriter) -> None:
        while writer.next is not None and writer.next in writer.early:
            sample = writer.early.pop(writer.next)
            writer.next += 1
            if sample is not None:
                writer.bytes -= len(sample.payload)
                self.deliver(sample)

    @staticmethod
    def _drop_partial(writer: RemoteWriter, number: int) -> None:
        if (partial := writer.partial.pop(number, None)) is not None:
            writer.bytes -= sum(map(len, partial.parts.values()))

    def fragment(self, guid: bytes, part: wire.Fragment) -> None:
        """Take fragments; the last one completes the sample."""
        writer = self.writers.get(guid)
        if writer is None or part.number in writer.early:
            return
        if writer.next is not None and part.number < writer.next:
            return
        if part.total > MOST_SAMPLE:
            self.lost += 1
            writer.early.setdefault(part.number, None)  # else the reader would ask for ever
            self._drain(writer)
            return
        partial = writer.partial.get(part.number)
        if partial is None:
            while len(writer.partial) >= (_MOST_PARTIAL if writer.reliable else 2):
                # a reliable reader asks for it again
                self._drop_partial(writer, next(reversed(writer.partial)))
            partial = writer.partial[part.number] = _Partial(part)
        if (partial.size, partial.total) != (part.size, part.total):
            return
        if writer.bytes + len(part.payload) > MOST_WAITING + MOST_SAMPLE:
            return
        writer.bytes += partial.add(part)
        if len(partial.parts) == partial.count:
            payload = b"".join(partial.parts[number] for number in range(1, partial.count + 1))
            self._drop_partial(writer, part.number)
            values = (guid, part.number, partial.parameters, payload, False, partial.time)
            self._take(writer, Received(*values))

    def gap(self, guid: bytes, part: wire.Gap) -> None:
        """Go on without numbers that never come."""
        writer = self.writers.get(guid)
        if writer is None or not writer.reliable:
            return
        if writer.next is None:
            writer.next = part.first
        if part.first <= writer.next < part.base:
            self._skip(writer, part.base)
        for number in part.others[:_AHEAD]:
            if number >= writer.next and len(writer.early) < 2 * _AHEAD:
                writer.early.setdefault(number, None)
        if part.first > writer.next:
            for number in range(part.first, min(part.base, part.first + _AHEAD)):
                if len(writer.early) < 2 * _AHEAD:
                    writer.early.setdefault(number, None)
        self._drain(writer)

    def _skip(self, writer: RemoteWriter, number: int) -> None:
        """Deliver what has arrived below a number, and go on at it."""
        for early in sorted(n for n in writer.early if n < number):
            if (sample := writer.early.pop(early)) is not None:
                writer.bytes -= len(sample.payload)
                self.deliver(sample)
        for early in [n for n in writer.partial if n < number]:
            self._drop_partial(writer, early)
        writer.next = number

    def heartbeat(self, guid: bytes, part: wire.Heartbeat) -> list[Outgoing]:
        """Ask for what is missing."""
        writer = self.writers.get(guid)
        if writer is None or not writer.reliable:
            return []
        writer.last = part.last
        if writer.next is None:
            writer.next = part.first
        if writer.next < part.first:
            self._skip(writer, part.first)
        self._drain(writer)
        base = writer.next
        ahead = range(base, min(part.last, base + _AHEAD - 1) + 1)
        missing = [number for number in ahead if number not in writer.early]
        if part.is_final and not missing:
            return []
        ids = self.guid[wire.PREFIX :], guid[wire.PREFIX :]
        whole = [number for number in missing if number not in writer.partial]
        parts = []
        writer.count += 1
        for number in missing:
            if number in writer.partial:
                lacking = writer.partial[number].missing()
                parts.append(formats.format_nack_fragment(*ids, number, lacking, writer.count))
        parts.append(formats.format_acknack(*ids, base, whole, writer.count))
        return [Outgoing(writer.address, guid[: wire.PREFIX], tuple(parts))]
