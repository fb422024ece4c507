"""A participant on sockets: one thread receives, sends what is due, and calls back."""

from __future__ import annotations

import os
import selectors
import socket
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress

from idlc.robot.dds import address, formats, wire
from idlc.robot.dds.discovery import Endpoint
from idlc.robot.dds.participant import Participant
from idlc.robot.dds.reader import Outgoing, Reader, Received
from idlc.robot.dds.writer import Writer

#: The longest sleep of the thread, in which another thread may make something due.
_TICK = 0.05
#: Packets that are read before what is due is sent.
_AT_ONCE = 64
_MOST_PACKET = 65_536


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
        port = self._sockets[0].getsockname()[1]
        self.prefix = wire.VENDOR + os.urandom(wire.PREFIX - len(wire.VENDOR))
        own = [(host, port) for host in address.own_hosts(place)]
        others = [each for each in address.searched(place) if each != ("127.0.0.1", port)]
        #: When the endpoints of others changed last.
        self.changed_at = time.monotonic()
        self.participant = Participant(
            self.prefix, own, others, address.fragment_size, self._note_change
        )
        self._tick = tick
        self._is_open = True
        self._thread = threading.Thread(target=self._run, name="idlc.dds", daemon=True)

    def start(self) -> None:
        """Begin to receive."""
        self._thread.start()

    def _note_change(self) -> None:
        self.changed_at = time.monotonic()

    def _run(self) -> None:
        while self._is_open:
            with self.lock:
                wait = self.participant.deadline - time.monotonic()
            for key, _ in self._selector.select(min(max(wait, 0), _TICK)):
                self._receive(key.data)
            with self.lock:
                if self._is_open:
                    self.send(self.participant.tick(time.monotonic()))
                    self._tick()

    def _receive(self, each: socket.socket) -> None:
        for _ in range(_AT_ONCE):
            try:
                packet, source = each.recvfrom(_MOST_PACKET)
            except BlockingIOError:
                return
            except OSError:  # on Windows, an earlier packet did not reach anybody
                continue
            with self.lock:
                if not self._is_open:
                    return
                self.send(self.participant.receive(packet, source[:2], time.monotonic()))

    def send(self, packets: Iterable[Outgoing]) -> None:
        """Send packets; one that the system refuses is lost, as one is on the way."""
        for target, prefix, parts in packets:
            head = (formats.for_participant(prefix),) if any(prefix) else ()
            data = formats.format_packet(self.participant.prefix, (*head, *parts))
            with suppress(OSError):
                self._send(data, target)

    def add_writer(self, end: Endpoint) -> Writer:
        """Announce a writer."""
        with self.lock:
            writer, packets = self.participant.add_writer(end, time.monotonic())
            self.send(packets)
            return writer

    def add_reader(self, end: Endpoint, deliver: Callable[[Received], None]) -> Reader:
        """Announce a reader."""
        with self.lock:
            reader, packets = self.participant.add_reader(end, deliver, time.monotonic())
            self.send(packets)
            return reader

    def remove(self, guid: bytes) -> None:
        """Withdraw an endpoint; a second time does nothing."""
        with self.lock:
            if self._is_open:
                self.send(self.participant.remove(guid, time.monotonic()))

    def write(self, writer: Writer, payload: bytes, inline: bytes = b"") -> int:
        """Send a sample; return its number."""
        with self.lock:
            self.send(writer.write(payload, inline, time.time_ns(), time.monotonic()))
            return writer.last

    def close(self) -> None:
        """Tell the others, and end the thread."""
        with self.lock:
            was_open, self._is_open = self._is_open, False
            if was_open:
                self.send(self.participant.leave())
        if was_open and threading.current_thread() is not self._thread:
            self._thread.join()
        if was_open:
            self._selector.close()
            for each in self._sockets:
                each.close()
