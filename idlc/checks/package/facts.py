"""What surrounds the interfaces of a package, read and ready for rules."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from idlc.diagnostics.source import Source, Span


class Statement(msgspec.Struct, frozen=True):
    """An element directly below <package>, or below its <export>; `span` is its start tag."""

    tag: str
    text: str
    span: Span
    attributes: Mapping[str, str] = {}


class Output(msgspec.Struct, frozen=True):
    """Code that idlc generated within the package: its lock, and the inputs recorded in it."""

    path: str
    package: str
    inputs: Mapping[str, str]


class Facts(msgspec.Struct, frozen=True):
    """A package with a package.xml.

    `modules` are its Python files by dotted name, tests excluded. `inputs` are the digests of its
    interface files by name within the package, empty without `outputs`; `whole` is whether these
    files are all that it has. `generates` is whether its CMakeLists.txt
    generates interfaces that are installed, `native` whether it has C or C++ sources, `marker`
    whether resource/NAME exists. `known` are the names of ROS packages that can be found.
    `files` are the paths of interface files in the package's folder by name within the package.
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
    outputs: tuple[Output, ...] = ()
    known: frozenset[str] = frozenset()
    files: Mapping[str, str] = {}
    folders: Mapping[str, bool] = {}

    def declared(self, *tags: str) -> dict[str, Statement]:
        """Return the statements with one of these tags by their text, the first of each."""
        found: dict[str, Statement] = {}
        for statement in self.statements:
            if statement.tag in tags:
                found.setdefault(statement.text, statement)
        return found

    @property
    def build_type(self) -> str:
        """What builds it; CMake unless it says otherwise."""
        return next(iter(self.declared("build_type")), "ament_cmake")

    @property
    def place(self) -> Span:
        """Where problems with the whole package.xml are shown: at its name."""
        named = self.declared("name")
        return next(iter(named.values())).span if named else Span(self.manifest, 0, 0)
