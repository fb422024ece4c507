"""A bag: a folder with the files of one recording, and mostly a metadata.yaml that names them."""

from __future__ import annotations

import re
from pathlib import Path

from idlc.recordings.errors import RecordingError

SUFFIXES = (".mcap", ".db3")
#: Files that rosbag2 compressed as a whole.
COMPRESSED = (".mcap.zstd", ".db3.zstd")
METADATA = "metadata.yaml"
#: No recorder writes more.
MOST_OF_METADATA = 1 << 26


def files_of(folder: Path) -> tuple[list[Path], list[str]]:
    """Return the files of a bag in their order, and what there is to say of them."""
    try:
        found = sorted((one for one in folder.iterdir() if one.is_file()), key=_natural)
    except OSError as error:
        raise RecordingError(f"`{folder}` cannot be read: {error.strerror}") from None
    present = {one.name: one for one in found if one.name.endswith(SUFFIXES + COMPRESSED)}
    notes = []
    metadata = folder / METADATA
    if metadata.is_file():
        named = dict.fromkeys(_names(metadata))
        missing = [name for name in named if name not in present]
        others = [name for name in present if name not in named]
        notes += [f"`{name}` is named in {METADATA} and missing" for name in missing]
        if any(name in present for name in named):
            notes += [f"`{name}` is not named in {METADATA} and left out" for name in others]
            present = {name: present[name] for name in named if name in present}
    if not present:
        inside = sorted(one.parent for one in folder.glob(f"*/{METADATA}"))
        hint = (
            f"name a bag in it, such as `{inside[0]}`" if inside else "it has no .mcap or .db3 file"
        )
        raise RecordingError(f"`{folder}` holds no recording", hint)
    for name in present:
        if name.endswith(COMPRESSED):
            hint = f"zstd -d {folder / name}"
            raise RecordingError(f"`{name}` is compressed as a whole", hint)
    return list(present.values()), notes


def _names(metadata: Path) -> list[str]:
    """Return the names of files in `relative_file_paths`, without the folders in front of them.

    This is all that is needed of the file, and one list of texts needs no YAML library. Older
    versions put the bag's own folder in front.
    """
    try:
        with metadata.open("rb") as file:
            text = str(file.read(MOST_OF_METADATA), "utf-8", "replace")
    except OSError as error:
        raise RecordingError(f"`{metadata}` cannot be read: {error.strerror}") from None
    names, inside = [], False
    for line in text.splitlines():
        stripped = line.strip()
        if stripped.startswith("relative_file_paths:"):
            inside = True
            _, _, rest = stripped.partition(":")
            names += [_plain(one) for one in rest.strip(" []").split(",") if one.strip()]
        elif inside and (stripped == "-" or stripped.startswith("- ")):
            names.append(_plain(stripped[1:]))
        elif stripped and not stripped.startswith("#"):
            inside = False
    return [name for name in names if name]


def _plain(text: str) -> str:
    text = text.strip()
    if len(text) > 1 and text[0] == text[-1] and text[0] in "'\"":
        text = text[1:-1]
    return text.replace("\\", "/").rpartition("/")[2]


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sort bag_9 before bag_10."""
    return [(int(number or 0), text) for text, number in re.findall(r"(\D*)(\d*)", path.name)]
