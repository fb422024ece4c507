"""The new types of recorded topics, and the payloads of messages under them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias

from idlc.recordings.containers import file
from idlc.recordings.containers.compression import (
    ZSTD_MAGIC,
    DecompressionBudget,
    compress,
    zstd_frame,
)
from idlc.recordings.containers.messages import Raw
from idlc.recordings.containers.source import RecordingError

#: Payloads are converted together until they have so many bytes.
BATCH = 1 << 24


#: The full name of a recorded type, and the text of its definition, which may be empty.
DefinitionKey: TypeAlias = tuple[str, str]


def definition_key(kind: str, schema: file.Schema | None) -> DefinitionKey:
    """Return the key of a definition of a type."""
    return file.full_name(kind), "" if schema is None else schema.text


class Conversion(NamedTuple):
    """The new type of a recorded topic.

    `definition` is the schema's text with all dependencies, `encoding` its encoding, and
    `type_hash` the RIHS01 hash. `convert` takes payloads of a topic and their log times in
    nanoseconds, and returns as many payloads; without it, payloads are copied as they are. `old` is
    the definition that it is for, if a topic has several.
    """

    type: str
    encoding: str
    definition: str
    type_hash: str
    convert: Callable[[Sequence[Raw], Sequence[int]], Sequence[bytes]] | None = None
    old: DefinitionKey | None = None


#: By the name of a topic, its conversion, or those of its several definitions.
Conversions: TypeAlias = "Mapping[str, Conversion | tuple[Conversion, ...]]"


def selected(conversions: Conversions, topic: str, key: DefinitionKey) -> Conversion | None:
    """Return the conversion for the messages of a topic that have a definition."""
    found = conversions.get(topic)
    if found is None or isinstance(found, Conversion):
        return found
    return next((each for each in found if each.old == key), None)


class RewrittenTopic(NamedTuple):
    """The number of messages of a topic, the bytes of their payloads, and their fate."""

    messages: int = 0
    size: int = 0
    converted: bool = False

    def plus(self, messages: int, size: int, converted: bool) -> RewrittenTopic:
        """Return the sum of this topic and other messages."""
        return RewrittenTopic(
            self.messages + messages, self.size + size, self.converted or converted
        )


#: The messages of each definition of each topic.
RewrittenTopics: TypeAlias = dict[tuple[str, DefinitionKey], RewrittenTopic]


#: A type's name, and its definition where a recording has one.
Recorded: TypeAlias = tuple[str, file.Schema | None]


def check(
    topic: str,
    encoding: str,
    definition: Recorded,
    conversion: Conversion,
    recorded: dict[str, Recorded],
) -> None:
    """Raise RecordingError if one conversion cannot be that of all messages of a topic.

    `recorded` has the definitions of topics that were checked before, and is added to.
    """
    if conversion.convert and encoding != file.CDR:
        raise RecordingError(*file.other_encoding(topic, encoding))
    if conversion.old is not None:
        return
    kind, schema = definition
    if schema is not None and schema.is_blank:
        schema = None
    other_kind, other = recorded.get(topic, definition)
    if kind != other_kind or (schema and other and schema != other):
        raise RecordingError(f"`{topic}` is recorded with two different definitions")
    recorded[topic] = kind, schema or other


def converted(
    topic: str,
    conversion: Conversion,
    raws: Sequence[Raw],
    times: Sequence[int],
    room: DecompressionBudget,
) -> Iterator[bytes]:
    """Yield new payloads; those that are compressed by themselves remain so."""
    assert conversion.convert
    plain: list[Raw] = []
    size = done = 0
    for index, raw in enumerate(raws, 1):
        plain.append(zstd_frame(raw, room) if raw[:4] == ZSTD_MAGIC else raw)
        size += len(plain[-1])
        if size < BATCH and index < len(raws):
            continue
        if why := file.unread_reason(topic, bytes(plain[0][: file.START])):
            raise RecordingError(*why)
        new = conversion.convert(plain, times[done:index])
        for was, payload in zip(raws[done:index], new, strict=True):
            yield compress(payload, "zstd") if was[:4] == ZSTD_MAGIC else payload
        plain, size, done = [], 0, index
