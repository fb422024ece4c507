"""Message and service classes: their types for type checkers, and their names and hashes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from typing import Any, Literal, Protocol, TypeAlias, TypeVar

from idlc.robot.errors import RobotError
from idlc.runtime.names import wire_name
from idlc.runtime.typeinfo import types_of


class MessageLike(Protocol):
    """A message of a class that idlc generated or loaded."""

    def serialize(self, *, byteorder: Literal["little", "big"] = "little") -> bytes:
        """Return the message as CDR."""


M = TypeVar("M", bound=MessageLike)
RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT")
_Request = TypeVar("_Request", covariant=True)
_Response = TypeVar("_Response", covariant=True)


class _ServiceOfMypy(Protocol[_Request, _Response]):
    def Request(self, *args: Any, **kwargs: Any) -> _Request: ...  # noqa: N802
    def Response(self, *args: Any, **kwargs: Any) -> _Response: ...  # noqa: N802


class _ServiceOfPyright(Protocol[RequestT, ResponseT]):
    Request: type[RequestT]
    Response: type[ResponseT]


#: A service class of which type checkers see the messages; each of them accepts another part.
ServiceLike: TypeAlias = (
    "type[_ServiceOfPyright[RequestT, ResponseT]] | _ServiceOfMypy[RequestT, ResponseT]"
)


class InterfaceClass:
    """The name and hash of a type, and its class, which is loaded when it is first used."""

    def __init__(self, name: str, hash_: str, load: Callable[[], Any]) -> None:
        self.name = name
        self.hash = hash_
        self._load = load

    @cached_property
    def kind(self) -> Any:
        """The class."""
        return self._load()


def interface_of(kind: Any) -> InterfaceClass:
    """Return the type of a message or service class; raise RobotError for another class."""
    if isinstance(kind, InterfaceClass):
        return kind
    metaclass = type(kind)
    owner: Any = getattr(metaclass, "_message", None) or getattr(metaclass, "_interface", None)
    try:
        types = types_of(owner)
        folder = owner.__module__.rsplit(".", 2)[1]
        name = f"{types.package}/{folder}/{wire_name(owner.__name__)}"
        return InterfaceClass(name, types.hashes[name], lambda: kind)
    except (AttributeError, ImportError, KeyError, ValueError):
        raise RobotError(
            f"{kind!r} is not a message or service class of idlc",
            "generate it with `idlc gen`, or load it with `idlc.load`",
        ) from None


#: The types that every node announces; their hashes stand here so that a node does not compile
#: them, which takes a second, before it uses them.
_ANNOUNCED = """
rcl_interfaces/msg/Log=e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac
rcl_interfaces/msg/ParameterEvent=043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204
rcl_interfaces/srv/DescribeParameters=845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff
rcl_interfaces/srv/GetParameterTypes=da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca
rcl_interfaces/srv/GetParameters=bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc
rcl_interfaces/srv/ListParameters=3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d
rcl_interfaces/srv/SetParameters=56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0
rcl_interfaces/srv/SetParametersAtomically=0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd
type_description_interfaces/srv/GetTypeDescription=69b9c19c1021405984cc60dbbb1edceb147a6538b411d812ba6afabeed962cd5
"""
_HASHES = dict(line.split("=") for line in _ANNOUNCED.split())


@cache
def standard(name: str) -> InterfaceClass:
    """Return a type of the catalogue of ROS 2's interfaces."""
    package = name.partition("/")[0]
    if name in _HASHES:
        return InterfaceClass(name, f"RIHS01_{_HASHES[name]}", lambda: _package(package)[name])
    return interface_of(_package(package)[name])


@cache
def _package(name: str) -> Any:
    """Return a package of the catalogue; its types share their classes."""
    from idlc.recordings.load import loaded

    return loaded(name)
