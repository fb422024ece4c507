"""Files that a test makes in its working folder."""

from collections.abc import Mapping
from pathlib import Path


def write(path: str | Path, text: str = "") -> None:
    """Make a file, and the folders above it."""
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    Path(path).write_text(text, encoding="utf-8")


def write_all(files: Mapping[str, str]) -> None:
    """Make files from texts by path."""
    for path, text in files.items():
        write(path, text)
