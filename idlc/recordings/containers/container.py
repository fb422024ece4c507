"""The content of a recording, of any kind of file and in any number of pieces."""

from __future__ import annotations

from array import array
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from idlc.recordings.containers import bag
from idlc.recordings.containers.compression import ZSTD_MAGIC
from idlc.recordings.containers.db3 import MAGIC as DB3_MAGIC
from idlc.recordings.containers.db3 import Db3, Rows
from idlc.recordings.containers.mcap import (
    INDEX_OFFSET,
    Chunk,
    McapFacts,
    first_messages,
    read_facts,
)
from idlc.recordings.containers.mcap import MAGIC as MCAP_MAGIC
from idlc.recordings.containers.source import (
    CDR,
    RecordingError,
    UnreadTopic,
    first_bytes,
    is_local,
    of_file,
    source_of,
    unread_reason,
)

if TYPE_CHECKING:
    from idlc.recordings.containers.messages import Messages, Window

Opened = TypeVar("Opened", bound="File")
DB3 = ".db3"
#: The encoding of definitions that are .msg files.
MSG = "ros2msg"

__all__ = ["Container", "RecordingError", "Schema", "Topic", "open_recording"]


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
    the recording has no definition.
    """

    name: str
    type: str
    count: int
    hash: str | None
    encoding: str
    schema: Schema | None


class File:
    """A base of files that are closed by `close`, or by leaving a `with` statement."""

    def close(self) -> None:
        """Release the file."""

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class McapFile(File):
    """One MCAP file, and which channels mean which topic."""

    def __init__(
        self, place: Any, index: bool = True, check: bool = False, read: bool = True
    ) -> None:
        self.place = place
        self.check = check
        self.source = source_of(place)
        self.name = self.source.name
        with of_file(self.name):
            self.facts = read_facts(self.source, index, check) if read else McapFacts()
        self.notes = [f"{Path(self.name).name}: {note}" for note in self.facts.notes]
        self.topics: list[tuple[Topic, int]] = list(map(self._topic, self.facts.channels))

    def _topic(self, number: int) -> tuple[Topic, int]:
        facts = self.facts
        channel = facts.channels[number]
        recorded = facts.schemas.get(channel.schema)
        name = full_name(recorded.name) if recorded else ""
        schema = _schema(name, recorded.encoding, recorded.text) if recorded else None
        count = facts.counts.get(number, 0)
        digest = channel.metadata.get("topic_type_hash") or None
        return Topic(channel.topic, name, count, digest, channel.encoding, schema), number

    @property
    def start(self) -> int | None:
        """The time of the first message."""
        return self.facts.start

    def first_messages(self) -> Iterator[tuple[int, bytes]]:
        """Yield channels with how their first messages begin."""
        return first_messages(self.source, self.facts, self.facts.channels)

    def pieces(self, channels: Collection[int], window: Window) -> list[Chunk]:
        """Return the chunks that may hold messages of some channels, with the indexes of these."""
        from idlc.recordings.containers.messages import may_have

        mine: dict[int, bytes] = {}
        for channel in channels:
            entries = self._indexes.get(channel, ())
            for number, at in zip(entries[::2], entries[1::2], strict=True):
                mine[number] = mine.get(number, b"") + INDEX_OFFSET.pack(channel, at)
        chunks = [
            chunk._replace(indexes=mine.get(number))
            for number, chunk in enumerate(self.facts.chunks)
            if number in mine or chunk.indexes is None
        ]
        if window != (None, None):
            chunks = self._checked(chunks, channels)
        return [chunk for chunk in chunks if may_have(chunk, window)]

    @cached_property
    def _indexes(self) -> dict[int, array[int]]:
        """By channel the numbers of chunks, each followed by the offset of its MessageIndex."""
        indexes: dict[int, array[int]] = defaultdict(lambda: array("Q"))
        for number, chunk in enumerate(self.facts.chunks):
            for channel, at in INDEX_OFFSET.iter_unpack(chunk.indexes or b""):
                indexes[channel].extend((number, at))
        return indexes

    def _checked(self, chunks: list[Chunk], channels: Collection[int]) -> list[Chunk]:
        """Return chunks of some channels, without their indexes if these may be incomplete.

        Raises RecordingError if the indexes miss messages, which a window would miss, too. In
        stores that is not checked, because each index is a request there.
        """
        from idlc.recordings.containers.messages import count

        loose, counts = self.facts.loose, self.facts.counts
        whole = [chunk for chunk in chunks if chunk.compression is not None]
        if loose is None or not is_local(self.place):
            return chunks
        if any(chunk.indexes is None for chunk in whole):
            return [chunk._replace(indexes=None) for chunk in self.facts.chunks]
        with of_file(self.name):
            counted = sum(counts.get(number, 0) - loose.get(number, 0) for number in channels)
            name = self.facts.channels[next(iter(channels))].topic
            check_count(name, counted, sum(count(self.source, chunk) for chunk in whole))
        return chunks

    def messages(
        self, channels: Collection[int], pieces: Iterable[Chunk], window: Window
    ) -> Iterator[Messages]:
        """Yield the messages of some channels in some chunks."""
        from idlc.recordings.containers.messages import mcap_messages

        return mcap_messages(self.source, pieces, channels, window, self.check)

    def close(self) -> None:
        """Release the file."""
        self.source.close()


class Db3File(File):
    """One .db3 file."""

    def __init__(self, path: Path, read: bool = True) -> None:
        self.place = str(path)
        self.name = str(path)
        self.database = Db3(path)
        self.notes = self.database.notes
        self.topics: list[tuple[Topic, int]] = []
        for row in self.database.topics() if read else ():
            name = full_name(row.type)
            schema = _schema(name, row.schema_encoding, row.text)
            topic = Topic(row.name, name, row.messages, row.hash or None, row.encoding, schema)
            self.topics.append((topic, row.id))

    @property
    def start(self) -> int | None:
        """The time of the first message."""
        return self.database.start()

    def first_messages(self) -> Iterator[tuple[int, bytes]]:
        """Yield topics with how their first messages begin."""
        return self.database.first_messages()

    def pieces(self, topics: Collection[int], window: Window) -> list[Rows]:  # noqa: ARG002
        """Return the rows that may hold messages of some topics."""
        return self.database.rows_of_messages()

    def messages(
        self, topics: Collection[int], pieces: Iterable[Rows], window: Window
    ) -> Iterator[Messages]:
        """Yield the messages of some topics in some rows."""
        from idlc.recordings.containers.messages import db3_messages

        return db3_messages(self.database, pieces, topics, window)

    def close(self) -> None:
        """Close the file."""
        self.database.close()


class Container(File):
    """An open recording: its topics, and the files that they are in."""

    def __init__(self, name: str, files: list[McapFile | Db3File], notes: Iterable[str]) -> None:
        self.name = name
        self.files = files
        self.notes = (*notes, *(note for file in files for note in file.notes))
        self.topics: tuple[Topic, ...] = tuple(_merged(files))

    @cached_property
    def _places(self) -> dict[tuple[str, str, str], list[tuple[int, Topic, int]]]:
        """By topic, with any definition: the number of the file, its topic and the id in it."""
        places: dict[tuple[str, str, str], list[tuple[int, Topic, int]]] = {}
        for index, file in enumerate(self.files):
            for topic, number in file.topics:
                places.setdefault(_key(topic), []).append((index, topic, number))
        return places

    def ids_of(self, topic: Topic) -> Iterator[tuple[McapFile | Db3File, list[int], int]]:
        """Yield each file with messages of a topic, its ids of the topic, and their count."""
        mine: dict[int, dict[int, int]] = {}
        for index, in_file, number in self._places.get(_key(topic), ()):
            if in_file.schema == topic.schema or _is_bare(in_file):
                mine.setdefault(index, {})[number] = in_file.count
        for index, counts in mine.items():
            yield self.files[index], list(counts), sum(counts.values())

    def messages(self, topic: Topic, window: Window) -> Iterator[Messages]:
        """Yield the messages of a topic, many at a time, in the order of the recording."""
        for file, ids, counted in self.ids_of(topic):
            total = 0
            for batch in file.messages(ids, file.pieces(ids, window), window):  # type: ignore[arg-type]
                total += len(batch)
                yield batch
            if window == (None, None):
                with of_file(file.name):
                    check_count(topic.name, counted, total)

    def unread(self) -> list[UnreadTopic]:
        """Return the topics that cannot be read, judging by the first message of each."""
        reasons: dict[UnreadTopic, None] = {}
        for file in self.files:
            names = {number: topic.name for topic, number in file.topics if topic.encoding == CDR}
            with suppress(RecordingError):  # reading the messages says what is wrong
                for number, start in file.first_messages():
                    why = unread_reason(names[number], start) if number in names else None
                    if why:
                        reasons[why] = None
        return list(reasons)

    def start(self) -> int:
        """Return when the first message came; 0 if there is none."""
        starts = [file.start for file in self.files]
        return min((time for time in starts if time is not None), default=0)

    def close(self) -> None:
        """Close all files."""
        for file in self.files:
            file.close()


def open_recording(path: Any, *, index: bool = True, check: bool = False) -> Container:
    """Open an .mcap or .db3 file, or the folder of a bag; raise RecordingError if it is none.

    A list of them is one recording. MCAP files may also be URLs that fsspec can open, and file
    objects. Without `index`, MCAP files are walked over whatever their summaries say. `check`
    compares checksums.
    """
    if isinstance(path, (list, tuple)):
        opened = _all_or_none(path, lambda place: open_recording(place, index=index, check=check))
        files = [file for container in opened for file in container.files]
        return Container(", ".join(container.name for container in opened), files, ())
    if not is_local(path):
        return Container(str(path), [McapFile(path, index, check)], ())
    path = Path(path)
    if not path.is_dir():
        return Container(str(path), [_open_file(path, index, check)], ())
    paths, notes = bag.files_of(path)
    return Container(str(path), _all_or_none(paths, lambda p: _open_file(p, index, check)), notes)


def open_pieces(place: Any) -> McapFile | Db3File:
    """Open a file to read pieces of it that are known: nothing else is read."""
    if is_local(place) and Path(place).suffix == DB3:
        return Db3File(Path(place), read=False)
    return McapFile(place, read=False)


def _all_or_none(places: Iterable[Any], opened: Callable[[Any], Opened]) -> list[Opened]:
    """Return the opened files; close all if one of them fails."""
    files: list[Opened] = []
    try:
        for place in places:
            files.append(opened(place))  # noqa: PERF401 # files opened before are closed
    except RecordingError:
        for file in files:
            file.close()
        raise
    return files


def _open_file(path: Path, index: bool, check: bool) -> McapFile | Db3File:
    """Open one file, by its first bytes."""
    hint: str | None = None
    if path.name == bag.METADATA:
        hint = f"name the folder: `{path.parent}`"
        raise RecordingError(f"`{path}` describes a recording and is none", hint)
    start = first_bytes(path)
    if start.startswith(DB3_MAGIC):
        return Db3File(path)
    if start.startswith(MCAP_MAGIC):
        return McapFile(path, index, check)
    if not start:
        raise RecordingError(f"`{path}` is empty")
    if start.startswith(b"#ROSBAG"):
        hint = "`rosbags-convert` reads those of ROS 1"
    if start.startswith(ZSTD_MAGIC):
        hint = f"it is compressed as a whole: zstd -d {path}"
    raise RecordingError(f"`{path}` is no recording: neither MCAP nor .db3", hint)


def full_name(name: str) -> str:
    """Return a type's name in three parts; pkg/Type is an older spelling of pkg/msg/Type."""
    package, slash, rest = name.partition("/")
    return f"{package}/msg/{rest}" if slash and "/" not in rest else name


def _schema(name: str, encoding: str, text: str) -> Schema | None:
    """Return a definition; where a recorder has none, it writes an empty one of no encoding."""
    schema = Schema(name, encoding, text)
    return None if schema.is_blank and encoding != MSG else schema


def _is_bare(topic: Topic) -> bool:
    """Return whether a channel has no definition, or an empty one, which others may complete."""
    return topic.schema is None or topic.schema.is_blank


def _key(topic: Topic) -> tuple[str, str, str]:
    """Return the properties that all channels of a topic share."""
    return topic.name, topic.type, topic.encoding


def check_count(topic: str, counted: int, actual: int) -> None:
    """Raise RecordingError if the number of messages is not the counted one."""
    if counted != actual:
        hint = "--no-index, or Recording(path, index=False), reads without what the file counts"
        what = f"{counted:,} messages of `{topic}` are counted, and there are {actual:,}"
        raise RecordingError(what, hint)


def _merged(files: list[McapFile | Db3File]) -> Iterable[Topic]:
    """Yield each topic once: several channels and files may have it."""
    by_key: dict[tuple[str, str, str], list[Topic]] = {}
    for file in files:
        for topic, _ in file.topics:
            by_key.setdefault(_key(topic), []).append(topic)
    for same in by_key.values():
        by_schema: dict[Schema | None, list[Topic]] = {}
        for topic in same:
            by_schema.setdefault(None if _is_bare(topic) else topic.schema, []).append(topic)
        # without a definition, a channel belongs to each of the others
        bare = _joined(sorted(by_schema.pop(None, []), key=lambda topic: topic.schema is None))
        for mine in by_schema.values() or [[]]:
            yield _joined([*mine, *bare])[0]


def _joined(same: list[Topic]) -> list[Topic]:
    """Return at most one topic for channels: their total, their first definition and hash."""
    digest = next((topic.hash for topic in same if topic.hash), None)
    total = sum(topic.count for topic in same)
    return [msgspec.structs.replace(topic, count=total, hash=digest) for topic in same[:1]]
