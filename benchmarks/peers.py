"""The implementations that the rows compare: each one's classes, encoders and decoders.

An implementation that is not installed is left out, and the output says so.
"""

import contextlib
import io
import json
import re
import shutil
import sys
from collections.abc import Callable
from functools import cached_property, lru_cache
from importlib import import_module, metadata, util
from pathlib import Path

from benchmarks import jit
from benchmarks.measure import IDLC
from benchmarks.messages import MESSAGES, PACKAGES, Maker
from idlc.cli.main import main as idlc_main
from idlc.model import catalog

Call = Callable[[], object]

#: The generated packages get names of their own, so that the official ones can be there, too.
PREFIX = "by_idlc_"
#: Each peer, what must be importable for it, and the distribution whose version counts.
PEERS = {
    "rosbags": ("rosbags", "rosbags"),
    "rclpy": ("rclpy", "ros-jazzy-rclpy"),
    "rosidl": ("rosidl_generator_py", "ros-rosidl-generator-py"),
    "mcap-ros2": ("mcap_ros2", "mcap-ros2-support"),
    "cyclonedds": ("cyclonedds", "cyclonedds"),
    "cydr": ("cydr", "cydr"),
    "edgefirst-schemas": ("edgefirst", "edgefirst-schemas"),
    "rerun-sdk": ("rerun", "rerun-sdk"),
    "roboto-mcap-codec": ("mcap_codec", "roboto-mcap-codec"),
    "ros2-pkg-create": ("ros2_pkg_create", "ros2-pkg-create"),
}
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def installed(peer: str) -> bool:
    """Return whether a peer can be used; cydr compiles its codecs by a C compiler."""
    return util.find_spec(PEERS[peer][0]) is not None and (peer != "cydr" or bool(COMPILER))


def versions() -> dict[str, str]:
    """Return the versions of all peers that are installed."""
    return {peer: metadata.version(PEERS[peer][1]) for peer in PEERS if installed(peer)}


def run_idlc(*words: object) -> str:
    """Run a command of idlc in this process and return what it prints."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        status = idlc_main([str(word) for word in words])
    assert status == 0, words
    return out.getvalue()


def generate(folder: Path, packages=PACKAGES, prefix: str = PREFIX) -> Path:
    """Compile packages of the catalogue, under names of their own; return where they can be had."""
    own = re.compile(rf"\b({'|'.join(packages)})/")
    for name in catalog.interfaces():
        if name.package in packages:
            share = folder / "in" / f"{prefix}{name.package}"
            path = share / name.kind / f"{name.name}.{name.kind}"
            path.parent.mkdir(parents=True, exist_ok=True)
            text = catalog.source(name).text
            path.write_text(own.sub(rf"{prefix}\1/", text), encoding="utf-8")
    for package in packages:
        share = folder / "in" / f"{prefix}{package}"
        out = folder / "out" / share.name
        run_idlc("gen", share, "-o", out, "--package", share.name, "-I", folder / "in")
    return folder / "out"


@lru_cache
def mcap_schema(name: str) -> str:
    """Return the text of a message and of all that it holds, as MCAP files carry it."""
    return run_idlc("show", name, "--format", "mcap")


class Implementation:
    """The operations that rows measure; rows skip implementations without the operation."""

    def message(self, row: str, raw: bytes) -> object | None:
        """Return the row's message, made of this implementation's classes."""
        raise NotImplementedError

    def encoder(self, row: str, message: object) -> Call:
        """Return a function that serializes a message."""
        raise NotImplementedError

    def decode(self, row: str) -> Callable[[bytes], object]:
        """Return a function that deserializes buffers."""
        raise NotImplementedError

    def decoder(self, row: str, raw: bytes) -> Call:
        """Return a function that deserializes one buffer."""
        decode = self.decode(row)
        return lambda: decode(raw)


class Idlc(Implementation):
    """The packages that idlc generates from the catalogue."""

    def __init__(self, generated: Path) -> None:
        sys.path.insert(0, str(generated))

    def class_of(self, package: str, name: str) -> type:
        return getattr(import_module(f"{PREFIX}{package}.msg"), name)

    def message(self, row, raw):
        return MESSAGES[row].make(Maker(self.class_of, b"\0"))

    def encoder(self, row, message):
        return lambda: message.serialize()

    def decode(self, row):
        return self.class_of(*MESSAGES[row].parts).deserialize


class Rclpy(Implementation):
    """The official packages, which rosidl made: their codecs are in C."""

    def class_of(self, package: str, name: str) -> type:
        return getattr(import_module(f"{package}.msg"), name)

    def message(self, row, raw):
        # there is no wheel of tf2_msgs
        if util.find_spec(MESSAGES[row].parts[0]) is None:
            return None
        return MESSAGES[row].make(Maker(self.class_of, b"\0"))

    def encoder(self, row, message):
        from rclpy.serialization import serialize_message

        return lambda: serialize_message(message)

    def decode(self, row):
        from rclpy.serialization import deserialize_message

        kind = self.class_of(*MESSAGES[row].parts)
        return lambda raw: deserialize_message(raw, kind)


class Rosbags(Implementation):
    """rosbags' type store of ROS 2 Jazzy."""

    @cached_property
    def store(self):
        from rosbags.typesys import Stores, get_typestore

        return get_typestore(Stores.ROS2_JAZZY)

    def class_of(self, package: str, name: str) -> type:
        return self.store.types[f"{package}/msg/{name}"]

    def message(self, row, raw):
        return MESSAGES[row].make(Maker(self.class_of, 0))

    def encoder(self, row, message):
        store, name = self.store, MESSAGES[row].type
        return lambda: store.serialize_cdr(message, name)

    def decode(self, row):
        store, name = self.store, MESSAGES[row].type
        return lambda raw: store.deserialize_cdr(raw, name)


class McapRos2(Implementation):
    """mcap-ros2-support, whose classes exist only while it decodes."""

    def message(self, row, raw):
        return self.decoder(row, raw)()

    def encoder(self, row, message):
        from mcap_ros2._dynamic import serialize_dynamic

        name = MESSAGES[row].type
        encode = serialize_dynamic(name, mcap_schema(name))[name]
        return lambda: encode(message)

    def decode(self, row):
        from mcap_ros2._dynamic import generate_dynamic

        name = MESSAGES[row].type
        return generate_dynamic(name, mcap_schema(name))[name]


class Cyclonedds(Implementation):
    """Cyclone DDS's Python package, with classes as its own IDL compiler writes them."""

    def __init__(self) -> None:
        self.namespace: dict[str, object] = {}

    def class_of(self, name: str):
        from benchmarks.cyclone import class_name, source

        if class_name(name) not in self.namespace:
            facts = json.loads(run_idlc("show", name, "--format", "json"))
            exec(source([*facts["structures"], *facts["uses"]]), self.namespace)  # noqa: S102
        return self.namespace[class_name(name)]

    def message(self, row, raw):
        return self.decoder(row, raw)()

    def encoder(self, row, message):
        return lambda: message.serialize()

    def decode(self, row):
        return self.class_of(MESSAGES[row].type).deserialize


class Cydr(Implementation):
    """cydr, of which codecs are machine code; it has no sequences of structures."""

    def __init__(self, folder: Path) -> None:
        self.classes = jit.Classes(folder)

    def class_of(self, row: str):
        facts = json.loads(run_idlc("show", MESSAGES[row].type, "--format", "json"))
        return self.classes.of([*facts["structures"], *facts["uses"]])

    def message(self, row, raw):
        try:
            return self.class_of(row).deserialize(raw)
        except KeyError:
            return None

    def encoder(self, row, message):
        return lambda: message.serialize()

    def decode(self, row):
        return self.class_of(row).deserialize


def implementations(generated: Path) -> dict[str, Implementation]:
    """Return all that are installed; idlc comes first."""
    peers = {
        "rclpy": Rclpy,
        "rosbags": Rosbags,
        "mcap-ros2": McapRos2,
        "cyclonedds": Cyclonedds,
        "cydr": lambda: Cydr(generated.parent / "cydr"),
    }
    return {IDLC: Idlc(generated)} | {name: peers[name]() for name in peers if installed(name)}
