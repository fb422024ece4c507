"""The topics of a recording's files, of both formats, and what cannot be read of them."""

from __future__ import annotations

from typing import NamedTuple

import msgspec

from idlc.diagnostics.text import worded
from idlc.recordings.containers.source import RecordingError

#: How ROS 2 writes messages.
CDR = "cdr"
#: The encoding of definitions that are .msg files.
MSG = "ros2msg"


class Schema(msgspec.Struct, frozen=True):
    """A definition as it was recorded; `encoding` is ros2msg or ros2idl for those of ROS 2."""

    name: str
    encoding: str
    text: str

    @property
    def is_blank(self) -> bool:
        """True if it has no text, as the definition of a message without fields."""
        return not self.text.strip()


class Topic(msgspec.Struct, frozen=True):
    """The messages recorded under one name, of one type.

    `hash` is the type hash (RIHS01) and None where the recorder wrote none. `schema` is None where
    the recording has no definition. `qos` is the YAML of the publishers' profiles.
    """

    name: str
    type: str
    count: int
    hash: str | None
    encoding: str
    schema: Schema | None
    qos: str = ""


def full_name(name: str) -> str:
    """Return a type's name in three parts; pkg/Type is an older spelling of pkg/msg/Type."""
    package, slash, rest = name.partition("/")
    return f"{package}/msg/{rest}" if slash and "/" not in rest else name


def recorded_schema(schema: Schema) -> Schema | None:
    """Return a definition; where a recorder has none, it writes an empty one of no encoding."""
    return None if schema.is_blank and schema.encoding != MSG else schema


def wrong_count(topic: str, counted: int, actual: int) -> str:
    """Return the sentence about a number of messages that is not the counted one."""
    return f"the index lists {counted:,} messages of `{topic}`, but the file has {actual:,}"


def check_count(topic: str, counted: int, actual: int) -> None:
    """Raise RecordingError if the number of messages is not the counted one."""
    if counted != actual:
        hint = worded("`idlc columns --no-check`", "Recording(path, index=False)")
        hint += " ignores the counts in the file"
        raise RecordingError(wrong_count(topic, counted, actual), hint)


#: So many bytes suffice.
START = 6
#: By the encapsulation header without its last bit, which is the byte order (RTPS 2.5, 10.2).
_ENCAPSULATIONS = {
    b"\x00\x02": "PL_CDR (XCDR1)",
    b"\x00\x06": "PLAIN_CDR2 (XCDR2)",
    b"\x00\x08": "DELIMITED_CDR2 (XCDR2)",
    b"\x00\x0a": "PL_CDR2 (XCDR2)",
}
#: Compressions by what they begin with; CDR begins with a zero.
_COMPRESSIONS = {
    b"\x04\x22\x4d\x18": "lz4",
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ\x00": "xz",
}


class UnreadTopic(NamedTuple):
    """Why the messages of a topic cannot be read, and what can be done about it."""

    message: str
    hint: str


#: The packages that decode messages of other encodings.
_DECODERS = {"ros1": "mcap-ros1-support", "protobuf": "mcap-protobuf-support", "json": "mcap"}


def other_encoding(topic: str, encoding: str) -> UnreadTopic:
    """Return why messages that are not CDR cannot be read."""
    what = f"messages of `{topic}` are written as `{encoding}`, not as ROS 2 writes them, `{CDR}`"
    package = _DECODERS.get(encoding, "mcap")
    return UnreadTopic(what, f"the Python package `{package}` reads these messages")


def unread_reason(topic: str, start: bytes) -> UnreadTopic | None:
    """Return why messages that begin so cannot be read, or None if no such reason is known."""
    kind = _ENCAPSULATIONS.get(bytes((start[0], start[1] & ~1))) if len(start) > 1 else None
    if kind:
        what = f"messages of `{topic}` are encoded as {kind}, but idlc reads only plain CDR"
        return UnreadTopic(what, "record them from a publisher whose data representation is XCDR1")
    name = next((name for magic, name in _COMPRESSIONS.items() if start.startswith(magic)), None)
    if name is None:
        return None
    what = f"messages of `{topic}` are compressed with {name}, but idlc reads only zstd"
    return UnreadTopic(what, "`ros2 bag convert` can write the bag without compression")
