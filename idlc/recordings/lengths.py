"""The lengths of messages, which prove whether they are of the type that they are read as."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from struct import Struct
from typing import TYPE_CHECKING, Any, NamedTuple

from idlc.diagnostics.text import worded
from idlc.model.distros import Distro
from idlc.recordings.containers.file import Topic
from idlc.recordings.containers.source import RecordingError
from idlc.runtime.typeinfo import Structure

if TYPE_CHECKING:  # it imports numpy, which classes do not need
    from idlc.recordings.containers.messages import Raw, TopicMessages

#: Middlewares pad messages to a multiple of four bytes.
MOST_PADDING = 3
#: So many messages show whether a type fits.
SAMPLE = 64


def sample(batches: Iterable[TopicMessages]) -> list[Raw]:
    """Return the first messages, as many as show whether a type fits."""
    raws: list[Raw] = []
    for batch in batches:
        raws += batch.first_views(SAMPLE - len(raws))
        if len(raws) >= SAMPLE:
            break
    return raws


def fits(structure: Structure, raws: Sequence[Raw]) -> bool:
    """Return whether messages can be read as a type, to their ends."""
    from idlc.recordings.columns import unread_bytes

    unread = unread_bytes(structure, raws)
    return unread is not None and first_longer(structure, unread, raws) is None


def first_longer(structure: Structure, unread: Any, raws: Sequence[Raw]) -> int | None:
    """Return the index of the first message that is longer than its type; `None` if none is.

    `unread` has the number of bytes in each message that the type does not read.
    """
    for index in (unread > MOST_PADDING).nonzero()[0].tolist():
        if not 0 <= len(raws[index]) - estimated_size(structure, raws[index]) <= MOST_PADDING:
            return int(index)
    return None


def estimated_size(structure: Structure, raw: Raw) -> int:
    """Return the size that `rmw_fastrtps_cpp` gives to a message that it serializes for rosbag2.

    It estimates the size before it writes: sequences of 8-byte elements are aligned even if they
    are empty, and a wstring has room for one more character.
    """
    estimate = _Estimate(raw)
    estimate.add(structure)
    return HEADER + estimate.size


#: The bytes before the first field, in which the second is the byte order.
HEADER = 4


class _Estimate:
    """The position in a message that can be read as its type, and in the estimate."""

    def __init__(self, raw: Raw) -> None:
        self._data = memoryview(raw)[HEADER:]
        self._unpack = Struct("<I" if raw[1] & 1 else ">I").unpack_from
        self._at = 0
        self.size = 0

    def add(self, structure: Structure) -> None:
        """Add the fields of a structure."""
        for field in structure.members:
            count = self._length() if field.is_sequence else field.size or 1
            if field.primitive:
                self._numbers(field.primitive.size, count)
            else:
                for _ in range(count):
                    if field.nested:
                        self.add(field.nested)
                    else:
                        self._text(4 if field.wide else 1)

    def _length(self) -> int:
        self._at += -self._at % 4
        self.size += -self.size % 4
        (length,) = self._unpack(self._data, self._at)
        self._at += 4
        self.size += 4
        return int(length)

    def _text(self, width: int) -> None:
        length = self._length()
        self._at += length * width
        self.size += length * width + (width if width > 1 else 0)

    def _numbers(self, size: int, count: int) -> None:
        if count:
            self._at += -self._at % size + count * size
        self.size += -self.size % size + count * size


class KnownVersion(NamedTuple):
    """A version of a type, and the words that name it.

    A recording that defines nothing can be read as that of a `distro`.
    """

    words: str
    structure: Structure
    distro: Distro | None = None


class WrongDefinitionError(RecordingError):
    """Messages are of another version of the type that they are recorded with."""


def wrong_definition(topic: Topic, distro: Distro | None = None, option: str = "") -> str:
    """Return the hint where messages are of another version of their type, maybe of a `distro`."""
    if topic.schema is not None and not topic.schema.is_blank:
        return "use the publisher's files for the recorder"
    if distro is not None:
        usual = worded(f"--distro {distro.name}", f"distro={distro.name!r}")
        return f"use `{f'{option} distro:{distro.name}' if option else usual}`"
    usual = worded("`--distro` or `-I`", "`distro=` or `include=`")
    return f"choose the publisher's version with {f'`{option}`' if option else usual}"


def check_lengths(
    topic: Topic,
    structure: Structure,
    unread: Any,
    raws: Sequence[Raw],
    known_versions: Iterable[KnownVersion],
    option: str = "",
) -> str:
    """Return what the lengths of messages prove, empty if they fit a type.

    `unread` has the number of bytes in each message that the type does not read, and is `None` if
    one cannot be read; `raws` are some of the messages, those that are longest if any is too long.
    Raises WrongDefinitionError if no message fits, but another version does. Its hint names the
    `option` that chooses a version where the recording has none.
    """
    if unread is None:
        what = f"messages of `{topic.name}` do not have the definition of {topic.type}"
        is_proof = True
    else:
        from idlc.recordings.columns import unread_bytes

        wrong = unread > MOST_PADDING
        if not wrong.any() or first_longer(structure, unread_bytes(structure, raws), raws) is None:
            return ""
        least, most = int(unread[wrong].min()), int(unread.max())
        size = f"{most:,}" if least == most else f"{least:,} to {most:,}"
        is_proof = bool(wrong.all())
        which = "each message" if is_proof else f"{int(wrong.sum()):,} of {len(wrong):,} messages"
        what = f"{which} of `{topic.name}` has {size} bytes that the definition of {topic.type} "
        what += "does not read"
    if is_proof:
        for words, version, distro in known_versions:
            if version.hash != structure.hash and fits(version, raws):
                raise WrongDefinitionError(
                    f"{what}; {words} fits", wrong_definition(topic, distro, option)
                )
    return "" if unread is None else f"{what}: the publisher has another version of the type"
