"""The templates of everything that is written, and the files that they make.

Pure but for reading idlc's own templates.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import jinja2
import msgspec

from idlc.diagnostics.visible import printable

_PACKAGE = Path(__file__).parent


class RenderedFile(msgspec.Struct, frozen=True):
    """A file to write: `path` with slashes, relative to the folder that is written."""

    path: str
    text: str


@cache
def environment() -> jinja2.Environment:
    """Return the environment of all templates: strict, without filters of our own."""
    folders = [_PACKAGE / "templates", _PACKAGE.parent / "templates"]
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folders),
        undefined=jinja2.StrictUndefined,
        autoescape=False,  # noqa: S701 (Python source, escaped by emit.literals)
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        auto_reload=False,  # a look at the disk for each file that is written
    )


@cache
def html() -> jinja2.Environment:
    """Return the same for pages: whatever is placed is text, its control characters spelled out."""
    return environment().overlay(autoescape=True, finalize=_text)


def _text(value: object) -> object:
    return value if hasattr(value, "__html__") else printable(str(value))


def verbatim(name: str) -> str:
    """Return a file of the templates' folder that is no template."""
    loader = environment().loader
    assert loader is not None
    return loader.get_source(environment(), name)[0]
