"""The lengths of messages, which prove whether they are of the type that they are read as."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from idlc.recordings.containers.file import Topic
from idlc.recordings.containers.source import RecordingError
from idlc.runtime.typeinfo import Structure

if TYPE_CHECKING:  # it imports numpy, which classes do not need
    from idlc.recordings.containers.messages import Raw

#: Middlewares pad messages to a multiple of four bytes.
MOST_PADDING = 3
#: The hint where messages are not of the type that they are recorded with.
WRONG_DEFINITION = (
    "use the publisher's files for the recorder; where a definition is missing, add --distro or -I"
)
#: So many messages show whether a type fits.
SAMPLE = 64


def fits(structure: Structure, raws: Sequence[Raw]) -> bool:
    """Return whether messages can be read as a type, to their ends."""
    from idlc.recordings.columns import unread_bytes

    unread = unread_bytes(structure, raws)
    return unread is not None and not (unread > MOST_PADDING).any()


class WrongDefinitionError(RecordingError):
    """Messages are of another version of the type that they are recorded with."""


def check_lengths(
    topic: Topic,
    structure: Structure,
    unread: Any,
    raws: Sequence[Raw],
    known_versions: Iterable[tuple[str, Structure]],
    hint: str = WRONG_DEFINITION,
) -> str:
    """Return what the lengths of messages prove, empty if they fit a type.

    `unread` has the number of bytes in each message that the type does not read, and is `None` if
    one cannot be read; `raws` are some of the messages. Raises WrongDefinitionError if no message
    fits, but another version does.
    """
    if unread is None:
        what = f"messages of `{topic.name}` do not have the definition of {topic.type}"
        is_proof = True
    else:
        wrong = unread > MOST_PADDING
        if not wrong.any():
            return ""
        least, most = int(unread[wrong].min()), int(unread.max())
        size = f"{most:,}" if least == most else f"{least:,} to {most:,}"
        is_proof = bool(wrong.all())
        which = "each message" if is_proof else f"{int(wrong.sum()):,} of {len(wrong):,} messages"
        what = f"{which} of `{topic.name}` has {size} bytes that the definition of {topic.type} "
        what += "does not read"
    if is_proof:
        for words, version in known_versions:
            if version.hash != structure.hash and fits(version, raws):
                raise WrongDefinitionError(f"{what}; {words} fits", hint)
    return "" if unread is None else f"{what}: the publisher has another version of the type"
