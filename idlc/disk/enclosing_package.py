"""Which package files belong to: the nearest package.xml, and the name in it."""

from __future__ import annotations

import contextlib
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.disk.read import is_file, is_folder, read_bytes

if TYPE_CHECKING:
    from idlc.diagnostics.report import Diagnostic

MANIFEST = "package.xml"


@lru_cache(maxsize=1024)
def manifest(folder: Path) -> Path | None:
    """Return the nearest package.xml at or above an absolute folder, within its repository."""
    for here in (folder, *folder.parents):
        path = here / MANIFEST
        if is_file(path):
            return path
        if _is_repository(here):
            break
    return None


def _is_repository(folder: Path) -> bool:
    """Whether a folder is the top of a git repository, of a submodule or a worktree too."""
    return is_folder(folder / ".git") or is_file(folder / ".git")


def declared_name(path: Path, name: str, report: Report) -> str | None:
    """Return the package name in a package.xml; report IDL610 and return `None` without one."""
    data = read_bytes(path, name, report)
    if data is None:
        return None
    try:
        declared = _text_of(data, "name")
    except (expat.ExpatError, ValueError, LookupError) as error:  # an unknown encoding
        report.add(_broken(data, name, error))
        return None
    if not declared:
        report.add(
            codes.BAD_PACKAGE_XML.of(
                name,
                "no package name in this file",
                hint="add `<name>my_package</name>` within `<package>`, or give --package NAME",
            )
        )
        return None
    return declared


def declared_version(path: Path) -> str:
    """Return the version in a package.xml; empty if it has none or cannot be read."""
    data = read_bytes(path, path.as_posix(), Report())
    with contextlib.suppress(expat.ExpatError, ValueError, LookupError):
        return _text_of(data or b"", "version")
    return ""


def _text_of(data: bytes, tag: str) -> str:
    """Return the text of an element right below the root of a package.xml."""
    found: list[str] = []
    stack: list[str] = []
    parser = expat.ParserCreate()
    parser.buffer_text = True

    def start(name: str, _: dict[str, str]) -> None:
        stack.append(name)

    def end(_: str) -> None:
        stack.pop()

    def text(content: str) -> None:
        if stack == ["package", tag]:
            found.append(content)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.Parse(data, True)
    return "".join(found).strip()


def _broken(
    data: bytes, name: str, error: expat.ExpatError | ValueError | LookupError
) -> Diagnostic:
    message = f"not well-formed XML: {str(error).partition(':')[0]}"
    hint = "fix the file, or give --package NAME"
    if not isinstance(error, expat.ExpatError):
        return codes.BAD_PACKAGE_XML.of(name, message, hint=hint)
    source = Source(name, data.decode("utf-8", errors="replace"))
    line = min(error.lineno, len(source.line_starts))
    start = min(source.line_starts[line - 1] + error.offset, len(source.text))
    return codes.BAD_PACKAGE_XML.at(Span(source, start, start + 1), message, hint=hint)
