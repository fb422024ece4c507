"""A participant on sockets: one thread receives, sends what is due, and calls back.

An executor that waits receives in its place: handing each message to another thread takes longer
than receiving it.
"""

from __future__ import annotations

import os
import selectors
import socket
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from math import inf

from idlc.robot.dds import address, formats, wire
from idlc.robot.dds.formats import Outgoing
from idlc.robot.dds.participant import Participant
from idlc.robot.dds.writer import Writer

#: The longest sleep of the thread, in which another thread may make something due.
_TICK = 0.05
#: Seconds between two looks at the own addresses, which change with the network.
_LOOK = 3.0
#: Seconds in which another thread that took a turn takes the next one.
_LEASE = 0.01
_MOST_PACKET, _LARGE = 65_536, 16_384


class Connection:
    """A participant with its sockets; its methods may be called on any thread."""

    def __init__(self, place: address.Place, tick: Callable[[], None]) -> None:
        self.lock = threading.RLock()
        self._sockets = address.open_sockets(place)
        self._send = self._sockets[0].sendto
        # `select.select` refuses the files of a program that has opened a thousand
        self._selector = selectors.DefaultSelector()
        for each in self._sockets:
            self._selector.register(each, selectors.EVENT_READ, each)
        self._place = place
        self._looked = self._ticked = self._due_at = 0.0
        self._own_address = "127.0.0.1", self._sockets[0].getsockname()[1]
        #: Who takes a turn, whether it waits for a packet, and until when the thread takes none.
        self._turn, self._waits, self._lent_until = threading.RLock(), False, 0.0
        #: Until when only the thread receives, as large packets came: with one heap instead of two,
        #: the C library returns their memory to the system after each message.
        self._large_until = 0.0
        self.prefix = wire.VENDOR + os.urandom(wire.PREFIX - len(wire.VENDOR))
        others = [each for each in address.searched(place) if each != self._own_address]
        #: When the endpoints of others changed last.
        self.changed_at = time.monotonic()
        self.participant = Participant(
            self.prefix, (), others, address.fragment_size, self._note_change
        )
        self._look(time.monotonic())
        self._tick_above = tick
        self._is_open = True
        self._thread = threading.Thread(target=self._run, name="idlc.dds", daemon=True)

    def start(self) -> None:
        """Begin to receive."""
        self._thread.start()

    def _note_change(self) -> None:
        self.changed_at = time.monotonic()

    def _look(self, now: float) -> None:
        """Announce the own addresses if they are others than before."""
        self._looked, self._hosts = now, address.own_hosts(self._place)
        if self.participant.move([(host, self._own_address[1]) for host in self._hosts]):
            for group in self._sockets[1:]:
                address.join(group, self._hosts)

    def _tick(self, now: float) -> None:
        self._ticked = now
        if now > self._looked + _LOOK:
            self._look(now)
        self.send(self.participant.tick(now))
        self._tick_above()

    def _run(self) -> None:
        while self._is_open:
            if time.monotonic() < self._lent_until:
                time.sleep(_LEASE)
                continue
            with self._turn:
                self._take_turn(_TICK)

    def pump(self, timeout: float, is_idle: Callable[[], bool]) -> bool:
        """Take turns in the place of the thread, while `is_idle()`; return False if others do.

        The thread waits a little for the next call.
        """
        if time.monotonic() < self._large_until:
            return False
        if not (self._turn.acquire(blocking=False) or self._take_over()):
            return False
        try:
            self._lent_until, end = inf, time.monotonic() + timeout
            while self._is_open and is_idle() and (left := end - time.monotonic()) > 0:
                self._take_turn(left, is_idle)
            return self._is_open
        finally:
            self._lent_until = time.monotonic() + _LEASE
            self._turn.release()

    def _take_over(self) -> bool:
        """End the turn of the thread, and take it; return False if it is not of the thread."""
        if self._lent_until == inf:
            return False
        self._lent_until = time.monotonic() + _LEASE
        self._nudge()
        return self._turn.acquire(timeout=_LEASE)

    def _nudge(self) -> None:
        """End the wait for a packet by an empty one."""
        with suppress(OSError):
            self._send(b"", self._own_address)

    def wake(self) -> None:
        """End the turn that waits for a packet; for any thread."""
        if self._waits:
            self._nudge()

    def _take_turn(self, timeout: float, is_idle: Callable[[], bool] | None = None) -> None:
        """Wait for a packet, receive it, and do what is due."""
        wait = max(min(timeout, self._due_at - time.monotonic()), 0)
        self._waits = is_idle is not None
        if is_idle is not None and not is_idle():
            wait = 0
        ready = self._selector.select(wait)
        self._waits = False
        with self.lock:
            if not self._is_open:
                return
            for key, _ in ready:
                self._receive(key.data)
            now = time.monotonic()
            # most messages of others make nothing due
            if now >= self._due() or self.changed_at > self._ticked:
                self._tick(now)
            self._due_at = self._due()

    def _due(self) -> float:
        return min(self.participant.deadline, self._ticked + _TICK)

    def _receive(self, each: socket.socket) -> None:
        try:
            packet, source = each.recvfrom(_MOST_PACKET)
        except OSError:  # nothing is there, or on Windows: an earlier packet reached nobody
            return
        if len(packet) > _LARGE:
            self._large_until = time.monotonic() + 1
        if packet:
            self.send(self.participant.receive(packet, source[:2], time.monotonic()))

    def send(self, packets: Iterable[Outgoing]) -> None:
        """Send packets; one that the system refuses is lost, as one is on the way."""
        for target, prefix, parts in packets:
            head = (formats.for_participant(prefix),) if any(prefix) else ()
            data = formats.format_packet(self.participant.prefix, (*head, *parts))
            if target[0] == address.GROUP:
                address.send_to_group(self._sockets[0], data, target, self._hosts)
                continue
            with suppress(OSError):
                self._send(data, target)

    @contextmanager
    def acting(self) -> Iterator[Participant]:
        """Do something with the participant now, then send its packets."""
        with self.lock:
            self.participant.shared.now = time.monotonic()
            yield self.participant
            self.send(self.participant.shared.collect())

    def write(self, writer: Writer, payload: bytes, inline: bytes = b"") -> None:
        """Send a sample."""
        with self.acting():
            writer.write(payload, inline, time.time_ns())

    def remove(self, *guids: bytes) -> None:
        """Withdraw endpoints; a second time does nothing."""
        with self.acting() as participant:
            for guid in guids if self._is_open else ():
                participant.remove(guid)

    def close(self) -> None:
        """Tell the others, and end the thread."""
        with self.acting() as participant:
            was_open, self._is_open = self._is_open, False
            if was_open:
                participant.leave()
        if was_open and threading.current_thread() is not self._thread:
            self._thread.join()
        if was_open:
            self.wake()
            with self._turn:
                self._selector.close()
                for each in self._sockets:
                    each.close()
