"""What is in a recording, whichever kind of file it is and in however many pieces."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from idlc.recordings import bag
from idlc.recordings.db3 import MAGIC as DB3_MAGIC
from idlc.recordings.db3 import Db3, Rows
from idlc.recordings.errors import RecordingError, of_file
from idlc.recordings.mcap import McapFacts, read_facts
from idlc.recordings.mcap_records import MAGIC as MCAP_MAGIC
from idlc.recordings.mcap_records import Chunk
from idlc.recordings.source import MappedFile, OpenedFile, Source

if TYPE_CHECKING:
    from idlc.recordings.messages import Messages, Window

__all__ = ["Container", "RecordingError", "Schema", "Topic", "open_recording"]


@dataclass(frozen=True)
class Schema:
    """A definition as it was recorded; `encoding` is ros2msg or ros2idl for those of ROS 2."""

    name: str
    encoding: str
    text: str


@dataclass(frozen=True)
class Topic:
    """What was recorded under one name, of one type.

    `hash` is the type hash (RIHS01) and None where the recorder wrote none. `count` is None where
    nothing counted the messages. `schema` is None where the recording has no definition.
    """

    name: str
    type: str
    count: int | None
    hash: str | None
    encoding: str
    schema: Schema | None


class McapFile:
    """One MCAP file, and which channels mean which topic."""

    def __init__(self, source: Source, index: bool, check: bool) -> None:
        self.source = source
        self.check = check
        self.name = source.name
        with of_file(self.name):
            self.facts: McapFacts = read_facts(source, index, check)
        self.notes = [f"{Path(self.name).name}: {note}" for note in self.facts.notes]
        self.topics: list[tuple[Topic, int]] = [self._topic(one) for one in self.facts.channels]

    def _topic(self, number: int) -> tuple[Topic, int]:
        facts = self.facts
        channel = facts.channels[number]
        found = facts.schemas.get(channel.schema)
        name = full_name(found.name) if found else ""
        schema = Schema(name, found.encoding, found.text) if found and found.text else None
        count = facts.counts.get(number, 0) if facts.counts is not None else None
        digest = channel.metadata.get("topic_type_hash") or None
        return Topic(channel.topic, name, count, digest, channel.encoding, schema), number

    def pieces(self, channels: Collection[int], window: Window) -> list[Chunk]:
        """Return where messages of some channels may be."""
        from idlc.recordings.mcap_messages import may_have

        return [one for one in self.facts.chunks if may_have(one, channels, window)]

    def messages(
        self, channels: Collection[int], pieces: Iterable[Chunk], window: Window
    ) -> Iterator[Messages]:
        """Yield the messages of some channels in some chunks."""
        from idlc.recordings.mcap_messages import messages

        return messages(self.source, pieces, channels, window, self.check)

    def close(self) -> None:
        """Release the file."""
        self.source.close()


class Db3File:
    """One .db3 file."""

    def __init__(self, path: Path) -> None:
        self.name = str(path)
        self.database = Db3(path)
        self.notes: list[str] = []
        self.topics: list[tuple[Topic, int]] = []
        for one in self.database.topics():
            name = full_name(one.type)
            schema = Schema(name, one.schema_encoding, one.text) if one.text.strip() else None
            topic = Topic(one.name, name, one.messages, one.hash or None, one.encoding, schema)
            self.topics.append((topic, one.id))

    def pieces(self, topics: Collection[int], window: Window) -> list[Rows]:  # noqa: ARG002
        """Return where messages of some topics may be."""
        return self.database.rows_of_messages()

    def messages(
        self, topics: Collection[int], pieces: Iterable[Rows], window: Window
    ) -> Iterator[Messages]:
        """Yield the messages of some topics in some rows."""
        from idlc.recordings.db3_messages import messages

        return messages(self.database, pieces, topics, window)

    def close(self) -> None:
        """Close the file."""
        self.database.close()


class Container:
    """An open recording: its topics, and the files that they are in."""

    def __init__(self, name: str, files: list[McapFile | Db3File], notes: Iterable[str]) -> None:
        self.name = name
        self.files = files
        self.notes = (*notes, *(note for file in files for note in file.notes))
        self.topics: tuple[Topic, ...] = tuple(_merged(files))

    def ids_of(self, topic: Topic) -> Iterator[tuple[McapFile | Db3File, list[int]]]:
        """Yield each file that has messages of a topic, and what it calls the topic."""
        for file in self.files:
            ids = [number for one, number in file.topics if _is_part_of(one, topic)]
            if ids:
                yield file, ids

    def messages(self, topic: Topic, window: Window) -> Iterator[Messages]:
        """Yield the messages of a topic, many at a time, in the order of the recording."""
        for file, ids in self.ids_of(topic):
            yield from file.messages(ids, file.pieces(ids, window), window)  # type: ignore[arg-type]

    def close(self) -> None:
        """Close all files."""
        for file in self.files:
            file.close()

    def __enter__(self) -> Container:  # noqa: PYI034 # Self came with Python 3.11
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_recording(path: Any, *, index: bool = True, check: bool = False) -> Container:
    """Open an .mcap or .db3 file, or the folder of a bag; raise RecordingError if it is none.

    Without `index`, MCAP files are walked over whatever their summaries say. `check` compares
    checksums.
    """
    path = Path(path)
    if not path.is_dir():
        return Container(str(path), [_open_file(path, index, check)], ())
    paths, notes = bag.files_of(path)
    files: list[McapFile | Db3File] = []
    try:
        for one in paths:
            files.append(_open_file(one, index, check))  # noqa: PERF401 # those before are closed
    except RecordingError:
        for file in files:
            file.close()
        raise
    return Container(str(path), files, notes)


def _open_file(path: Path, index: bool, check: bool) -> McapFile | Db3File:
    """Open one file, by what it begins with."""
    hint: str | None = None
    if path.name == bag.METADATA:
        hint = f"name the folder: `{path.parent}`"
        raise RecordingError(f"`{path}` describes a recording and is none", hint)
    source = MappedFile(path)
    if not source.size:
        raise RecordingError(f"`{path}` is empty")
    start = bytes(source.view(0, min(source.size, 16)))
    if start.startswith(DB3_MAGIC):
        source.close()
        return Db3File(path)
    if not start.startswith(MCAP_MAGIC):
        if start.startswith(b"#ROSBAG"):
            hint = "`rosbags-convert` reads those of ROS 1"
        if start.startswith(b"\x28\xb5\x2f\xfd"):
            hint = f"it is compressed as a whole: zstd -d {path}"
        raise RecordingError(f"`{path}` is no recording: neither MCAP nor .db3", hint)
    return McapFile(source, index, check)


def open_mcap(file: Any, name: str, *, index: bool = True, check: bool = False) -> Container:
    """Open an MCAP file that is a file object, such as fsspec's."""
    return Container(name, [McapFile(OpenedFile(file, name), index, check)], ())


def full_name(name: str) -> str:
    """Return a type's name in three parts; pkg/Type is an older spelling of pkg/msg/Type."""
    package, slash, rest = name.partition("/")
    return f"{package}/msg/{rest}" if slash and "/" not in rest else name


def _is_part_of(one: Topic, whole: Topic) -> bool:
    """Return whether a channel belongs to a topic: definitions may be left out."""
    same = (one.name, one.type, one.encoding) == (whole.name, whole.type, whole.encoding)
    return same and one.schema in (whole.schema, None)


def _merged(files: list[McapFile | Db3File]) -> Iterable[Topic]:
    """Yield each topic once: several channels and files may have it."""
    found: dict[tuple[str, str, str], list[Topic]] = {}
    for file in files:
        for topic, _ in file.topics:
            found.setdefault((topic.name, topic.type, topic.encoding), []).append(topic)
    for same in found.values():
        texts = dict.fromkeys(topic.schema for topic in same if topic.schema)
        for schema in texts or [None]:
            whole = replace(same[0], schema=schema)
            mine = [one for one in same if _is_part_of(one, whole)]
            counts = [one.count for one in mine]
            hashes = [one.hash for one in mine if one.hash]
            yield replace(
                whole,
                count=None if None in counts else sum(filter(None, counts)),
                hash=hashes[0] if hashes else None,
            )
