"""A recording → the same recording with topics of other types: whole beside the target, or nothing.

Whatever is not of a changed topic keeps its content, order and compression.
"""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

from idlc.project.atomic import ended_by_errors, make_folder, move_new, uninterrupted
from idlc.recordings.containers import bag
from idlc.recordings.containers.container import is_db3
from idlc.recordings.containers.conversion import Conversion, Recorded, RewrittenTopic
from idlc.recordings.containers.source import DamageError, RecordingError
from idlc.recordings.damage import Damage, DamageList

__all__ = ["Conversion", "RewrittenTopic", "rewrite"]


class Rewritten(NamedTuple):
    """The fate of each topic of a recording, and the parts that are damaged."""

    topics: dict[str, RewrittenTopic]
    damage: tuple[Damage, ...]


#: Called with a file's name, how much of it is done, and its size.
Progress = Callable[[str, int, int], object]
#: The files that SQLite has beside a database, whose content is in the copy of that.
BESIDE = ("-journal", "-shm", "-wal")


def rewrite(
    source: str,
    target: str,
    conversions: Mapping[str, Conversion],
    progress: Progress = lambda *_: None,
    *,
    index: bool = True,
    strict: bool = False,
) -> Rewritten:
    """Write a recording with conversions of topics, by their names, to a path that is free.

    Both are files of one format, or folders of bags. Without `index`, the counts in MCAP files are
    not used. What is damaged is left out, or an error if `strict`. Raises RecordingError, and what
    `convert` raises: then nothing is left of the target.
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
        with uninterrupted():
            move_new(draft, end)
    return Rewritten(rewriting.topics, tuple(rewriting.damage))


@contextmanager
def _draft(target: Path) -> Iterator[Path]:
    """Give a path in a hidden folder beside the target, which is removed at the end."""
    created: list[Path] = []
    folder = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    with ended_by_errors():
        try:
            make_folder(target.parent, created)
            folder.mkdir()
            yield folder / target.name
            created = []
        except OSError as error:
            reason = error.strerror or error
            raise RecordingError(f"`{target}` cannot be written: {reason}") from None
        finally:
            shutil.rmtree(folder, ignore_errors=True)
            for path in reversed(created):
                with suppress(OSError):
                    path.rmdir()


class _Rewriting:
    """The files of one recording; `topics` sums up what was written."""

    def __init__(
        self,
        conversions: Mapping[str, Conversion],
        index: bool,
        progress: Progress,
        strict: bool,
    ) -> None:
        self.conversions = conversions
        self.index = index
        self.progress = progress
        self.recorded: dict[str, Recorded] = {}
        self.strict = strict
        self.topics: dict[str, RewrittenTopic] = {}
        self.damage: list[Damage] = []

    def file(self, path: Path, target: Path) -> None:
        """Write a file."""
        progress = partial(self.progress, path.name)
        if is_db3(path):
            from idlc.recordings.containers.db3_rewrite import rewrite_db3

            topics = rewrite_db3(path, target, self.conversions, self.recorded, progress)
        else:
            from idlc.recordings.containers.mcap_rewrite import rewrite_mcap

            damage = DamageList(str(path), self.strict)
            with target.open("xb") as file:
                topics = rewrite_mcap(
                    path, file, self.conversions, self.recorded, self.index, progress, damage
                )
            self.damage += damage
        for name, own in topics.items():
            before = self.topics.get(name, RewrittenTopic(0, 0, own.converted))
            count, size = before.messages + own.messages, before.size + own.size
            self.topics[name] = RewrittenTopic(count, size, own.converted)

    def split(self, path: Path, target: Path, is_only: bool) -> None:
        """Write one of the files of a bag; others do not need it."""
        if path.name.endswith(bag.COMPRESSED):
            hint = f"zstd -d --rm {path}"
            raise RecordingError(f"the whole file `{path.name}` is compressed", hint)
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
        types = {name: (own.type, own.type_hash) for name, own in self.conversions.items()}
        target.mkdir()
        for path in sorted(folder.iterdir()):
            if path in paths:
                self.split(path, target / path.name, len(paths) == 1)
            elif path.name == bag.METADATA and (new := bag.retyped(path, types)) is not None:
                (target / path.name).write_bytes(new)
            elif path.name not in beside:
                _copy(path, target / path.name)


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
