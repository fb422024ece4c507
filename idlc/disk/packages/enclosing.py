"""Which package files belong to: the nearest package.xml, and what it says."""

from __future__ import annotations

import contextlib
import os
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from idlc.checks.package import package_xml
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.disk.read import NOTHING_OPEN, Unsaved, is_file, read_bytes, read_source

if TYPE_CHECKING:
    from idlc.checks.package.facts import Statement
    from idlc.diagnostics.report import Diagnostic

MANIFEST = "package.xml"


@lru_cache(maxsize=1024)
def manifest(folder: Path) -> Path | None:
    """Return the nearest package.xml at or above an absolute folder, within its repository."""
    for here in map(str, (folder, *folder.parents)):
        path = os.path.join(here, MANIFEST)  # noqa: PTH118 - a Path costs more than the look
        if is_file(path):
            return Path(path)
        if os.path.exists(os.path.join(here, ".git")):  # noqa: PTH110, PTH118 - or a worktree's file
            break
    return None


def declared_name(
    path: Path, name: str, report: Report, unsaved: Unsaved = NOTHING_OPEN
) -> str | None:
    """Return the package name in a package.xml; report IDL610 and return `None` without one."""
    data = unsaved.read_bytes(path, name, report)
    if data is None:
        return None
    try:
        declared = next(iter(package_xml.read(data).texts("name")), "")
    except package_xml.NotXmlError as error:
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
    return _version(read_bytes(path, path.as_posix(), Report()) or b"")


@lru_cache(maxsize=64)
def _version(data: bytes) -> str:
    with contextlib.suppress(package_xml.NotXmlError):
        return next(iter(package_xml.read(data).texts("version")), "")
    return ""


def _broken(data: bytes, name: str, error: package_xml.NotXmlError) -> Diagnostic:
    message = f"not well-formed XML: {error}"
    hint = "fix the file, or give --package NAME"
    if not error.line:
        return codes.BAD_PACKAGE_XML.of(name, message, hint=hint)
    source = Source(name, data.decode("utf-8", errors="replace"))
    line = min(error.line, len(source.line_starts))
    start = min(source.line_starts[line - 1] + error.column, len(source.text))
    return codes.BAD_PACKAGE_XML.at(Span(source, start, start + 1), message, hint=hint)


def statements(path: Path, name: str, report: Report) -> tuple[Statement, ...]:
    """Return what a package.xml says, in order; empty for a file that cannot be read as XML."""
    source = read_source(path, name, report)
    return () if source is None else package_xml.statements(source)
