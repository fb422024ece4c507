"""The environments of templates, what these may place, and rendered files."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path

import jinja2
import msgspec

from idlc.diagnostics.text import printable
from idlc.project.files import cache_folder

_PACKAGE = Path(__file__).parents[1]


class RenderedFile(msgspec.Struct, frozen=True):
    """A file to write: `path` with slashes, relative to the folder that is written."""

    path: str
    text: str


class Code(str):
    """Source that idlc wrote: a name, an expression, a statement."""

    __slots__ = ()


class EscapedText(str):
    """Words of others, escaped for the place where a template puts them."""

    __slots__ = ()


@cache
def environment() -> jinja2.Environment:
    """Return what the environments of all templates have in common; it renders none itself."""
    folders = [_PACKAGE / "templates", _PACKAGE.parent / "templates"]
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folders),
        undefined=jinja2.StrictUndefined,
        autoescape=False,  # noqa: S701 (of source; `code` places nothing unescaped)
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        auto_reload=False,  # a look at the disk for each file that is written
    )


@cache
def code() -> jinja2.Environment:
    """Return the environment of source files, which places nothing but Code and Text.

    `join` and `indent`, macros and `set` blocks keep the type. Whatever else templates do with a
    string gives an ordinary one, which cannot be placed.
    """
    source = environment().overlay(finalize=_placed, bytecode_cache=_compiled("code"))
    source.concat = _concatenated  # type: ignore[method-assign]
    source.filters = {**source.filters, "indent": _indented, "join": _joined}
    return source


def _placed(value: object) -> object:
    if isinstance(value, (Code, EscapedText, int, jinja2.Undefined)):
        return value
    raise TypeError(
        f"a template may place Code and EscapedText, not {type(value).__name__} {value!r:.80}"
    )


def _concatenated(parts: Iterable[str]) -> Code:
    return Code("".join(parts))


def _joined(values: Iterable[object], separator: str = "") -> Code:
    return Code(separator.join([str(_placed(value)) for value in values]))


def _indented(value: object, width: int = 4) -> Code:
    first, *rest = str(_placed(value)).split("\n")
    margin = " " * width
    return Code("\n".join([first, *(margin + line if line else line for line in rest)]))


@cache
def html() -> jinja2.Environment:
    """Return the environment of pages: values are escaped, control characters spelled out."""
    cache = _compiled("html")
    return environment().overlay(autoescape=True, finalize=_text, bytecode_cache=cache)


def _text(value: object) -> object:
    return value if hasattr(value, "__html__") else printable(str(value))


def verbatim(name: str) -> str:
    """Return the content of a file in the templates' folder that is no template."""
    loader = environment().loader
    assert loader is not None
    return loader.get_source(environment(), name)[0]


def _compiled(environment: str) -> jinja2.BytecodeCache | None:
    """Return the cache of compiled templates: compiling them takes a fifth of `idlc gen`."""
    place = cache_folder()
    return _Compiled(place, environment) if place else None


class _Compiled(jinja2.FileSystemBytecodeCache):
    """Compiled templates; each file holds the digest of its template and Python's version."""

    def __init__(self, place: Path, environment: str) -> None:
        pattern = f"template-{jinja2.__version__}-{sys.implementation.cache_tag}-{environment}-%s"
        super().__init__(str(place), pattern)

    def load_bytecode(self, bucket: jinja2.bccache.Bucket) -> None:
        try:
            super().load_bytecode(bucket)
        except Exception:  # pickle and marshal raise any for a damaged file
            bucket.reset()

    def dump_bytecode(self, bucket: jinja2.bccache.Bucket) -> None:
        if not sys.dont_write_bytecode:
            with suppress(OSError):  # a full disk
                super().dump_bytecode(bucket)
