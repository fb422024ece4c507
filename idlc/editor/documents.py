"""The documents of a client: their URIs, the positions in their texts, and how it changes them.

The protocol's lines end at LF, CR LF or CR and nowhere else; its characters are bytes of UTF-8,
units of UTF-16 or code points, as client and server agreed. Spans count code points of a text.
"""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from codecs import BOM_UTF8
from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import accumulate, pairwise
from pathlib import Path
from urllib.parse import unquote, urlsplit

from idlc.diagnostics.source import Source
from idlc.editor.parts import ContentChange, DocumentItem, Position, Range
from idlc.language.tree import BYTE_ORDER_MARK
from idlc.model import ir
from idlc.project.atomic import write_whole
from idlc.project.files import cache_folder
from idlc.project.find import KINDS
from idlc.project.root import Root
from idlc.project.step import digest

# `file:` URIs, as editors on any system write them.


def to_path(uri: str) -> Path | None:
    """Return the absolute path that a URI means, `None` for one that is not of a file."""
    text = path_text(uri, on_windows=os.name == "nt")
    # on Windows, a URI may lack the drive
    return Path(os.path.abspath(text)) if text else None  # noqa: PTH100 - keeps links


def path_text(uri: str, *, on_windows: bool) -> str:
    """Return the path that a URI means, as the system writes it; empty for none."""
    try:
        parts = urlsplit(uri)
    except ValueError:
        return ""
    path = unquote(parts.path, errors="surrogateescape")
    host = "" if parts.netloc == "localhost" else unquote(parts.netloc)
    if parts.scheme != "file" or not path or "\0" in path + host:
        return ""
    if not on_windows:
        return "" if host else path
    if host:
        return f"//{host}{path}"
    if drive := re.match(r"/+([A-Za-z]:)(?=/|$)", path):
        return f"{drive[1].upper()}{path[drive.end() :] or '/'}"
    return path


# Positions in a text, as the protocol counts them and as Python does.

TOP = Range(Position(0, 0), Position(0, 0))
_END = re.compile(r"\r\n|\r|\n")


def lines_of(text: str) -> list[str]:
    """Return the lines with their ends; the last has none and may be empty."""
    ends = [0, *(match.end() for match in _END.finditer(text)), len(text)]
    return [text[start:end] for start, end in pairwise(ends)]


def units(text: str, encoding: str) -> int:
    """Return the length of a text in an encoding."""
    if encoding == "utf-32" or text.isascii():
        return len(text)
    if encoding == "utf-8":
        return len(text.encode("utf-8", "surrogatepass"))
    return len(text) + sum(character > "\uffff" for character in text)


def characters(line: str, count: int, encoding: str) -> int:
    """Return the number of characters in the first `count` units of a line, without its end.

    A position within a character means its start.
    """
    content = line.rstrip("\r\n")
    if encoding == "utf-32" or content.isascii():
        return min(count, len(content))
    passed = 0
    for at, character in enumerate(content):
        passed += units(character, encoding)
        if passed > count:
            return at
    return len(content)


def in_lines(lines: Sequence[str], position: Position, encoding: str) -> tuple[int, int]:
    """Return the line and the character of a position; the last if it is beyond."""
    if position.line >= len(lines):
        return len(lines) - 1, len(lines[-1])
    return position.line, characters(lines[position.line], position.character, encoding)


class Places:
    """The places of one text in one encoding.

    With `skips_mark`, the positions do not count a byte order mark, as editors do not that drop it
    when they read a file.
    """

    def __init__(self, text: str, encoding: str, *, skips_mark: bool = False) -> None:
        self._encoding = encoding
        self._skipped = int(skips_mark and text.startswith(BYTE_ORDER_MARK))
        self._lines = lines_of(text[self._skipped :])
        self._starts = [*accumulate(map(len, self._lines[:-1]), initial=0)]

    def position(self, offset: int) -> Position:
        """Return the position of a character; within a line's end, that end."""
        offset = max(offset - self._skipped, 0)
        line = max(bisect_right(self._starts, offset) - 1, 0)
        before = self._lines[line][: offset - self._starts[line]].rstrip("\r\n")
        return Position(line, units(before, self._encoding))

    def offset(self, position: Position) -> int:
        """Return the character at a position."""
        line, at = in_lines(self._lines, position, self._encoding)
        return self._skipped + self._starts[line] + at

    def range(self, start: int, end: int) -> Range:
        """Return the range of some characters."""
        return Range(self.position(start), self.position(end))


#: Has the places of the last texts.
places = lru_cache(maxsize=256)(Places)


#: The language id of interface files.
LANGUAGE = "rosmsg"


class Document:
    """An open document.

    `path` is its file, or where it would be saved, below `root`; `None` for documents that are no
    files.
    """

    def __init__(self, item: DocumentItem, root: Root) -> None:
        self.uri = item.uri
        self.path = to_path(item.uri) or _draft(item, root)
        self.version: int | None = item.version
        self.text = item.text

    @property
    def data(self) -> bytes:
        """The content of a file with this text; lone surrogates become `?`."""
        return self.text.encode("utf-8", errors="replace")

    def is_on_disk(self) -> bool:
        """Return whether its file holds this text, with any line ends and byte order mark."""
        try:
            data = self.path.read_bytes() if self.path else b""
        except OSError:
            return False
        return self.path is None or digest(data.removeprefix(BOM_UTF8)) == digest(self.data)

    def change(self, changes: Iterable[ContentChange], encoding: str) -> None:
        """Apply changes in order."""
        for change in changes:
            start, end = 0, len(self.text)
            if change.range is not None:
                current = places(self.text, encoding)
                start, end = current.offset(change.range.start), current.offset(change.range.end)
            self.text = self.text[:start] + change.text + self.text[max(start, end) :]


def _draft(item: DocumentItem, root: Root) -> Path | None:
    """Return the path at which an interface that was never saved would be.

    The number of its sections decides its kind if its name does not.
    """
    scheme, _, name = item.uri.partition(":")
    if scheme != "untitled" or item.language_id != LANGUAGE:
        return None
    if Path(name).suffix in KINDS:
        return root.absolute(unquote(name))
    marks = sum(line.rstrip() == "---" for line in item.text.splitlines())
    kind = ir.KINDS[min(marks, len(ir.KINDS) - 1)]
    stem = re.sub(r"[^A-Za-z0-9]", "", name.rpartition("/")[2])
    return root.absolute(f"{stem[:1].upper()}{stem[1:]}.{kind}" if stem else f"Untitled.{kind}")


# Texts of the catalogue.

#: Where they are kept in the cache.
FOLDER = "interfaces"


def is_built_in(source: Source) -> bool:
    """Return whether a text is from the catalogue."""
    return source.path.startswith("<")


def inside(source: Source) -> str:
    """Return the name of a text of the catalogue, such as `jazzy/std_msgs/msg/Header.msg`."""
    return source.path.replace("<", "", 1).replace(">", "", 1)


def file_of(source: Source) -> Path | None:
    """Return a file of this user's cache that holds a text of the catalogue; `None` if none can."""
    base = cache_folder()
    if base is None:
        return None
    path = base / FOLDER / inside(source)
    try:
        write_whole(path, source.text.encode(), 0o444)  # nobody is to edit it
    except OSError:
        return None
    return path
