"""Recordings among the words of a command line."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from glob import glob, has_magic
from pathlib import Path

from idlc.project.files import entries, is_file, is_folder
from idlc.project.find import KIND_FOLDERS, KINDS, is_address
from idlc.project.root import MANIFEST, Root
from idlc.recordings.containers.bag import COMPRESSED, METADATA, SUFFIXES, natural

#: Cannot be read, which opening it reports.
ROS_1 = ".bag"


def is_recording(word: str, root: Root) -> bool:
    """Return whether a word means a recording: an .mcap or .db3 file, or the folder of a bag.

    The address of a robot stands for a recording, too. A folder is that of a bag if it has a
    metadata.yaml, or recordings and no interfaces.
    """
    if is_address(word):
        return True
    path = Path(root.path(word))
    if not is_folder(path):
        return path.name.endswith((*SUFFIXES, *COMPRESSED, ROS_1))
    inside = entries(path)
    recorded = (entry for entry in inside if entry.name.endswith((*SUFFIXES, *COMPRESSED)))
    if not any(map(is_file, recorded)):
        return False
    names, kinds = {entry.name for entry in inside}, {entry.suffix for entry in inside}
    is_package = not names.isdisjoint({*KIND_FOLDERS, MANIFEST}) or not kinds.isdisjoint(KINDS)
    return METADATA in names or not is_package


def is_there(word: str) -> bool:
    """Return whether a path leads to a regular file or a folder; only opening a URL shows it."""
    return "://" in word or is_file(word) or is_folder(Path(word))


def split_recordings(words: Iterable[str], root: Root) -> tuple[list[str], list[str]]:
    """Return the words that mean recordings, and the others."""
    recordings: list[str] = []
    others: list[str] = []
    for word in words:
        (recordings if is_recording(word, root) else others).append(word)
    return recordings, others


def files(words: Iterable[str], root: Root) -> list[Path]:
    """Return the files of the recordings among words."""
    recordings = (word for word in words if is_recording(word, root) and not is_address(word))
    paths = [Path(root.path(word)) for word in recordings]
    return [file for path in paths for file in (path.iterdir() if is_folder(path) else [path])]


def expand(word: str) -> list[str]:
    """Return the paths that a word means, which may be a pattern such as `bags/*.mcap`."""
    if has_magic(word) and not is_there(word) and not is_address(word):
        paths = glob(word, recursive=True)  # noqa: PTH207 - keeps what was typed
        return sorted(paths, key=natural)
    return [word]


def in_order(words: Sequence[str]) -> list[str]:
    """Return the files of a split recording in the order of their numbers; others as they are.

    A shell sorts the matches of a pattern as texts: drive_10.mcap before drive_2.mcap.
    """
    is_split = len({re.sub(r"\d+", "0", word) for word in words}) == 1
    return sorted(words, key=natural) if is_split else list(words)


def recordings_of(
    against: str, paths: tuple[str, ...], root: Root
) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Return the recordings that --against means, those among the paths, and the other paths.

    --against may be a pattern. A shell that expands it leaves all but the first recording among the
    paths; beside other paths, they count as if they were part of --against.
    """
    matches = expand(against)
    if not split_recordings(matches, root)[0]:
        return (), (), paths
    more, others = split_recordings(paths, root)
    if others:
        return tuple(dict.fromkeys((*matches, *more))), (), tuple(others)
    return tuple(matches), tuple(dict.fromkeys(more)), ()
