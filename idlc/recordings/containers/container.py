"""The content of a recording, of any kind of file and in any number of pieces."""

from __future__ import annotations

import shlex
import shutil
import tempfile
import weakref
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar

from msgspec.structs import replace

from idlc.project.words import METADATA, SUFFIXES, ZSTD, is_address
from idlc.recordings.containers import bag, db3, records
from idlc.recordings.containers.compression import ZSTD_MAGIC, unpack
from idlc.recordings.containers.db3 import Db3File
from idlc.recordings.containers.file import (
    CDR,
    Schema,
    Topic,
    UnreadTopic,
    unread_reason,
    wrong_count,
)
from idlc.recordings.containers.mcap import McapFile
from idlc.recordings.containers.source import DamageError, RecordingError, first_bytes, is_local
from idlc.recordings.damage import Damage

if TYPE_CHECKING:
    from idlc.recordings.containers.messages import TopicMessages, Window

#: One file of a recording. Its `place` is what it was opened by. Its `topics` have with each topic
#: the number by which messages name it; of several channels, each is a topic. Pieces of a file are
#: chunks or rows, and `parts` are these divided, or together, where they take about some size.
RecordingFile: TypeAlias = McapFile | Db3File
Opened = TypeVar("Opened", bound="RecordingFile | Container")
#: The first bytes of files that stand for a recording which was not downloaded.
GIT_LFS, GIT_ANNEX = b"version https://git-lfs", b"/annex/objects/"

__all__ = ["Container", "RecordingError", "Schema", "Topic", "open_recording"]


class FileChannel(NamedTuple):
    """A topic of one file, which is there by its index, and its number in it."""

    file: int
    number: int
    topic: Topic


class Container(AbstractContextManager["Container"]):
    """An open recording: its topics, and the files that they are in."""

    def __init__(
        self,
        name: str,
        files: list[RecordingFile],
        notes: Iterable[str] = (),
        damage: Iterable[Damage] = (),
    ) -> None:
        self.name = name
        self.files = files
        self.notes_of_bag = tuple(notes)
        self.damage_of_bag = tuple(damage)
        self._late: dict[str, int] = {}
        self._channels = dict(_merged(files))
        self.topics: tuple[Topic, ...] = tuple(self._channels)

    @property
    def damage(self) -> tuple[Damage, ...]:
        """The parts of the recording that were found to be damaged until now."""
        return (*self.damage_of_bag, *(damage for file in self.files for damage in file.damage))

    @property
    def notes(self) -> tuple[str, ...]:
        """What is unusual about the recording, as far as it was read."""
        of_files = [note for file in self.files for note in file.notes]
        unproven = [
            f"{Path(file.name).name}: no checksum covers some of its messages, which may be damaged"
            for file in self.files
            if file.damage and file.damage.is_unproven
        ]
        late = [
            f"`{topic}`: {count:,} {'time' if count == 1 else 'times'} after the year 2262: null"
            for topic, count in self._late.items()
        ]
        return (*self.notes_of_bag, *of_files, *unproven, *late)

    def places(self, topic: Topic) -> Iterator[tuple[RecordingFile, list[int], int]]:
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

    def messages(self, topic: Topic, window: Window) -> Iterator[TopicMessages]:
        """Yield the messages of a topic, many at a time, in the order of the recording.

        Raises RecordingError if damage has left none of them.
        """
        read = late = 0
        for file, numbers, counted in self.places(topic):
            total = 0
            for batch in file.messages(numbers, file.pieces(numbers, window), window):
                total += len(batch)
                late += batch.late()
                yield batch
            if window == (None, None) and total != counted and not file.damage:
                file.damage.add(wrong_count(topic.name, counted, total))
            read += total
        if late:
            self._late[topic.name] = late
        if topic.count and not read and window == (None, None) and self.damage:
            raise DamageError(f"`{topic.name}` has no readable messages: {self.damage[0]}")

    def sizes(self) -> dict[Topic, int]:
        """Return the bytes of the messages of each topic, as far as they are known."""
        files: list[dict[int, int] | None] = []
        for file in self.files:
            by_number = None
            with suppress(DamageError):
                by_number = file.sizes()
            files.append(by_number)
        sizes: dict[Topic, int] = {}
        for topic, (mine, bare) in self._channels.items():
            size = 0
            for channel in (*mine, *bare):
                by_number = files[channel.file]
                if by_number is None:
                    break
                size += by_number.get(channel.number, 0)
            else:
                sizes[topic] = size
        return sizes

    def verify(self) -> None:
        """Read all messages once, so that all damage is known."""
        from idlc.recordings.containers.messages import ALWAYS

        for file in self.files:
            numbers = [number for _, number in file.topics]
            total = late = 0
            for batch in file.messages(numbers, file.pieces(numbers, ALWAYS), ALWAYS):
                total += len(batch)
                late += batch.late()
            if late:
                self._late[Path(file.name).name] = late
            counted = sum(topic.count for topic, _ in file.topics)
            if total != counted and not file.damage:
                what = f"its index lists {counted:,} messages, but it has {total:,}"
                file.damage.add(what)

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

    def span(self) -> tuple[int, int] | None:
        """Return the times of the first and the last message; None if there is none."""
        starts = [file.start for file in self.files if file.start is not None]
        ends = [file.end for file in self.files if file.end is not None]
        return (min(starts), max(ends)) if starts and ends else None

    def start(self) -> int:
        """Return when the first message came; 0 if there is none."""
        span = self.span()
        return span[0] if span else 0

    def close(self) -> None:
        """Close all files."""
        for file in self.files:
            file.close()

    def __exit__(self, *_: object) -> None:
        self.close()


def open_recording(
    path: Any, *, index: bool = True, check: bool | None = None, strict: bool = False
) -> Container:
    """Open an .mcap or .db3 file, or the folder of a bag; raise RecordingError if it is none.

    A list of them is one recording. MCAP files may also be URLs that fsspec can open, and file
    objects. Without `index`, MCAP files are walked over whatever their summaries say. `check`
    compares checksums; None does so only in files that are known to be damaged. With `strict`,
    damage is an error.
    """

    def opened(place: Path) -> RecordingFile:
        return _opened(place, index, check, strict)

    if isinstance(path, (list, tuple)):
        containers, damage = _readable(
            path,
            lambda place: open_recording(place, index=index, check=check, strict=strict),
            strict,
        )
        files = [file for container in containers for file in container.files]
        own_notes = [note for container in containers for note in container.notes_of_bag]
        damage += [each for container in containers for each in container.damage_of_bag]
        name = ", ".join(container.name for container in containers)
        return Container(name, files, own_notes, damage)
    if not is_local(path):
        return Container(str(path), [McapFile(path, index, check, strict=strict)])
    if is_address(str(path)):
        hint = f"record it first: `idlc record {shlex.quote(str(path))} -o robot.mcap`"
        raise RecordingError(f"`{path}` is the address of a robot", hint)
    path = Path(path)
    if not path.is_dir():
        return Container(str(path), [opened(path)])
    return _opened_bag(path, opened, strict)


def _opened_bag(path: Path, opened: Callable[[Path], RecordingFile], strict: bool) -> Container:
    """Open the folder of a bag."""
    bag_files = bag.files_of(path)
    if strict and bag_files.missing:
        raise RecordingError(bag_files.missing[0].problem)
    files, damage = _readable(bag_files.paths, opened, strict)
    count = sum(topic.count for file in files for topic, _ in file.topics)
    if count < bag_files.counted:
        what = f"{METADATA} counts {bag_files.counted:,} messages, and the files have {count:,}"
        logs = [f"`{file.log}`" for file in files if isinstance(file, Db3File) and file.is_lone]
        rest = f"; the others may be in {', '.join(logs)}, which is missing" if logs else ""
        bag_files.notes.append(what + rest)
    return Container(str(path), files, bag_files.notes, [*bag_files.missing, *damage])


def open_pieces(place: Any, check: bool | None = None, strict: bool = False) -> RecordingFile:
    """Open a file to read pieces of it that are known: nothing else is read."""
    if is_local(place):
        return _opened(Path(place), True, check, strict, read=False)
    return McapFile(place, check=check, read=False, strict=strict)


def _opened(
    place: Path, index: bool, check: bool | None, strict: bool, read: bool = True
) -> RecordingFile:
    """Open a file; one that is compressed as a whole is decompressed to a temporary file."""
    if not first_bytes(place).startswith(ZSTD_MAGIC):
        if is_db3(place):
            return Db3File(place, read, strict)
        return McapFile(place, index, check, read, strict)
    folder = tempfile.mkdtemp(prefix="idlc-")
    try:
        plain = Path(folder, place.name.removesuffix(ZSTD))
        problem = unpack(place, plain)
        file = _opened(plain, index, check, strict, read)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(file, shutil.rmtree, folder, ignore_errors=True)
    file.name = file.place = file.damage.file = str(place)
    if problem:
        file.damage.add(problem)
    return file


def _readable(
    places: Iterable[Any], opened: Callable[[Any], Opened], strict: bool
) -> tuple[list[Opened], list[Damage]]:
    """Return the opened files, and the damage of those that cannot be read.

    If none can be, or with `strict`, the first error is raised, and all are closed.
    """
    files: list[Opened] = []
    errors: list[tuple[str, DamageError]] = []
    with ExitStack() as stack:
        for place in places:
            try:
                files.append(stack.enter_context(closing(opened(place))))
            except DamageError as error:
                errors.append((str(place), error))
        if errors and (strict or not files):
            raise errors[0][1]
        stack.pop_all()
    damage = [
        Damage(name, error.message.removeprefix(f"`{name}`: ").replace(f"`{name}`", "it"))
        for name, error in errors
    ]
    return files, damage


def is_db3(path: Path) -> bool:
    """Return whether a file is .db3, not MCAP; raise RecordingError if it is neither."""
    hint: str | None = None
    if path.name == METADATA:
        hint = f"give the folder: `{path.parent}`"
        raise RecordingError(f"`{path}` is the metadata of a recording, not a recording", hint)
    start = first_bytes(path, 64)
    if start.startswith((db3.MAGIC, records.MAGIC)):
        return start.startswith(db3.MAGIC)
    if not start:
        raise DamageError(f"`{path}` is empty")
    if start.startswith(GIT_LFS):
        hint = "`git lfs pull` downloads it"
        raise DamageError(f"`{path}` is a pointer of Git LFS to a recording", hint)
    if start.startswith(GIT_ANNEX):
        hint = f"`git annex get {shlex.quote(str(path))}` downloads it"
        raise DamageError(f"`{path}` is a pointer of git-annex to a recording", hint)
    if start.startswith(b"#ROSBAG"):
        source, target = shlex.quote(str(path)), shlex.quote(str(path.with_suffix("")))
        hint = f"convert it: `rosbags-convert --src {source} --dst {target}`"
        raise RecordingError(f"`{path}` is a recording of ROS 1, which idlc does not read", hint)
    if start.startswith(ZSTD_MAGIC):
        hint = f"zstd -d {shlex.quote(str(path))}"
        raise RecordingError(f"`{path}` is compressed as a whole", hint)
    kind = DamageError if path.suffix in SUFFIXES else RecordingError
    raise kind(f"`{path}` is not an MCAP or .db3 recording", hint)


def _merged(
    files: list[RecordingFile],
) -> Iterator[tuple[Topic, tuple[list[FileChannel], list[FileChannel]]]]:
    """Yield each topic once, with its channels: several of these and several files may have it."""
    by_name: dict[tuple[str, str, str], dict[Schema | None, list[FileChannel]]] = {}
    for index, file in enumerate(files):
        for topic, number in file.topics:
            schema = None if topic.schema is None or topic.schema.is_blank else topic.schema
            by_schema = by_name.setdefault((topic.name, topic.type, topic.encoding), {})
            by_schema.setdefault(schema, []).append(FileChannel(index, number, topic))
    for by_schema in by_name.values():
        # without a definition, or with an empty one, a channel belongs to each of the others
        bare = sorted(by_schema.pop(None, []), key=lambda channel: channel.topic.schema is None)
        more, other = _counted(bare)
        for mine in by_schema.values() or [[]]:
            count, digest = _counted(mine)
            topic = (mine or bare)[0].topic
            yield replace(topic, count=count + more, hash=digest or other), (mine, bare)


def _counted(channels: list[FileChannel]) -> tuple[int, str | None]:
    """Return how many messages channels have, and their first hash."""
    count = sum(channel.topic.count for channel in channels)
    return count, next((channel.topic.hash for channel in channels if channel.topic.hash), None)
