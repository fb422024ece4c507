"""How messages are written, by their first bytes."""

from __future__ import annotations

from typing import NamedTuple

#: How ROS 2 writes messages.
CDR = "cdr"
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


class Unread(NamedTuple):
    """Why the messages of a topic cannot be read, and what can be done about it."""

    message: str
    hint: str


def unread(topic: str, start: bytes) -> Unread | None:
    """Return why messages that begin so cannot be read, or None if no such reason is known."""
    kind = _ENCAPSULATIONS.get(bytes((start[0], start[1] & ~1))) if len(start) > 1 else None
    if kind:
        what = f"messages of `{topic}` are written as {kind}, and idlc reads only plain CDR"
        return Unread(what, "record them from a publisher whose data representation is XCDR1")
    for magic, name in _COMPRESSIONS.items():
        if start.startswith(magic):
            what = (
                f"messages of `{topic}` are each compressed with {name}, and idlc reads only zstd"
            )
            return Unread(what, "`ros2 bag convert` can write the bag without compression")
    return None
