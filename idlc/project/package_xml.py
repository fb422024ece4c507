"""Reading package.xml, and adding dependencies to it, which keeps every other byte."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple
from xml.parsers import expat

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Report, apply
from idlc.diagnostics.source import Source, Span
from idlc.project.edits import Edited, Outcome, Refused
from idlc.project.files import read_bytes
from idlc.project.lock import Runtime
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


class GeneratedOutput(msgspec.Struct, frozen=True):
    """Code that idlc generated within the package: its lock, and the inputs recorded in it."""

    path: str
    package: str
    inputs: Mapping[str, str]
    runtime: Runtime = "carried"


class Facts(msgspec.Struct, frozen=True):
    """A package with a package.xml.

    `modules` are its Python files by dotted name, tests excluded. `inputs` are the digests of its
    interface files by name within the package, empty without `outputs`; `whole` is whether the
    package has no others. `generates` is whether its CMakeLists.txt generates interfaces that are
    installed, `native` whether it has C or C++ sources, `marker` whether resource/NAME exists.
    `available` are the names of ROS packages that can be found.
    `files` are the paths of interface files in the package's folder by name within the package.
    `interfaces` are the paths of all, checked or not, .idl files included.
    `folders` are those with files by dotted name, and whether they are Python packages.
    """

    name: str
    manifest: Source
    statements: tuple[Statement, ...]
    inputs: Mapping[str, str]
    modules: Mapping[str, Source]
    setup_py: Source | None = None
    setup_cfg: Source | None = None
    pyproject: Source | None = None
    cmake: Source | None = None
    generates: bool = False
    native: bool = False
    marker: bool = False
    whole: bool = False
    outputs: tuple[GeneratedOutput, ...] = ()
    available: frozenset[str] = frozenset()
    files: Mapping[str, str] = {}
    interfaces: frozenset[str] = frozenset()
    folders: Mapping[str, bool] = {}

    @property
    def runtime(self) -> Runtime:
        """Return the runtime mode of the generated classes."""
        modes = [output.runtime for output in self.outputs if output.package == self.name]
        return modes[0] if modes else "carried"

    def declared(self, *tags: str) -> dict[str, Statement]:
        """Return the statements with one of these tags by their text, the first of each."""
        by_text: dict[str, Statement] = {}
        for statement in self.statements:
            if statement.tag in tags:
                by_text.setdefault(statement.text, statement)
        return by_text

    @property
    def build_type(self) -> str:
        """The build type; CMake unless package.xml has another."""
        return next(iter(self.declared("build_type")), "ament_cmake")

    @property
    def place(self) -> Span:
        """The span for problems with the whole package.xml: its name."""
        named = self.declared("name")
        return next(iter(named.values())).span if named else Span(self.manifest, 0, 0)


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


#: The errors of a text that is no XML, or in an unknown encoding.
_NOT_XML = (expat.ExpatError, ValueError, LookupError)


class Element(NamedTuple):
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
    elements: tuple[Element, ...]

    def texts(self, *tags: str) -> list[str]:
        """Return the texts of the elements directly within `<package>` with one of these tags."""
        children = (element for element in self.elements if element.parents == ("package",))
        return [element.text for element in children if element.tag in tags]


def read(data: bytes, encoding: str | None = None) -> Manifest:
    """Parse the bytes of a package.xml; raises one of `_NOT_XML`.

    `encoding` overrides the file's own declaration.
    """
    format_ = ""
    elements: list[Element] = []
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
                elements.append(Element(parents, tag, text, first, last, attributes))

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
    except _NOT_XML:
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
    except _NOT_XML as error:
        report.add(_broken(data, name, error))
        return None
    if not declared:
        message = "no package name in this file"
        hint = "add `<name>my_package</name>` to `<package>`, or pass --package NAME"
        report.add(codes.BAD_PACKAGE_XML.of(name, message, hint=hint))
    return declared or None


def declared_version(path: Path) -> str:
    """Return the version in a package.xml; empty if it has none or cannot be read."""
    return _version(read_bytes(path, path.as_posix(), Report()) or b"")


@lru_cache(maxsize=64)
def _version(data: bytes) -> str:
    with contextlib.suppress(*_NOT_XML):
        return next(iter(read(data).texts("version")), "")
    return ""


def _broken(data: bytes, name: str, error: Exception) -> Diagnostic:
    message = f"not well-formed XML: {str(error).partition(':')[0]}"
    hint = "fix the file, or pass --package NAME"
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


_BLANK_LINE = re.compile(r"[^\S\n]*\n[^\S\n]*\n")
#: Tags that make a package available when a node runs.
AT_RUN_TIME = frozenset({"depend", "exec_depend", "run_depend"})
AT_TEST_TIME = AT_RUN_TIME | {"test_depend"}
GROUP = "rosidl_interface_packages"


def add_dependencies(
    text: str,
    *,
    depends: Sequence[str] = (),
    executes: Sequence[str] = (),
    tests: Sequence[str] = (),
    group: bool = False,
) -> Outcome:
    """Return the file with the dependencies that it lacks.

    `depends` are needed to build and run, `executes` to run, `tests` for testing; `group` declares
    that the package has interfaces.
    """
    try:
        manifest = read(text.encode("utf-8"), "utf-8")
    except _NOT_XML:
        manifest = Manifest("", ())
    own = set(manifest.texts("name"))
    if not own:
        lines = " ".join(f"<depend>{name}</depend>" for name in depends)
        why = "it has no `<name>`"
        if not manifest.elements:
            why = "this is not a well-formed package.xml"
        return Refused(why, lines, "within `<package>`")
    running = own.union(manifest.texts(*AT_RUN_TIME))
    testing = own.union(manifest.texts(*AT_TEST_TIME))
    old = ("run_depend", "run_depend")
    depend, execute = old if manifest.format == "1" else ("depend", "exec_depend")
    new = [(depend, name) for name in depends if name not in running]
    new += [(execute, name) for name in executes if name not in {*running, *depends}]
    testing.update(name for _, name in new)
    new += [("test_depend", name) for name in tests if name not in testing]
    if group and manifest.format not in ("1", "2"):
        present = manifest.texts("member_of_group")
        new += [("member_of_group", GROUP)] if GROUP not in present else []
    for kind, name in new:
        source = Source("package.xml", text)
        text = apply(text, addition(source, statements(source), kind, name))[0]
    return Edited(text)


def addition(
    manifest: Source, statements: Iterable[Statement], tag: str, name: str
) -> tuple[Edit, ...]:
    """Return the edits that add an element, on a line of its own after its like.

    An edit before it separates it from the head where blank lines separate groups of elements.
    """
    from html import escape  # with its thousands of names, of which few runs need three

    text = manifest.text
    ranked = [statement for statement in statements if RANK.get(statement.tag, 99) <= RANK[tag]]
    same = [statement for statement in ranked if statement.tag == tag]
    if not ranked:
        return ()
    after = max(same or ranked, key=lambda statement: statement.end)
    margin = text[text.rfind("\n", 0, after.span.start) + 1 : after.span.start]
    margin = "  " if margin.strip() else margin
    ending = "\r\n" if "\r\n" in text else "\n"
    # a comment on the line belongs to the element before it
    line = text[after.end :].partition("\n")[0].removesuffix("\r")
    is_comment = re.fullmatch(r"<!--[^<]*-->", line.strip()) is not None
    at = after.end + len(line) if is_comment or not line.strip() else after.end
    place = Span(manifest, at, at)
    element = Edit(place, f"{ending}{margin}<{tag}>{escape(name, quote=False)}</{tag}>")
    is_end = not same and after.tag not in DEPENDENCIES and _BLANK_LINE.match(text, at)
    return (Edit(place, ending), element) if is_end else (element,)
