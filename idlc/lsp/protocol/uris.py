"""Paths ↔ `file:` URIs, as editors on any system write them."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

from idlc.disk.read import absolute


def to_path(uri: str) -> Path | None:
    """Return the absolute path that a URI means, `None` for one that is no file's."""
    try:
        parts = urlsplit(uri)
        path = unquote(parts.path, errors="strict")
    except ValueError:
        return None
    if parts.scheme != "file" or not path or "\0" in path:
        return None
    if os.name == "nt":
        if parts.netloc:
            return absolute(f"//{unquote(parts.netloc)}{path}")
        drive = path.lstrip("/")[:2]
        if drive[1:] == ":":
            path = drive.upper() + path.lstrip("/")[2:]
    elif parts.netloc not in ("", "localhost"):
        return None
    return absolute(path)


def from_path(path: Path) -> str:
    """Return the URI of an absolute path."""
    text = path.as_posix()
    if text.startswith("//"):
        return "file:" + quote(text)
    return "file://" + quote(text if text.startswith("/") else f"/{text}")
