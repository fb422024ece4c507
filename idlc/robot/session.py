"""Sessions: opening a connection to a robot, its identity and its graph; and a router."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager, suppress
from itertools import count
from threading import Lock
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from idlc.diagnostics.text import one_line
from idlc.robot.errors import RobotError

if TYPE_CHECKING:
    from idlc.robot.graph import Graph
    from idlc.robot.transport import Transport

#: The port of rmw_zenoh's router.
ROUTER_PORT = 7447
MOST_DOMAIN = 999_999
_LOOPBACK = "tcp/127.0.0.1:0"
_FILE = "zenoh:"
_PROTOCOLS = ("tcp", "tls", "quic", "udp", "ws")
_ENDPOINT = re.compile(
    rf"(?:{'|'.join(_PROTOCOLS)})/(?:\[[0-9A-Fa-f:.]+\]|[\w.-]+):\d{{1,5}}(?:[?#].*)?"
)
_WITHOUT_PORT = re.compile(rf"(?:{'|'.join(_PROTOCOLS)})/[^/:]+")

#: The settings of every session, as rmw_zenoh has them.
_COMMON: Mapping[str, Any] = MappingProxyType(
    {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "timestamping/enabled": {"router": True, "peer": True, "client": True},
        "queries_default_timeout": 600_000,
        "transport/link/tx/lease": 60_000,
    }
)
_ROUTER_ON_LOCALHOST = (f"tcp/localhost:{ROUTER_PORT}",)


class Session(AbstractContextManager["Session"]):
    """A connection to a robot, and what its nodes and endpoints share.

    Closing it twice, or from another thread, is allowed. `domain` is the ROS_DOMAIN_ID.
    """

    def __init__(self, transport: Transport, domain: int) -> None:
        self.transport = transport
        self.domain = domain
        self._ids = count()
        self._lock = Lock()
        self._graph: Graph | None = None
        self._is_closed = False

    @property
    def id(self) -> str:
        """The id of the session in tokens."""
        return self.transport.id

    def next_id(self) -> int:
        """Return an id for a node or an endpoint of this session; the first is 0."""
        return next(self._ids)

    @property
    def graph(self) -> Graph:
        """The graph of the domain, which is watched from the first use on."""
        from idlc.robot.graph import Graph

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


def is_address(word: str) -> bool:
    """Return whether a word of a command line means a robot; a path that exists does not.

    Malformed addresses count as well, so that `open_session` reports them.
    """
    first, slash, _ = word.partition("/")
    return (
        word.startswith(_FILE) or (slash != "" and first in _PROTOCOLS)
    ) and not os.path.lexists(word)


def open_session(
    *addresses: str,
    domain: int | None = None,
    listen: Iterable[str] = (),
    timeout: float = 5.0,
    environ: Mapping[str, str] = os.environ,
) -> Session:
    """Return a session with a robot.

    An address is an endpoint such as `tcp/robot:7447`, several of them with commas, or
    `zenoh:FILE`, a configuration file of Zenoh. The session is a client of the first endpoint that
    answers within `timeout` seconds each. Without an address, it is a peer as in rmw_zenoh: of
    ZENOH_SESSION_CONFIG_URI, or of the router on localhost, which may start later. ROS_DOMAIN_ID
    is the default of `domain`, and ZENOH_CONFIG_OVERRIDE applies always. Only what `listen` or a
    configuration file names can be reached from other machines. Raises RobotError.
    """
    zenoh = _import_zenoh()
    domain = _domain(environ) if domain is None else domain
    words = [part for address in addresses for part in _split(address)]
    files = [word for word in words if word.startswith(_FILE)]
    if files and len(words) > 1:
        raise RobotError(
            f"`{one_line(files[0])}` cannot be combined with other addresses",
            "name the endpoints in the configuration file",
        )
    path = files[0].removeprefix(_FILE) if files else ""
    if not words:
        path = environ.get("ZENOH_SESSION_CONFIG_URI", "")
    settings: dict[str, Any] = {}
    listens = [_checked(word) for word in listen]
    if path:
        config = _read(zenoh, path)
        settings = {"timestamping/enabled": True, **_closed(zenoh, config)}
    else:
        config = zenoh.Config()
        mode = "client" if words and not listens else "peer"
        settings = {
            **_COMMON,
            "mode": mode,
            "connect/endpoints": [_checked(word) for word in words] or _ROUTER_ON_LOCALHOST,
            "connect/timeout_ms": int(timeout * 1000) if words else -1,
            "connect/exit_on_failure": bool(words),
        }
        if mode == "peer":
            settings["listen/endpoints"] = [_LOOPBACK]
    if listens:
        settings["listen/endpoints"] = listens
    _insert(config, settings)
    _override(config, environ)
    from idlc.robot.zenoh_transport import ZenohTransport

    if len(words) > 1 and not listens:  # Zenoh itself would wait for the first one alone
        for word in words[:-1]:
            with suppress(RobotError):
                return open_session(word, domain=domain, timeout=timeout, environ=environ)
        return open_session(words[-1], domain=domain, timeout=timeout, environ=environ)
    target = ", ".join(words) or path
    return Session(ZenohTransport(_open(zenoh, config, target, timeout)), domain)


def open_router(
    listen: Iterable[str] = (f"tcp/127.0.0.1:{ROUTER_PORT}",),
    connect: Iterable[str] = (),
    environ: Mapping[str, str] = os.environ,
) -> Session:
    """Return a session that is a router for nodes on this machine, in place of `rmw_zenohd`.

    Other machines reach it only if `listen` contains an address of theirs, such as
    `tcp/0.0.0.0:7447`. It runs until it is closed. Raises RobotError.
    """
    zenoh = _import_zenoh()
    endpoints = [_checked(word) for word in listen]
    config = zenoh.Config()
    settings = {
        **_COMMON,
        "mode": "router",
        "listen/endpoints": endpoints,
        "connect/endpoints": [_checked(word) for word in connect],
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
    }
    _insert(config, settings)
    _override(config, environ)
    from idlc.robot.zenoh_transport import ZenohTransport

    try:
        return Session(ZenohTransport(zenoh.open(config)), _domain(environ))
    except zenoh.ZError as error:
        raise RobotError(
            f"no router can listen on {', '.join(endpoints)}: {_reason(error)}",
            "is another router running? choose another port with `--listen tcp/127.0.0.1:7448`",
        ) from None


def _reason(error: Exception) -> str:
    """Return an error of Zenoh without the position in its source."""
    text = re.split(r" at /| at [A-Za-z]:", str(error))[0]
    match = re.search(r'(?:Str\(|msg: )"(.*)"', text, re.DOTALL)
    return one_line((match[1] if match else text).split("\\n")[-1].strip(" ="))


def _import_zenoh() -> Any:
    try:
        import xxhash  # noqa: F401 - ids of endpoints need it
        import zenoh
    except ImportError as error:
        raise RobotError(
            f"eclipse-zenoh and xxhash are required: {error}",
            'install it: `pip install "idlc[zenoh]"`',
        ) from None
    return zenoh


def _domain(environ: Mapping[str, str]) -> int:
    text = environ.get("ROS_DOMAIN_ID", "").strip() or "0"
    if not (re.fullmatch("[0-9]{1,9}", text) and int(text) <= MOST_DOMAIN):
        raise RobotError(f"ROS_DOMAIN_ID is `{one_line(text)}`", "set it to a number such as 0")
    return int(text)


def _split(address: str) -> list[str]:
    if address.startswith(_FILE):
        return [address]
    return [word.strip() for word in address.split(",")]


def _checked(endpoint: str) -> str:
    """Return an endpoint; raise RobotError if it is malformed."""
    if _ENDPOINT.fullmatch(endpoint):
        return endpoint
    good = f"{endpoint}:{ROUTER_PORT}" if _WITHOUT_PORT.fullmatch(endpoint) else ""
    raise RobotError(
        f"`{one_line(endpoint)}` is not an endpoint",
        f"write `{one_line(good) or f'tcp/localhost:{ROUTER_PORT}'}`",
    )


def _read(zenoh: Any, path: str) -> Any:
    """Return the configuration in a file."""
    try:
        return zenoh.Config.from_file(path)
    except zenoh.ZError as error:
        raise RobotError(
            f"`{one_line(path)}` is not a configuration of Zenoh: {_reason(error)}",
            "write the name of a .json5 file, such as the files of rmw_zenoh_cpp",
        ) from None


def _closed(zenoh: Any, config: Any) -> dict[str, Any]:
    """Return settings that restrict a configuration to loopback where it leaves that open."""
    settings: dict[str, Any] = {}
    if config.get_json("listen/endpoints") == zenoh.Config().get_json("listen/endpoints"):
        settings["listen/endpoints"] = {"router": [_LOOPBACK], "peer": [_LOOPBACK]}
    if config.get_json("scouting/multicast/enabled") == "null":
        settings["scouting/multicast/enabled"] = False
    return settings


def _insert(config: Any, settings: Mapping[str, Any]) -> None:
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))


def _override(config: Any, environ: Mapping[str, str]) -> None:
    """Apply `path=json5;path=json5`, as rmw_zenoh does."""
    for item in environ.get("ZENOH_CONFIG_OVERRIDE", "").split(";"):
        key, separator, value = item.partition("=")
        try:
            if item.strip():
                config.insert_json5(key.strip(), value.strip() if separator else "")
        except Exception as error:  # ValueError or ZError, by the version of eclipse-zenoh
            raise RobotError(
                f"ZENOH_CONFIG_OVERRIDE has `{one_line(item)}`: {_reason(error)}",
                'write `mode="client";connect/endpoints=["tcp/robot:7447"]`',
            ) from None


def _open(zenoh: Any, config: Any, target: str, timeout: float) -> Any:
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        where = f"`{one_line(target)}`" if target else "the router"
        raise RobotError(
            f"{where} does not answer: {_reason(error)}",
            f"is rmw_zenohd or `idlc robot router` running there? idlc waited {timeout:g} s",
        ) from None
