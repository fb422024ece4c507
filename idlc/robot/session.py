"""Sessions: opening a connection to a robot, its identity and its graph; and a router."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from itertools import count
from threading import Lock
from typing import Any

from idlc.diagnostics.text import one_line, worded
from idlc.robot.errors import RobotError
from idlc.robot.graph import Graph
from idlc.robot.transport import Transport

#: The port of rmw_zenoh's router.
ROUTER_PORT = 7447
MOST_DOMAIN = 999_999
_LOOPBACK = {"router": ["tcp/127.0.0.1:0"], "peer": ["tcp/127.0.0.1:0"]}
_FILE = "zenoh:"
#: An endpoint: its protocol and host, its port, and options for the protocol.
_ENDPOINT = re.compile(r"([a-z]+/(?:\[[0-9A-Fa-f:.]+\]|[\w.-]+))(:\d{1,5}(?:[?#].*)?)?")
#: The settings of every session, as rmw_zenoh has them.
_COMMON: dict[str, Any] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": True,
    "timestamping/enabled": True,
    "queries_default_timeout": 600_000,
    "transport/link/tx/lease": 60_000,
}


class Session(AbstractContextManager["Session"]):
    """A connection to a robot, and what its nodes and endpoints share.

    Closing it twice, or from another thread, is allowed. `domain` is the ROS_DOMAIN_ID. Tokens
    contain `id`. `notes` are sentences about variables that idlc does not use.
    """

    def __init__(self, transport: Transport, domain: int, notes: Sequence[str] = ()) -> None:
        self.transport = transport
        self.domain = domain
        self.notes = notes
        self.id = transport.id
        self._ids = count()
        self._lock = Lock()
        self._graph: Graph | None = None
        self._is_closed = False

    def next_id(self) -> int:
        """Return an id for a node or an endpoint of this session; the first is 0."""
        return next(self._ids)

    @property
    def graph(self) -> Graph:
        """The graph of the domain, which is watched from the first use on."""
        with self._lock:
            self._graph = self._graph or Graph(self.transport, self.domain)
            return self._graph

    def close(self) -> None:
        """Stop watching the graph, and close the connection with all declarations."""
        with self._lock:
            was_closed, self._is_closed = self._is_closed, True
        if not was_closed:
            if self._graph:
                self._graph.close()
            self.transport.close()

    def __exit__(self, *_: object) -> None:
        self.close()


def open_session(
    address: str = "",
    *,
    domain: int | None = None,
    timeout: float = 5.0,
    environ: Mapping[str, str] = os.environ,
) -> Session:
    """Return a session with a robot.

    An address is `dds`, with a domain or a peer such as `dds:7` or `dds/192.168.1.20`, an endpoint
    such as `tcp/robot:7447`, or `zenoh:FILE`, a configuration file of Zenoh. The session is a
    client of the endpoint, which answers within `timeout` seconds. Without an address, it is on
    DDS, unless RMW_IMPLEMENTATION is `rmw_zenoh_cpp` or a variable configures Zenoh. Then it is a
    peer as in rmw_zenoh: of ZENOH_SESSION_CONFIG_URI, or of the router on localhost, which may
    start later. ROS_DOMAIN_ID is the default of `domain`, and ZENOH_CONFIG_OVERRIDE applies always
    to Zenoh. Only an address, a variable or a configuration can admit other machines. Raises
    RobotError.
    """
    zenoh_is_wanted = environ.get("RMW_IMPLEMENTATION") == "rmw_zenoh_cpp" or any(
        environ.get(name) for name in ("ZENOH_SESSION_CONFIG_URI", "ZENOH_CONFIG_OVERRIDE")
    )
    if re.match(r"dds(?:[:/]|\Z)", address) or not (address or zenoh_is_wanted):
        from idlc.robot.dds.address import parse_place
        from idlc.robot.dds.transport import DdsTransport

        place = parse_place(address or "dds", domain, environ)
        return Session(DdsTransport(place), place.domain, place.notes)
    path = environ.get("ZENOH_SESSION_CONFIG_URI", "")
    if address:
        path = address.removeprefix(_FILE) if address.startswith(_FILE) else ""
    endpoint = _checked(address) if address and not path else f"tcp/localhost:{ROUTER_PORT}"
    settings = {
        "mode": "client" if address else "peer",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": int(timeout * 1000) if address else -1,
        "connect/exit_on_failure": bool(address),
        "listen/endpoints": _LOOPBACK,
    }
    where = f"`{one_line(address or path)}`" if address or path else "the router"
    hint = f"is rmw_zenohd or `idlc router` running there? idlc waited {timeout:g} s"
    return _open(path or settings, domain, environ, f"{where} does not answer", hint)


def open_router(
    listen: Iterable[str] = (f"tcp/127.0.0.1:{ROUTER_PORT}",),
    connect: Iterable[str] = (),
    environ: Mapping[str, str] = os.environ,
) -> Session:
    """Return a session that is a router for nodes on this machine, in place of `rmw_zenohd`.

    Other machines reach it only if `listen` contains an address of theirs, such as
    `tcp/0.0.0.0:7447`. It runs until it is closed. Raises RobotError.
    """
    endpoints = [_checked(word) for word in listen]
    settings = {
        "mode": "router",
        "listen/endpoints": endpoints,
        "connect/endpoints": [_checked(word) for word in connect],
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
    }
    problem = f"no router can listen on {', '.join(endpoints)}"
    port = "tcp/127.0.0.1:7448"
    choice = worded(f"--listen {port}", f"listen=[{port!r}]")
    hint = f"is another router running? choose another port with `{choice}`"
    return _open(settings, None, environ, problem, hint)


def _checked(endpoint: str) -> str:
    """Return an endpoint; raise RobotError if it is malformed."""
    match = _ENDPOINT.fullmatch(endpoint)
    if match and match[2]:
        return endpoint
    good = match[1] if match else "tcp/localhost"
    if host := re.fullmatch(r"([\w.-]+)(?::\d{1,5})?", endpoint):
        good = f"tcp/{host[1]}"
    raise RobotError(f"`{one_line(endpoint)}` is not an endpoint", f"write `{good}:{ROUTER_PORT}`")


def _open(
    source: str | dict[str, Any],
    domain: int | None,
    environ: Mapping[str, str],
    problem: str,
    hint: str,
) -> Session:
    """Return a session with these settings, or a file of them, and rmw_zenoh's variables."""
    try:
        import xxhash  # noqa: F401 - the ids of endpoints need it
        import zenoh
    except ImportError as error:
        raise RobotError(
            f"eclipse-zenoh and xxhash are required: {error}",
            'install it: `pip install "idlc[zenoh]"`',
        ) from None
    from idlc.robot.zenoh_transport import ZenohTransport

    text = environ.get("ROS_DOMAIN_ID", "").strip() or "0" if domain is None else str(domain)
    if not (re.fullmatch("[0-9]{1,9}", text) and int(text) <= MOST_DOMAIN):
        raise RobotError(f"`{one_line(text)}` is not a domain", "set ROS_DOMAIN_ID to 0")
    try:
        if isinstance(source, str):
            config = _read(zenoh, source)
        else:
            config = _configured(zenoh.Config(), _COMMON | source)
        _override(config, environ.get("ZENOH_CONFIG_OVERRIDE", ""))
        return Session(ZenohTransport(zenoh.open(config)), int(text))
    except zenoh.ZError as error:
        raise RobotError(f"{problem}: {_reason(error)}", hint) from None


def _read(zenoh: Any, path: str) -> Any:
    """Return the configuration in a file, restricted to loopback where it leaves that open."""
    try:
        config = zenoh.Config.from_file(path)
    except zenoh.ZError as error:
        raise RobotError(
            f"`{one_line(path)}` is not a configuration of Zenoh: {_reason(error)}",
            "write the name of a .json5 file, such as the files of rmw_zenoh_cpp",
        ) from None
    settings: dict[str, Any] = {"timestamping/enabled": True}
    if config.get_json("listen/endpoints") == zenoh.Config().get_json("listen/endpoints"):
        settings["listen/endpoints"] = _LOOPBACK
    if config.get_json("scouting/multicast/enabled") == "null":
        settings["scouting/multicast/enabled"] = False
    return _configured(config, settings)


def _configured(config: Any, settings: Mapping[str, Any]) -> Any:
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


def _override(config: Any, settings: str) -> None:
    """Apply the settings in ZENOH_CONFIG_OVERRIDE."""
    for item in filter(str.strip, settings.split(";")):
        key, _, value = item.partition("=")
        try:
            config.insert_json5(key.strip(), value.strip())
        except Exception as error:  # ValueError or ZError, by the version of eclipse-zenoh
            raise RobotError(
                f"ZENOH_CONFIG_OVERRIDE has `{one_line(item)}`: {_reason(error)}",
                'write `mode="client";connect/endpoints=["tcp/robot:7447"]`',
            ) from None


def _reason(error: Exception) -> str:
    """Return an error of Zenoh without the position in its source."""
    text = re.split(r" at /| at [A-Za-z]:", str(error))[0]
    match = re.search(r'(?:Str\(|msg: )"(.*)"', text, re.DOTALL)
    return one_line((match[1] if match else text).split("\\n")[-1].strip(" ="))
