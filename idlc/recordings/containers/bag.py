"""A bag: a folder with the files of one recording, and mostly a metadata.yaml that names them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from idlc.recordings.containers.source import RecordingError

SUFFIXES = (".mcap", ".db3")
#: Files that rosbag2 compressed as a whole.
COMPRESSED = (".mcap.zstd", ".db3.zstd")
METADATA = "metadata.yaml"
#: No recorder writes more, or deeper.
MOST_OF_METADATA = 1 << 23
DEEPEST = 100


def files_of(folder: Path) -> tuple[list[Path], list[str]]:
    """Return the files of a bag in their order, and notes about them."""
    try:
        files = sorted((file for file in folder.iterdir() if file.is_file()), key=_natural)
    except OSError as error:
        raise RecordingError(f"`{folder}` cannot be read: {error.strerror}") from None
    present = {file.name: file for file in files if file.name.endswith(SUFFIXES + COMPRESSED)}
    notes = []
    metadata = folder / METADATA
    if metadata.is_file():
        try:
            paths = _names(metadata)
        except RecordingError as error:
            paths = []
            notes.append(f"{error.message}: all files of the folder are read")
        named = dict.fromkeys(path if path in present else _own_name(path) for path in paths)
        missing = [name for name in named if name not in present]
        others = [name for name in present if name not in named]
        notes += [f"`{name}` is named in {METADATA} and missing" for name in missing]
        if any(name in present for name in named):
            notes += [f"`{name}` is not named in {METADATA} and left out" for name in others]
            present = {name: present[name] for name in named if name in present}
    if not present:
        inside = min((path.parent for path in folder.glob(f"*/{METADATA}")), default=None)
        hint = f"name a bag in it, such as `{inside}`" if inside else "it has no .mcap or .db3 file"
        raise RecordingError(f"`{folder}` holds no recording", hint)
    for name in present:
        if name.endswith(COMPRESSED):
            hint = f"zstd -d {folder / name}"
            raise RecordingError(f"`{name}` is compressed as a whole", hint)
    return list(present.values()), notes


def _names(metadata: Path) -> list[str]:
    """Return the names in `relative_file_paths`; raise RecordingError if they cannot be read."""
    import yaml

    try:
        with metadata.open("rb") as file:
            text = file.read(MOST_OF_METADATA + 1)
    except OSError as error:
        raise RecordingError(f"`{METADATA}` cannot be read: {error.strerror}") from None
    if len(text) > MOST_OF_METADATA:
        raise RecordingError(f"`{METADATA}` is larger than {MOST_OF_METADATA >> 20} MiB")
    # only the nodes of the file are needed: no objects are constructed, and nothing is merged
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        depth = 0
        for event in yaml.parse(text, loader):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > DEEPEST:
                raise RecordingError(f"`{METADATA}` nests more than {DEEPEST} levels deep")
        root = yaml.compose(text, loader)
    except (yaml.YAMLError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        raise RecordingError(f"`{METADATA}{where}` is not YAML") from None
    return [
        str(node.value)
        for information in _values(root, "rosbag2_bagfile_information")
        for paths in _values(information, "relative_file_paths")
        if isinstance(paths, yaml.SequenceNode)
        for node in paths.value
        if isinstance(node, yaml.ScalarNode)
    ]


def _values(node: Any, key: str) -> list[Any]:
    """Return the nodes at a key of a mapping, which may be there twice."""
    pairs = node.value if getattr(node, "id", "") == "mapping" else ()
    return [value for name, value in pairs if name.value == key]


def _own_name(path: str) -> str:
    """Return a file's name in the bag: older versions put the bag's own folder in front."""
    return path.replace("\\", "/").rpartition("/")[2]


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sort bag_9 before bag_10."""
    return [(int(number or 0), text) for text, number in re.findall(r"(\D*)(\d*)", path.name)]
