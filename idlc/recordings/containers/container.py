"""The content of a recording, of any kind of file and in any number of pieces."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar

from msgspec.structs import replace

from idlc.project.find import is_address
from idlc.recordings.containers import bag, db3, records
from idlc.recordings.containers.compression import ZSTD_MAGIC
from idlc.recordings.containers.db3 import Db3File
from idlc.recordings.containers.file import (
    CDR,
    Schema,
    Topic,
    UnreadTopic,
    check_count,
    unread_reason,
)
from idlc.recordings.containers.mcap import McapFile
from idlc.recordings.containers.source import RecordingError, first_bytes, is_local, of_file

if TYPE_CHECKING:
    from idlc.recordings.containers.messages import Messages, Window

#: One file of a recording. Its `place` is what it was opened by. Its `topics` have with each topic
#: the number by which messages name it; of several channels, each is a topic. Pieces of a file are
#: chunks or rows, and `parts` are these divided, or together, where they take about some size.
File: TypeAlias = McapFile | Db3File
Opened = TypeVar("Opened", bound="File | Container")

__all__ = ["Container", "RecordingError", "Schema", "Topic", "open_recording"]


class Channel(NamedTuple):
    """A topic of one file, which is there by its index, and its number in it."""

    file: int
    number: int
    topic: Topic


class Container(AbstractContextManager["Container"]):
    """An open recording: its topics, and the files that they are in."""

    def __init__(self, name: str, files: list[File], notes: Iterable[str]) -> None:
        self.name = name
        self.files = files
        self.notes = (*notes, *(note for file in files for note in file.notes))
        self._channels = dict(_merged(files))
        self.topics: tuple[Topic, ...] = tuple(self._channels)

    def places(self, topic: Topic) -> Iterator[tuple[File, list[int], int]]:
        """Yield each file with messages of a topic, its numbers in the file, and their count."""
        counts: dict[int, dict[int, int]] = {}
        mine, bare = self._channels[topic]
        for file, number, own in sorted([*mine, *bare], key=lambda channel: channel.file):
            counts.setdefault(file, {})[number] = own.count
        for file, by_number in counts.items():
            yield self.files[file], list(by_number), sum(by_number.values())

    def joined(self, topics: Sequence[Topic]) -> Topic:
        """Return one topic with the messages of several, whose types are the same."""
        channels = [self._channels[topic] for topic in topics]
        mine, bare = (
            list(dict.fromkeys(own for pair in channels for own in pair[side])) for side in (0, 1)
        )
        count = sum(channel.topic.count for channel in (*mine, *bare))
        topic = replace(topics[0], count=count)
        self._channels[topic] = mine, bare
        return topic

    def messages(self, topic: Topic, window: Window) -> Iterator[Messages]:
        """Yield the messages of a topic, many at a time, in the order of the recording."""
        for file, numbers, counted in self.places(topic):
            total = 0
            for batch in file.messages(numbers, file.pieces(numbers, window), window):
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

    def __exit__(self, *_: object) -> None:
        self.close()


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
    if is_address(str(path)):
        hint = f"record it first: `idlc record {path} -o robot.mcap`"
        raise RecordingError(f"`{path}` is the address of a robot", hint)
    path = Path(path)
    if not path.is_dir():
        return Container(str(path), [_open_file(path, index, check)], ())
    paths, notes = bag.files_of(path)
    return Container(str(path), _all_or_none(paths, lambda p: _open_file(p, index, check)), notes)


def open_pieces(place: Any) -> File:
    """Open a file to read pieces of it that are known: nothing else is read."""
    if is_local(place) and Path(place).suffix == ".db3":
        return Db3File(Path(place), read=False)
    return McapFile(place, read=False)


def _all_or_none(places: Iterable[Any], opened: Callable[[Any], Opened]) -> list[Opened]:
    """Return the opened files; close all if one of them fails."""
    with ExitStack() as stack:
        files = [stack.enter_context(closing(opened(place))) for place in places]
        stack.pop_all()
    return files


def _open_file(path: Path, index: bool, check: bool) -> File:
    return Db3File(path) if is_db3(path) else McapFile(path, index, check)


def is_db3(path: Path) -> bool:
    """Return whether a file is .db3, not MCAP; raise RecordingError if it is neither."""
    hint: str | None = None
    if path.name == bag.METADATA:
        hint = f"give the folder: `{path.parent}`"
        raise RecordingError(f"`{path}` is the metadata of a recording, not a recording", hint)
    start = first_bytes(path)
    if start.startswith((db3.MAGIC, records.MAGIC)):
        return start.startswith(db3.MAGIC)
    if not start:
        raise RecordingError(f"`{path}` is empty")
    if start.startswith(b"#ROSBAG"):
        hint = "`rosbags-convert` converts ROS 1 recordings"
    if start.startswith(ZSTD_MAGIC):
        hint = f"the whole file is compressed: zstd -d {path}"
    raise RecordingError(f"`{path}` is not an MCAP or .db3 recording", hint)


def _merged(files: list[File]) -> Iterator[tuple[Topic, tuple[list[Channel], list[Channel]]]]:
    """Yield each topic once, with its channels: several of these and several files may have it."""
    by_name: dict[tuple[str, str, str], dict[Schema | None, list[Channel]]] = {}
    for index, file in enumerate(files):
        for topic, number in file.topics:
            schema = None if topic.schema is None or topic.schema.is_blank else topic.schema
            by_schema = by_name.setdefault((topic.name, topic.type, topic.encoding), {})
            by_schema.setdefault(schema, []).append(Channel(index, number, topic))
    for by_schema in by_name.values():
        # without a definition, or with an empty one, a channel belongs to each of the others
        bare = sorted(by_schema.pop(None, []), key=lambda channel: channel.topic.schema is None)
        more, other = _counted(bare)
        for mine in by_schema.values() or [[]]:
            count, digest = _counted(mine)
            topic = (mine or bare)[0].topic
            yield replace(topic, count=count + more, hash=digest or other), (mine, bare)


def _counted(channels: list[Channel]) -> tuple[int, str | None]:
    """Return how many messages channels have, and their first hash."""
    count = sum(channel.topic.count for channel in channels)
    return count, next((channel.topic.hash for channel in channels if channel.topic.hash), None)
