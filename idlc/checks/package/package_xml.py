"""What a package.xml says, and where: every element with its place in the file, in bytes.

The positions are expat's, so that a file can be edited without being written anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple
from xml.parsers import expat

from idlc.checks.package.facts import Statement
from idlc.diagnostics.source import Source, Span

#: The elements whose children matter.
_PARENTS = (("package",), ("package", "export"))
_DEPTHS = tuple(len(parents) + 1 for parents in _PARENTS)


#: The elements of a package.xml in the order of the schema: dependencies come after the head.
HEAD = ("name", "version", "description", "maintainer", "license", "url", "author")
DEPENDENCIES = (
    *("build_depend", "build_export_depend", "buildtool_depend", "buildtool_export_depend"),
    *("exec_depend", "run_depend", "depend", "doc_depend", "test_depend"),
    *("conflict", "replace", "group_depend", "member_of_group"),
)
RANK = {tag: at for at, tag in enumerate((*HEAD, *DEPENDENCIES))}


class NotXmlError(ValueError):
    """The text is not XML; `line`, from 1, and `column`, from 0, are known unless `line` is 0."""

    def __init__(self, message: str, line: int = 0, column: int = 0) -> None:
        super().__init__(message)
        self.line = line
        self.column = column


class Element(NamedTuple):
    """An element with its parents and all text in it; `start` and `end` are offsets of bytes."""

    parents: tuple[str, ...]
    tag: str
    text: str
    start: int
    end: int
    attributes: Mapping[str, str]


class Manifest(NamedTuple):
    """The elements of a package.xml in order, those of its `<export>` included."""

    format: str
    elements: tuple[Element, ...]

    @property
    def children(self) -> tuple[Element, ...]:
        """The elements directly within `<package>`."""
        return tuple(element for element in self.elements if element.parents == ("package",))

    def texts(self, *tags: str) -> list[str]:
        """Return the texts of the children with one of these tags."""
        return [element.text for element in self.children if element.tag in tags]


def read(data: bytes, encoding: str | None = None) -> Manifest:
    """Return what the bytes of a file say; raises NotXmlError.

    `encoding` is for bytes that are not as the file's own declaration says.
    """
    reader = _Reader(data, encoding)
    try:
        reader.parser.Parse(data, True)
    except expat.ExpatError as error:
        raise NotXmlError(str(error).partition(":")[0], error.lineno, error.offset) from error
    except (ValueError, LookupError) as error:  # an unknown encoding
        raise NotXmlError(str(error).partition(":")[0]) from error
    return Manifest(reader.format, tuple(sorted(reader.found, key=lambda one: one.start)))


class _Reader:
    """Collects elements while expat reads.

    `open` are the tags of the open elements, `begun` start, attributes and texts of those that may.
    """

    def __init__(self, data: bytes, encoding: str | None) -> None:
        self.data = data
        self.format = ""
        self.found: list[Element] = []
        self.open: list[str] = []
        self.begun: list[tuple[int, dict[str, str], list[str]]] = []
        self.parser = expat.ParserCreate(encoding)
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if not self.open and tag == "package":
            self.format = attributes.get("format", "1")
        self.open.append(tag)
        if len(self.open) in _DEPTHS:
            self.begun.append((self.parser.CurrentByteIndex, attributes, []))

    def _end(self, tag: str) -> None:
        depth = len(self.open)
        self.open.pop()
        if depth in _DEPTHS:
            start, attributes, texts = self.begun.pop()
            if (parents := tuple(self.open)) in _PARENTS:
                end = self.data.find(b">", self.parser.CurrentByteIndex) + 1
                text = "".join(texts).strip()
                self.found.append(Element(parents, tag, text, start, end, attributes))

    def _text(self, text: str) -> None:
        for _, _, texts in self.begun:
            texts.append(text)


def statements(source: Source) -> tuple[Statement, ...]:
    """Return what the text of a package.xml says, in order; empty if it is not XML."""
    data = source.text.encode("utf-8")
    try:
        manifest = read(data, "utf-8")
    except NotXmlError:
        return ()
    return tuple(_placed(manifest.elements, source, data))


def _placed(elements: Iterable[Element], source: Source, data: bytes) -> Iterator[Statement]:
    at = characters = 0
    for element in elements:
        characters += len(data[at : element.start].decode("utf-8"))
        at = element.start
        span = Span(source, characters, characters + len(element.tag) + 2)
        yield Statement(element.tag, element.text, span, element.attributes)
