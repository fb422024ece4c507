"""Readers: they deliver the samples of writers in order, and ask for what is missing."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator
from math import inf

from idlc.robot.dds import formats, wire
from idlc.robot.dds.formats import Address, Remote, Shared, is_cyclone
from idlc.robot.dds.wire import Data
from idlc.robot.qos import QoSProfile

#: Bytes of a sample.
MOST_SAMPLE = 64 << 20
#: The bytes that a sample or fragment takes besides its payload, at least.
_OVERHEAD = 256
#: Numbers that a reader asks for at a time, and samples of which it holds fragments.
_AHEAD = 256
_MOST_PARTIAL = 8
_MOST_REMEMBERED = 256
#: Seconds until a reader acknowledges samples, and between two acknowledgements.
_ANSWER = 0.01


class _Partial:
    """Fragments of a sample by their numbers."""

    def __init__(self, part: wire.Fragment) -> None:
        self.size, self.total = part.size, part.total
        self.parameters, self.time = part.parameters, part.time
        self.parts: dict[int, bytes] = {}
        self.count = -(-part.total // part.size)

    def new(self, part: wire.Fragment) -> Iterator[tuple[int, bytes]]:
        """Yield the numbers and bytes of fragments that are missing."""
        for number in range(part.first, self.count + 1):
            at = (number - part.first) * part.size
            if at >= len(part.payload):
                return
            if number not in self.parts:
                end = min(part.size, self.total - (number - 1) * self.size)
                yield number, part.payload[at : at + end]

    @property
    def bytes(self) -> int:
        """The memory that the fragments take."""
        return sum(map(len, self.parts.values())) + _OVERHEAD * len(self.parts)

    def missing(self) -> list[int]:
        """Return the numbers of missing fragments, of 256 from the first of them."""
        numbers = range(1, self.count + 1)
        first = next((number for number in numbers if number not in self.parts), 0)
        return [n for n in range(first, min(first + _AHEAD, self.count + 1)) if n not in self.parts]


class RemoteWriter(Remote):
    """What a reader knows of a writer, and the samples of it that wait for earlier ones."""

    def __init__(self, guid: bytes, address: Address, reliable: bool) -> None:
        super().__init__(guid, address, reliable)
        #: The number of the next sample to deliver. Of a reliable writer it is `None` until the
        #: first heartbeat: the writer may know the reader, and send to it, before the reader knows
        #: the writer. Gaps tell what a late reader has missed.
        self.next: int | None = None
        #: The number of the newest sample that it has told of.
        self.last = 0
        self.early: dict[int, Data | None] = {}
        self.partial: OrderedDict[int, _Partial] = OrderedDict()
        self.bytes = 0
        self.count = 0
        #: When it was answered, and whether it waits for an answer.
        self.answered, self.waits = -inf, False


class Reader:
    """Delivers the samples of the matched writers in order: reliable ones without gaps."""

    def __init__(
        self,
        guid: bytes,
        qos: QoSProfile,
        deliver: Callable[[Data], None],
        shared: Shared,
        *,
        remembers: bool = True,
    ) -> None:
        self.guid = guid
        self.id = guid[wire.PREFIX :]
        self.qos = qos
        self.deliver = deliver
        self.reliable = qos.is_reliable
        self.writers: dict[bytes, RemoteWriter] = {}
        self._shared = shared
        #: Where writers go on that were gone for a while, unless this reader begins again.
        self._remembered: OrderedDict[bytes, int] | None = OrderedDict() if remembers else None

    @property
    def is_complete(self) -> bool:
        """True if each writer has told what it has, and nothing of that is missing."""
        return all(
            writer.next is not None and writer.next > writer.last
            for writer in self.writers.values()
            if writer.reliable
        )

    def match(self, guid: bytes, address: Address, qos: QoSProfile) -> None:
        """Receive from a writer, which learns by a question that this reader is there."""
        if guid in self.writers:
            return
        reliable = self.reliable and qos.is_reliable
        writer = self.writers[guid] = RemoteWriter(guid, address, reliable)
        self._shared.matched.setdefault(guid, []).append(self)
        if self._remembered:
            writer.next = self._remembered.pop(guid, None)
        if reliable:
            writer.count += 1
            # 0 asks where to begin; Cyclone DDS calls it malformed
            base = 1 if is_cyclone(guid) else 0
            ids = self.id, writer.id
            question = formats.format_acknack(*ids, base, [], writer.count, is_final=False)
            self._shared.send(writer, question)

    def unmatch(self, guid: bytes) -> None:
        """Forget a writer."""
        if (writer := self.writers.pop(guid, None)) is None:
            return
        self._release(writer, writer.bytes)
        self._shared.matched[guid].remove(self)
        if not self._shared.matched[guid]:
            del self._shared.matched[guid]
        if writer.next is not None and self._remembered is not None:
            self._remembered[guid] = writer.next
            if len(self._remembered) > _MOST_REMEMBERED:
                self._remembered.popitem(last=False)

    def close(self) -> None:
        """Forget all writers."""
        for guid in [*self.writers]:
            self.unmatch(guid)

    def _hold(self, writer: RemoteWriter, number: int, size: int) -> bool:
        """Take memory for a sample; the one that all others wait for replaces the last of them."""
        while not (is_free := self._shared.take(writer.prefix, size)):
            if number != writer.next or not writer.early:
                break
            self._drop(writer, max(writer.early))
        writer.bytes += size if is_free else 0
        return is_free

    def _release(self, writer: RemoteWriter, size: int) -> None:
        writer.bytes -= size
        self._shared.free(writer.prefix, size)

    def _drop(self, writer: RemoteWriter, number: int) -> Data | None:
        """Forget a sample that waits, or its fragments; return the sample."""
        if (partial := writer.partial.pop(number, None)) is not None:
            self._release(writer, partial.bytes)
        if (sample := writer.early.pop(number, None)) is not None:
            self._release(writer, len(sample.payload) + _OVERHEAD)
        return sample

    def receive(self, guid: bytes, part: wire.Submessage) -> None:
        """Take a part of a packet of a matched writer."""
        writer = self.writers[guid]
        if isinstance(part, Data):
            self._take(writer, part)
        elif isinstance(part, wire.Fragment):
            self._fragment(writer, part)
        elif writer.reliable and isinstance(part, wire.Heartbeat):
            self._heartbeat(writer, part)
        elif writer.reliable and isinstance(part, wire.Gap):
            self._gap(writer, part)

    def _take(self, writer: RemoteWriter, part: Data) -> None:
        if writer.next is None and not writer.reliable:
            writer.next = part.number
        if writer.next is not None and part.number < writer.next:
            return
        sample = Data(part.reader, writer.guid, *part[2:])
        if not writer.reliable:
            writer.next = sample.number + 1
            self.deliver(sample)
            return
        if writer.next == sample.number:
            # without the way through the dictionary, as nearly all samples arrive in order
            if writer.partial:
                self._drop(writer, sample.number)
            writer.next += 1
            self.deliver(sample)
        elif sample.number not in writer.early and len(writer.early) < _AHEAD:
            self._drop(writer, sample.number)
            # the writer has to send it again if there is no room
            if self._hold(writer, sample.number, len(sample.payload) + _OVERHEAD):
                writer.early[sample.number] = sample
        if writer.early:
            self._drain(writer)

    def _drain(self, writer: RemoteWriter) -> None:
        while writer.next is not None and writer.next in writer.early:
            sample = self._drop(writer, writer.next)
            writer.next += 1
            if sample is not None:
                self.deliver(sample)

    def _fragment(self, writer: RemoteWriter, part: wire.Fragment) -> None:
        """Take fragments; the last one completes the sample."""
        if part.number in writer.early or part.number < (writer.next or 0):
            return
        if part.total > MOST_SAMPLE:
            writer.early.setdefault(part.number, None)  # else the reader would ask for ever
            self._drain(writer)
            return
        partial = writer.partial.get(part.number)
        if partial is None:
            while len(writer.partial) >= (_MOST_PARTIAL if writer.reliable else 2):
                # a reliable reader asks for it again
                self._drop(writer, next(reversed(writer.partial)))
            partial = writer.partial[part.number] = _Partial(part)
        if (partial.size, partial.total) != (part.size, part.total):
            return
        for number, piece in partial.new(part):
            if not self._hold(writer, part.number, len(piece) + _OVERHEAD):
                return
            partial.parts[number] = piece
        if len(partial.parts) == partial.count:
            payload = b"".join(partial.parts[number] for number in range(1, partial.count + 1))
            self._drop(writer, part.number)
            values = (*part[:3], partial.parameters, payload, False, partial.time)
            self._take(writer, Data(*values))

    def _gap(self, writer: RemoteWriter, part: wire.Gap) -> None:
        """Go on without numbers that never come."""
        if writer.next is None:
            writer.next = part.first
        if part.first <= writer.next < part.base:
            self._skip(writer, part.base)
        for number in (*range(part.first, min(part.base, part.first + _AHEAD)), *part.others):
            if number >= writer.next and len(writer.early) < 2 * _AHEAD:
                writer.early.setdefault(number, None)
        self._drain(writer)

    def _skip(self, writer: RemoteWriter, number: int) -> None:
        """Deliver what has arrived below a number, and go on at it."""
        for early in sorted(n for n in {*writer.early, *writer.partial} if n < number):
            if (sample := self._drop(writer, early)) is not None:
                self.deliver(sample)
        writer.next = number

    def _heartbeat(self, writer: RemoteWriter, part: wire.Heartbeat) -> None:
        """Ask for what is missing."""
        writer.last = part.last
        if writer.next is None:
            writer.next = part.first
        if writer.next < part.first:
            self._skip(writer, part.first)
        self._drain(writer)
        missing = self._missing(writer, writer.next)
        if missing and self._shared.now >= writer.answered + _ANSWER:
            self._answer(writer, missing)
        elif missing or not part.is_final:
            writer.waits = True
            self._shared.due.setdefault(self.tick, self._shared.now + _ANSWER)

    def tick(self) -> None:
        """Tell the writers that wait that nothing is missing, or what is missing now."""
        for writer in self.writers.values():
            if writer.waits and writer.next is not None:
                self._answer(writer, self._missing(writer, writer.next))

    def _missing(self, writer: RemoteWriter, base: int) -> list[int]:
        """Return the numbers that a writer has told of and that have not arrived, of 256."""
        ahead = range(base, min(writer.last, base + _AHEAD - 1) + 1)
        return [number for number in ahead if number not in writer.early]

    def _answer(self, writer: RemoteWriter, missing: list[int]) -> None:
        """Ask a writer for what is missing, and tell it that all before has arrived."""
        writer.waits, writer.answered = False, self._shared.now
        writer.count += 1
        ids = self.id, writer.id
        parts = []
        for number in missing:
            if number in writer.partial:
                lacking = writer.partial[number].missing()
                parts.append(formats.format_nack_fragment(*ids, number, lacking, writer.count))
        whole = [number for number in missing if number not in writer.partial]
        acknack = formats.format_acknack(
            *ids, writer.next or 0, whole, writer.count, is_final=not whole
        )
        self._shared.send(writer, *parts, acknack)
