"""The words of a command line: what each means."""

from __future__ import annotations

import os
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from glob import glob, has_magic
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.model.distros import BY_NAME, Distro, unknown_distro
from idlc.project.files import entries, is_file, is_folder
from idlc.project.find import KIND_FOLDERS, KINDS
from idlc.project.root import MANIFEST, Root

#: The address of a robot stands for a recording; a name is that of a type or package.
Meaning: TypeAlias = Literal["recording", "name", "path", "revision", "distribution"]
_VERSIONS: dict[str, Meaning] = {"git:": "revision", "distro:": "distribution"}
#: The name of a type or package, as ROS 2, Python or C++ writes it.
_NAME = re.compile(r"[A-Za-z]\w*((/|\.|::)\w+){0,2}")
#: DDS, a configuration file of Zenoh, or an endpoint with a protocol of Zenoh.
_ADDRESS = re.compile(r"dds(?:[:/]|\Z)|zenoh:|(?:tcp|tls|quic|udp|ws)/")
#: The files of recordings.
SUFFIXES = (".mcap", ".db3")
#: The ending of those that rosbag2 compressed as a whole.
ZSTD = ".zstd"
COMPRESSED = tuple(suffix + ZSTD for suffix in SUFFIXES)
#: The file by which a folder is a bag.
METADATA = "metadata.yaml"
#: Cannot be read, which opening it reports.
_ROS_1 = ".bag"


class VersionWord(NamedTuple):
    """A word for a version of types, and its name without `git:` or `distro:`."""

    meaning: Meaning
    name: str


def read_word(word: str, root: Root, misspelt: Meaning = "path") -> Meaning:
    """Return what a word means where types are named.

    If no file has its name, `a/b` means what `misspelt` says: types begin with a capital.
    """
    if is_address(word) or _is_recording(word, root):
        return "recording"
    is_name = _NAME.fullmatch(word) and Path(word).suffix not in KINDS
    if not is_name or os.path.lexists(root.path(word)):
        return "path"
    _, slash, last = word.rpartition("/")
    return misspelt if slash and last[:1].islower() else "name"


def read_words(
    words: Iterable[str], root: Root, misspelt: Meaning = "path"
) -> Mapping[Meaning, list[str]]:
    """Return words by their meanings, as `read_word` does."""
    meant: defaultdict[Meaning, list[str]] = defaultdict(list)
    for word in words:
        meant[read_word(word, root, misspelt)].append(word)
    return meant


def read_version(word: str, root: Root) -> VersionWord:
    """Return what a word means where a version is named."""
    for prefix, meaning in _VERSIONS.items():
        if word.startswith(prefix):
            return VersionWord(meaning, word.removeprefix(prefix))
    return VersionWord(read_word(word, root), word)


def read_distro(name: str, report: Report) -> Distro:
    """Return the distribution of a name; report IDL630 and raise if there is none."""
    if name in BY_NAME:
        return BY_NAME[name]
    message = f"no such distribution: `{name}`"
    raise report.refused(codes.NO_SUCH_REVISION.of("", message, hint=unknown_distro(name)))


def is_address(word: str) -> bool:
    """Return whether a word means a robot; a path that exists does not.

    Malformed addresses count as well, so that connecting reports them.
    """
    return _ADDRESS.match(word) is not None and not os.path.lexists(word)


def _is_recording(word: str, root: Root) -> bool:
    """Return whether a word means an .mcap or .db3 file, or the folder of a bag.

    A folder is that of a bag if it has a metadata.yaml, or recordings and no interfaces.
    """
    path = Path(root.path(word))
    if not is_folder(path):
        return path.name.endswith((*SUFFIXES, *COMPRESSED, _ROS_1))
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
        (recordings if read_word(word, root) == "recording" else others).append(word)
    return recordings, others


def split_topics(words: Sequence[str], root: Root) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return words without the topics of recordings among them, and these topics.

    Beside a recording, `/odom` is a topic unless there is such a file.
    """
    recordings, others = split_recordings(words, root)
    names = [word for word in others if word.startswith("/")] if recordings else []
    topics = tuple(name for name in names if not os.path.lexists(root.path(name)))
    return tuple(word for word in words if word not in topics), topics


def files(words: Iterable[str], root: Root) -> list[Path]:
    """Return the files of the recordings among words."""
    recordings, _ = split_recordings(words, root)
    paths = [Path(root.path(word)) for word in recordings if not is_address(word)]
    return [file for path in paths for file in (path.iterdir() if is_folder(path) else [path])]


def natural(name: str) -> list[tuple[str, int]]:
    """Return a key that sorts bag_9 before bag_10."""
    return [(text, int(number or 0)) for text, number in re.findall(r"(\D*)(\d*)", name)]


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
