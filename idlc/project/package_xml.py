"""Reading package.xml, and adding dependencies to it, which keeps every other byte."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple
from xml.parsers import expat

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import worded
from idlc.project.files import read_bytes
from idlc.project.root import Root


class Statement(msgspec.Struct, frozen=True):
    """An element directly below <package>, or below its <export>.

    `span` is its start tag, `end` the offset at which the element ends.
    """

    tag: str
    text: str
    span: Span
    end: int
    attributes: Mapping[str, str] = {}


#: The elements whose children matter.
_PARENTS = (("package",), ("package", "export"))
_DEPTHS = tuple(len(parents) + 1 for parents in _PARENTS)


#: The errors of a text that is no XML, or in an unknown encoding.
NOT_XML = (expat.ExpatError, ValueError, LookupError)


class XmlElement(NamedTuple):
    """An element with its parents and all text in it; `start` and `end` are offsets of bytes."""

    parents: tuple[str, ...]
    tag: str
    text: str
    start: int
    end: int
    attributes: Mapping[str, str]


class Manifest(NamedTuple):
    """The elements of a package.xml in order, including its `<export>`."""

    format: str
    elements: tuple[XmlElement, ...]

    def texts(self, *tags: str) -> list[str]:
        """Return the texts of the elements directly within `<package>` with one of these tags."""
        children = (element for element in self.elements if element.parents == ("package",))
        return [element.text for element in children if element.tag in tags]


def read(data: bytes, encoding: str | None = None) -> Manifest:
    """Parse the bytes of a package.xml; raises one of `NOT_XML`.

    `encoding` overrides the file's own declaration.
    """
    format_ = ""
    elements: list[XmlElement] = []
    tags: list[str] = []  # of the open elements
    # start, attributes and texts of those among them that are at one of the depths to collect
    begun: list[tuple[int, dict[str, str], list[str]]] = []
    parser = expat.ParserCreate(encoding)
    parser.buffer_text = True

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal format_
        if not tags and tag == "package":
            format_ = attributes.get("format", "1")
        tags.append(tag)
        if len(tags) in _DEPTHS:
            begun.append((parser.CurrentByteIndex, attributes, []))

    def end(tag: str) -> None:
        depth = len(tags)
        tags.pop()
        if depth in _DEPTHS:
            first, attributes, texts = begun.pop()
            if (parents := tuple(tags)) in _PARENTS:
                last = data.find(b">", parser.CurrentByteIndex) + 1
                text = "".join(texts).strip()
                elements.append(XmlElement(parents, tag, text, first, last, attributes))

    def add(text: str) -> None:
        for _, _, texts in begun:
            texts.append(text)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = add
    parser.Parse(data, True)
    return Manifest(format_, tuple(sorted(elements, key=lambda element: element.start)))


def statements(source: Source) -> tuple[Statement, ...]:
    """Return the statements of a package.xml, in order; empty if it is not XML."""
    data = source.text.encode("utf-8")
    try:
        elements = read(data, "utf-8").elements
    except NOT_XML:
        return ()
    offsets = sorted({at for element in elements for at in (element.start, element.end)})
    characters = {0: 0}
    for before, at in zip([0, *offsets], offsets, strict=False):
        characters[at] = characters[before] + len(data[before:at].decode("utf-8"))
    placed = []
    for _, tag, text, first, end, attributes in elements:
        start = characters[first]
        span = Span(source, start, start + len(tag) + 2)
        placed.append(Statement(tag, text, span, characters[end], attributes))
    return tuple(placed)


def declared_name(path: Path, root: Root, report: Report) -> str | None:
    """Return the package name in a package.xml; report IDL610 and return `None` without one."""
    name = root.shown(path)
    data = root.read_bytes(path, name, report)
    if data is None:
        return None
    try:
        declared = next(iter(read(data).texts("name")), "")
    except NOT_XML as error:
        report.add(_broken(data, name, error))
        return None
    if not declared:
        message = "no package name in this file"
        hint = "add `<name>my_package</name>` to `<package>`" + worded(_OTHERWISE, "")
        report.add(codes.BAD_PACKAGE_XML.of(name, message, hint=hint))
    return declared or None


_OTHERWISE = ", or pass --package NAME"


def declared_version(path: Path) -> str:
    """Return the version in a package.xml; empty if it has none or cannot be read."""
    return _version(read_bytes(path, path.as_posix(), Report()) or b"")


@lru_cache(maxsize=64)
def _version(data: bytes) -> str:
    with contextlib.suppress(*NOT_XML):
        return next(iter(read(data).texts("version")), "")
    return ""


def _broken(data: bytes, name: str, error: Exception) -> Diagnostic:
    message = f"not well-formed XML: {str(error).partition(':')[0]}"
    hint = "fix the file" + worded(_OTHERWISE, "")
    if not (isinstance(error, expat.ExpatError) and error.lineno):
        return codes.BAD_PACKAGE_XML.of(name, message, hint=hint)
    source = Source(name, data.decode("utf-8", errors="replace"))
    line = min(error.lineno, len(source.line_starts))
    start = min(source.line_starts[line - 1] + error.offset, len(source.text))
    return codes.BAD_PACKAGE_XML.at(Span(source, start, start + 1), message, hint=hint)


def read_statements(path: Path, name: str, root: Root, report: Report) -> tuple[Statement, ...]:
    """Read the statements of a package.xml, in order; empty if it cannot be read as XML."""
    source = root.read_source(path, name, report)
    return () if source is None else statements(source)
