"""A recording → the same recording with topics of other types: whole beside the target, or nothing.

Whatever is not of a changed topic keeps its content, order and compression.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

from msgspec.structs import replace

from idlc.diagnostics.terminal import Progress
from idlc.project import atomic
from idlc.project.words import METADATA, ZSTD
from idlc.recordings.containers import bag
from idlc.recordings.containers.compression import ZSTD_MAGIC, unpack
from idlc.recordings.containers.container import is_db3, open_recording
from idlc.recordings.containers.conversion import (
    Conversion,
    Conversions,
    Recorded,
    RewrittenTopic,
    RewrittenTopics,
)
from idlc.recordings.containers.db3_to_mcap import as_mcap, convert_db3
from idlc.recordings.containers.file import full_name
from idlc.recordings.containers.source import DamageError, RecordingError, first_bytes
from idlc.recordings.damage import Damage, DamageList

__all__ = ["Conversion", "RewrittenTopic", "rewrite"]

#: New drafts that are made if other runs remove them as abandoned before they are locked.
ATTEMPTS = 3


class Rewritten(NamedTuple):
    """The fate of each definition of a recording's topics, and the parts that are damaged."""

    definitions: RewrittenTopics
    damage: tuple[Damage, ...]

    @property
    def topics(self) -> dict[str, RewrittenTopic]:
        """The fate of each topic."""
        topics: dict[str, RewrittenTopic] = {}
        for (name, _), fate in self.definitions.items():
            topics[name] = topics.get(name, RewrittenTopic()).plus(*fate)
        return topics


#: The files that SQLite has beside a database, whose content is in the copy of that.
BESIDE = ("-journal", "-shm", "-wal")


def mcap_name(path: Path) -> str:
    """Return the name of the MCAP file that a recording becomes."""
    plain = path.with_name(path.name.removesuffix(ZSTD))
    return plain.with_suffix(".mcap").name if plain.suffix == ".db3" else plain.name


def rewrite(
    source: str,
    target: str,
    conversions: Conversions,
    progress: Progress = lambda *_: None,
    *,
    index: bool = True,
    strict: bool = False,
) -> Rewritten:
    """Write a recording with conversions of topics, by their names, to a path that is free.

    Files that are written are MCAP, and folders are those of bags. Without `index`, the counts in
    MCAP files are not used. What is damaged is left out, or an error if `strict`. Raises
    RecordingError, and what `convert` raises: then nothing is left of the target.
    """
    start, end = Path(source), Path(target)
    if os.path.lexists(end):
        same = start.exists() and end.exists() and end.samefile(start)
        raise RecordingError(f"`{target}` {'is the recording itself' if same else 'exists'}")
    if start.resolve() in end.resolve().parents:
        raise RecordingError(f"`{target}` is inside of `{source}`")
    with _draft(end) as draft:
        rewriting = _Rewriting(conversions, index, progress, strict)
        if start.is_dir():
            rewriting.folder(start, draft)
        else:
            rewriting.file(start, draft)
        for path in draft.rglob("*") if draft.is_dir() else (draft,):
            if path.is_file() and not path.is_symlink():
                with path.open("r+b") as file:
                    os.fsync(file.fileno())
        with atomic.uninterrupted():
            atomic.move_new(draft, end)
    return rewriting.result


@contextmanager
def _draft(target: Path) -> Iterator[Path]:
    """Give a path in a hidden folder beside the target, which is removed at the end."""
    created: list[Path] = []
    folder = target.parent
    with atomic.ended_by_errors(), ExitStack() as held:
        try:
            atomic.make_folder(target.parent, created)
            _remove_abandoned(target)
            for _ in range(ATTEMPTS):
                folder = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
                folder.mkdir()
                is_locked = held.enter_context(atomic.locked(folder))
                if is_locked is not False and folder.exists():
                    break  # no other run has taken it for an abandoned one meanwhile
            yield folder / target.name
            created = []
        except OSError as error:
            reason = error.strerror or error
            raise RecordingError(f"`{target}` cannot be written: {reason}") from None
        finally:
            if folder != target.parent:
                shutil.rmtree(folder, ignore_errors=True)
            for path in reversed(created):
                with suppress(OSError):
                    path.rmdir()


def _remove_abandoned(target: Path) -> None:
    """Remove the drafts of runs that were killed: nobody has locked them anymore."""
    name = re.compile(re.escape(f".{target.name}.") + "[0-9a-f]{8}")
    for folder in target.parent.iterdir():
        if name.fullmatch(folder.name) and folder.is_dir() and not folder.is_symlink():
            with atomic.locked(folder) as is_mine:
                if is_mine:
                    shutil.rmtree(folder, ignore_errors=True)


class _Rewriting:
    """The files of one recording; `definitions` sums up what was written."""

    def __init__(
        self, conversions: Conversions, index: bool, progress: Progress, strict: bool
    ) -> None:
        self.conversions = conversions
        self.index = index
        self.progress = progress
        self.recorded: dict[str, Recorded] = {}
        self.strict = strict
        self.definitions: RewrittenTopics = {}
        self.damage: list[Damage] = []

    @property
    def result(self) -> Rewritten:
        """The topics that were written, and the damage, so far."""
        return Rewritten(self.definitions, tuple(self.damage))

    @property
    def messages(self) -> int:
        """The number of messages that were written."""
        return sum(topic.messages for topic in self.definitions.values())

    def file(self, path: Path, target: Path) -> None:
        """Write a file."""
        if first_bytes(path).startswith(ZSTD_MAGIC):
            self.packed(path, target)
            return
        progress = partial(self.progress, path.name)
        with target.open("xb") as file:
            if is_db3(path):
                how = self.conversions, self.recorded, progress, self.strict
                topics, damage = convert_db3(path, file, *how)
            else:
                from idlc.recordings.containers.mcap_rewrite import rewrite_mcap

                damage = DamageList(str(path), self.strict)
                topics = rewrite_mcap(
                    path, file, self.conversions, self.recorded, self.index, progress, damage
                )
        self.damage += damage
        for key, fate in topics.items():
            self.definitions[key] = self.definitions.get(key, RewrittenTopic()).plus(*fate)

    def _new_type(self, topic: str, kind: str) -> tuple[str, str] | None:
        """Return the new name and hash of a topic's type, and `None` if it does not change."""
        found = self.conversions.get(topic, ())
        for each in reversed((found,) if isinstance(found, Conversion) else found):
            if each.old is None or each.old[0] == full_name(kind):
                return each.type, each.type_hash
        return None

    def _count(self, topic: tuple[str, str], listed: Sequence[tuple[str, str]]) -> int:
        """Return the messages of a listed topic, only those of its type if there are others."""
        name, kind = topic
        is_only = [other for other, _ in listed].count(name) == 1
        return sum(
            fate.messages
            for (own, (type_, _)), fate in self.definitions.items()
            if own == name and (is_only or type_ == full_name(kind))
        )

    def packed(self, path: Path, target: Path) -> None:
        """Write a file that is compressed as a whole; the new one is not."""
        known = len(self.damage)
        with tempfile.TemporaryDirectory(prefix="idlc-") as folder:
            plain = Path(folder, path.name.removesuffix(ZSTD))
            problem = unpack(path, plain)
            if problem and self.strict:
                raise DamageError(f"`{path}`: {problem}")
            try:
                self.file(plain, target)
            except RecordingError as error:
                message = error.message.replace(str(plain), str(path))
                raise type(error)(message, error.hint) from None
        found = [replace(damage, file=str(path)) for damage in self.damage[known:]]
        self.damage[known:] = [*([Damage(str(path), problem)] if problem else []), *found]

    def split(self, path: Path, target: Path, is_only: bool) -> None:
        """Write one of the files of a bag; others do not need it."""
        try:
            self.file(path, target)
        except DamageError as error:
            if self.strict or is_only:
                raise
            target.unlink(missing_ok=True)
            self.damage.append(Damage(str(path), error.message.replace(f"`{path}`", "it")))

    def folder(self, folder: Path, target: Path) -> None:
        """Write a bag, with all that is in its folder."""
        bag_files = bag.files_of(folder)
        paths = bag_files.paths
        self.damage += bag_files.missing
        beside = {f"{path.name}{suffix}" for path in paths for suffix in BESIDE}
        target.mkdir()
        counts: dict[str, int] = {}
        for path in sorted(folder.iterdir()):
            if path in paths:
                before = self.messages
                self.split(path, target / mcap_name(path), len(paths) == 1)
                if (target / mcap_name(path)).exists():
                    counts[path.name.removesuffix(ZSTD)] = self.messages - before
            elif path.name not in (*beside, METADATA):
                _copy(path, target / path.name)
        metadata = folder / METADATA
        if not metadata.is_file():
            return
        data = bag.retyped(metadata, self._new_type)
        if data is None:
            _copy(metadata, target / METADATA)
            return
        if self.damage:
            listed = bag.listed_topics(metadata)
            files: dict[str, bag.FileExtent] = {}
            for name, count in counts.items():
                with open_recording(str(target / mcap_name(Path(name)))) as written:
                    files[name] = bag.FileExtent(count, written.span())
            data = bag.recounted(data, [self._count(topic, listed) for topic in listed], files)
        is_mcap = all(path.suffix == ".mcap" for path in paths)
        data = data if is_mcap else as_mcap(data.decode()).encode()
        (target / METADATA).write_bytes(data)


def _copy(path: Path, target: Path) -> None:
    """Copy a file or a folder; links remain links."""
    if path.is_symlink():
        target.symlink_to(path.readlink())
    elif path.is_dir():
        target.mkdir()
        for inside in path.iterdir():
            _copy(inside, target / inside.name)
    elif path.is_file():
        shutil.copyfile(path, target)
    else:
        raise RecordingError(f"`{path}` is neither a file nor a folder")
