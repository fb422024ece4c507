"""Paths ↔ `file:` URIs, as editors on any system write them."""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePath
from urllib.parse import quote, unquote, urlsplit

#: Names that are no text are kept as Python keeps them.
_ERRORS = "surrogateescape"


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
    path = unquote(parts.path, errors=_ERRORS)
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


def from_path(path: PurePath) -> str:
    """Return the URI of an absolute path."""
    text = path.as_posix()
    if text.startswith("//"):
        return "file:" + quote(text, errors=_ERRORS)
    if path.drive:
        return f"file:///{path.drive}{quote(text.removeprefix(path.drive), errors=_ERRORS)}"
    return "file://" + quote(text, errors=_ERRORS)
