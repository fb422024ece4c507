"""Addresses of DDS, the variables of ROS 2 that restrict discovery, and the sockets for them."""

from __future__ import annotations

import re
import socket
import struct
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import NamedTuple

from idlc.diagnostics.report import first_few
from idlc.diagnostics.text import one_line
from idlc.robot.dds.formats import Address
from idlc.robot.errors import RobotError

#: An address: the domain, and a peer.
_ADDRESS = re.compile(r"dds(?::(\d{1,3}))?(?:/([\w.-]{1,253}))?", re.ASCII)
MOST_DOMAIN = 232
#: The ports of this domain and of later ones can be those of any program.
_EPHEMERAL = 102
#: Participants on one machine, each with a port of its own.
PARTICIPANTS = 120
GROUP = "239.255.0.1"
_LOOPBACK = "127.0.0.1"
#: The most bytes of a fragment: on loopback of Linux, on that of others, and to other machines.
_FRAGMENTS = (60_000, 8_192, 1_344)
_BUFFER = 4 << 20
_RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT", "NOT_SET", "")
#: Variables that other implementations of DDS honour, and idlc does not.
_IGNORED = (
    "ROS_DISCOVERY_SERVER",
    "CYCLONEDDS_URI",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "ROS_SECURITY_ENABLE",
)
_MOST_STATIC = 16
#: Linux's question for the address of a network interface.
_SIOCGIFADDR = 0x8915


class Place(NamedTuple):
    """Where a participant searches: a domain, hosts, and the subnet or not."""

    domain: int
    hosts: tuple[str, ...]
    subnet: bool
    notes: tuple[str, ...]

    @property
    def is_local(self) -> bool:
        """True if nothing leaves this machine."""
        return not self.subnet and all(host.startswith("127.") for host in self.hosts)


def parse_place(address: str, domain: int | None, environ: Mapping[str, str]) -> Place:
    """Return where to search by an address and ROS 2's variables; raise RobotError.

    Nothing leaves this machine unless the address names a peer or a variable admits it.
    """
    match = _ADDRESS.fullmatch(address)
    if match is None:
        hint = "write `dds`, `dds:7` for a domain, or `dds/192.168.1.20` for a peer"
        raise RobotError(f"`{one_line(address)}` is not an address of DDS", hint)
    text = match[1] or environ.get("ROS_DOMAIN_ID", "").strip() or "0"
    if domain is not None:
        text = str(domain)
    if not (re.fullmatch("[0-9]{1,3}", text) and int(text) <= MOST_DOMAIN):
        hint = "write a number up to 232, such as `dds:7`" if match[1] else "set ROS_DOMAIN_ID to 0"
        raise RobotError(f"`{one_line(text)}` is not a domain", hint)
    word = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").strip()
    range_ = word.upper()
    if range_ not in _RANGES:
        hint = "write SUBNET, LOCALHOST or OFF"
        raise RobotError(f"ROS_AUTOMATIC_DISCOVERY_RANGE is `{one_line(word)}`", hint)
    peers = environ.get("ROS_STATIC_PEERS", "").split(";")
    if environ.get("ROS_LOCALHOST_ONLY", "").strip() == "1":
        range_, peers = "LOCALHOST", []
    if range_ == "OFF":
        peers = []
    if environ.get("ROS_SECURITY_STRATEGY") == "Enforce":
        hint = "unset ROS_SECURITY_STRATEGY to send messages that are neither encrypted nor signed"
        raise RobotError("idlc does not support DDS-Security", hint)
    hosts = [] if range_ == "OFF" else [_LOOPBACK]
    names = [*filter(None, map(str.strip, peers))][:_MOST_STATIC]
    hosts += map(_resolved, [*names, *filter(None, [match[2]])])
    notes = tuple(f"idlc does not use {name}" for name in _IGNORED if environ.get(name))
    return Place(int(text), tuple(dict.fromkeys(hosts)), range_ == "SUBNET", notes)


def _resolved(name: str) -> str:
    try:
        return socket.gethostbyname(name)
    except (OSError, UnicodeError) as error:
        hint = "write its IPv4 address, such as `dds/192.168.1.20`"
        raise RobotError(f"`{one_line(name)}` is not a host: {error}", hint) from None


def _base(domain: int) -> int:
    return 7400 + 250 * domain


def _ports(domain: int) -> range:
    """Return the port of each participant on a machine."""
    first = _base(domain) + 10
    return range(first, min(first + 2 * PARTICIPANTS, 2**16), 2)


def _is_used(domain: int) -> bool:
    """Return whether the port of the first participant is taken on this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((_LOOPBACK, _ports(domain)[0]))
        except OSError:
            return True
    return False


def silence(place: Place) -> str:
    """Return a sentence for when there is no other participant; it tries a port of each domain."""
    if not (place.hosts or place.subnet):
        return "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF, so idlc searched nothing"
    domains = sorted({*range(_EPHEMERAL)} - {place.domain})
    others = [f"`dds:{domain}`" for domain in domains if _is_used(domain)]
    if others:
        return f"this machine has participants in other domains: {first_few(others, 5)}"
    if place.is_local:
        return "idlc searched this machine only; `dds/HOST` also searches another one"
    places = [*place.hosts, *(["the subnet"] if place.subnet else [])]
    return f"idlc searched {', '.join(places)}; no participant answered"


def searched(place: Place) -> list[Address]:
    """Return the addresses at which other participants may listen."""
    addresses = [(host, port) for host in place.hosts for port in _ports(place.domain)]
    return [*addresses, *([(GROUP, _base(place.domain))] if place.subnet else ())]


def own_hosts(place: Place) -> list[str]:
    """Return the addresses of this machine that others can reach."""
    if place.is_local:
        return [_LOOPBACK]
    hosts = [*_interfaces()] if place.subnet else []
    for host in place.hosts:
        with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((host, 9))
            hosts.append(probe.getsockname()[0])
    others = [host for host in dict.fromkeys(hosts) if not host.startswith("127.")]
    return others or [_LOOPBACK]


def _interfaces() -> Iterator[str]:
    """Yield the addresses of the network interfaces."""
    if sys.platform != "linux":
        with suppress(OSError):
            yield from socket.gethostbyname_ex(socket.gethostname())[2]
        return
    import fcntl  # which Windows does not have

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            with suppress(OSError):  # it has no address
                answer = fcntl.ioctl(probe, _SIOCGIFADDR, struct.pack("256s", name.encode()))
                yield socket.inet_ntoa(answer[20:24])


def open_sockets(place: Place) -> list[socket.socket]:
    """Return the socket of a free participant, and that of the subnet; raise RobotError."""
    host = _LOOPBACK if place.is_local else "0.0.0.0"  # noqa: S104 - the environment asks for it
    for port in _ports(place.domain):
        own = _socket()
        try:
            own.bind((host, port))
        except OSError:
            own.close()
            continue
        return [own, *(_multicast(place) if place.subnet else ())]
    problem = f"all ports of {PARTICIPANTS} participants of domain {place.domain} are in use"
    raise RobotError(problem, "stop some nodes, or use another ROS_DOMAIN_ID")


def _socket() -> socket.socket:
    own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    own.setblocking(False)
    for option in (socket.SO_RCVBUF, socket.SO_SNDBUF):
        with suppress(OSError):
            own.setsockopt(socket.SOL_SOCKET, option, _BUFFER)
    return own


def _multicast(place: Place) -> list[socket.socket]:
    """Return a socket for announcements on the subnet; none if the system refuses it."""
    group = _socket()
    try:
        group.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if hasattr(socket, "SO_REUSEPORT"):
            group.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        group.bind(("", _base(place.domain)))
    except OSError:
        group.close()
        return []
    return [group]


def join(group: socket.socket, hosts: Iterable[str]) -> None:
    """Receive the announcements to the subnets of own addresses."""
    for host in hosts:
        with suppress(OSError):  # it has joined
            member = socket.inet_aton(GROUP) + socket.inet_aton(host)
            group.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)


def send_to_group(own: socket.socket, packet: bytes, target: Address, hosts: Iterable[str]) -> None:
    """Send an announcement to the subnets of own addresses."""
    for host in hosts:
        with suppress(OSError):
            own.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(host))
            own.sendto(packet, target)


def fragment_size(host: str) -> int:
    """Return the most bytes of a fragment to a host."""
    if not host.startswith("127."):
        return _FRAGMENTS[2]
    return _FRAGMENTS[0] if sys.platform == "linux" else _FRAGMENTS[1]
