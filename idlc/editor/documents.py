"""The documents that a client has open, and how it changes them."""

from __future__ import annotations

import os
import re
import tempfile
from codecs import BOM_UTF8
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from urllib.parse import unquote

from idlc.diagnostics.source import Source
from idlc.editor.protocol import uris
from idlc.editor.protocol.parts import Change, DocumentItem, Range
from idlc.editor.protocol.positions import in_lines, lines_of
from idlc.model import ir
from idlc.project.files import cache_folder
from idlc.project.find import KINDS
from idlc.project.lock import digest
from idlc.project.root import Root

#: The language id of interface files.
LANGUAGE = "rosmsg"


class Document:
    """An open document.

    `path` is its file, or where it would be saved; `None` for documents that are no files.
    """

    def __init__(self, item: DocumentItem, root: Root) -> None:
        self.uri = item.uri
        self.path = uris.to_path(item.uri) or _draft(item, root)
        self.version: int | None = item.version
        self._lines = lines_of(item.text)

    @cached_property
    def text(self) -> str:
        """The whole text."""
        return "".join(self._lines)

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

    def change(self, changes: Iterable[Change], encoding: str) -> None:
        """Apply changes in order."""
        for change in changes:
            if change.range is None:
                self._lines = lines_of(change.text)
            else:
                self._replace(change.range, change.text, encoding)
        self.__dict__.pop("text", None)

    def _replace(self, where: Range, new: str, encoding: str) -> None:
        """Replace a range; only the lines around it are split again."""
        lines = self._lines
        first, start = in_lines(lines, where.start, encoding)
        last, end = in_lines(lines, where.end, encoding)
        if (last, end) < (first, start):
            last, end = first, start
        # CR and LF may come together or apart at either end
        low, high = max(first - 1, 0), min(last + 1, len(lines) - 1)
        before = "".join(lines[low:first]) + lines[first][:start]
        after = lines[last][end:] + "".join(lines[last + 1 : high + 1])
        merged = lines_of(before + new + after)
        if high < len(lines) - 1 and not merged[-1]:
            del merged[-1]
        lines[low : high + 1] = merged


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


class Documents:
    """All open documents by URI; drafts without a file count as files in the base of a root."""

    def __init__(self, root: Root) -> None:
        self._root = root
        self._open: dict[str, Document] = {}

    def __iter__(self) -> Iterator[Document]:
        return iter(self._open.values())

    def get(self, uri: str) -> Document | None:
        """Return an open document."""
        return self._open.get(uri)

    def open(self, item: DocumentItem) -> Document:
        """Open a document, again if it is open already."""
        document = self._open[item.uri] = Document(item, self._root)
        return document

    def close(self, uri: str) -> Document | None:
        """Close a document; `None` if it was not open."""
        return self._open.pop(uri, None)

    def at(self, path: Path) -> Document | None:
        """Return the open document of a file; of two URIs for it, the one opened last."""
        return next(
            (document for document in reversed(self._open.values()) if document.path == path), None
        )

    def texts(self) -> dict[Path, bytes]:
        """Return the texts that count instead of the files on disk."""
        return {document.path: document.data for document in self if document.path is not None}


#: Where texts of the catalogue are kept in the cache.
FOLDER = "interfaces"


def inside(source: Source) -> str:
    """Return the name of a text of the catalogue, such as `jazzy/std_msgs/msg/Header.msg`."""
    return source.path.replace("<", "", 1).replace(">", "", 1)


def file_of(source: Source) -> Path | None:
    """Return a file of this user's cache that holds a text of the catalogue; `None` if none can."""
    base = cache_folder()
    if base is None:
        return None
    path = base / FOLDER / inside(source)
    data = source.text.encode()
    try:
        if not path.is_file() or path.read_bytes() != data:
            _write(path, data)
    except OSError:
        return None
    return path


def _write(path: Path, data: bytes) -> None:
    """Replace a file atomically with one that can only be read."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(name).chmod(0o444)
        Path(name).replace(path)
    except OSError:
        with suppress(OSError):
            Path(name).unlink()
        raise


def is_built_in(source: Source) -> bool:
    """Return whether a text is from the catalogue."""
    return source.path.startswith("<")
