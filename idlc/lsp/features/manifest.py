"""package.xml: where the packages are that it names, and what uses their messages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from idlc.checks.package.package_xml import statements
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.disk.machine.environment import ament_prefixes
from idlc.disk.packages.enclosing import MANIFEST, manifest
from idlc.disk.read import is_file
from idlc.disk.working_folder import working_in
from idlc.driver.workspace import State
from idlc.lsp.protocol.parts import AskedReferences, AtPosition, Location, Position, Range
from idlc.lsp.users import states, uses
from idlc.lsp.world import World

_TOP = Range(Position(0, 0), Position(0, 0))


def named(world: World, asked: AtPosition) -> str | None:
    """Return the package that is named at a position of a package.xml."""
    path = world.path(asked.text_document.uri)
    source = _source(path, world) if path and path.name == MANIFEST else None
    if source is None:
        return None
    offset = world.offset(source, asked.position)
    return next((name for name, at in _packages(source) if at.start <= offset <= at.end), None)


def definition(package: str, world: World) -> Location | None:
    """Return the package.xml of a package, or what is built in of it."""
    for state in states(world):
        if path := _file(package, state):
            return Location(world.uri(path), _TOP)
    for state in states(world):
        for name in state.library.interfaces(package)[:1]:
            if source := state.source(name):
                return world.location(Span(source, 0, 0), state)
    return None


def references(package: str, asked: AskedReferences, world: World) -> list[Location]:
    """Return where a package's messages are used, and where other packages declare it."""
    found = [
        world.location(at, state) for state, at, used in uses(world) if used.package == package
    ]
    for path in dict.fromkeys(_manifests(world)):
        source = _source(path, world)
        for name, at in _packages(source) if source else ():
            is_own = source is not None and source.text[: at.start].rstrip().endswith("<name>")
            if name == package and (asked.context.include_declaration or not is_own):
                found.append(Location(world.uri(path), world.range(at)))
    return found


def _source(path: Path, world: World) -> Source | None:
    """Return the text of a package.xml, as an editor has it if it is open."""
    return world.documents.unsaved().read_source(path, str(path), Report())


def _packages(source: Source) -> Iterator[tuple[str, Span]]:
    """Yield the packages that a package.xml names, and where."""
    for one in statements(source):
        if one.text and (one.tag == "name" or one.tag.endswith("depend")):
            start = source.text.find(one.text, one.span.end - 1)
            if start >= 0:
                yield one.text, Span(source, start, start + len(one.text))


def _manifests(world: World) -> Iterator[Path]:
    """Yield the package.xml files of the packages in all folders."""
    for state in states(world):
        for path in state.interfaces:
            if declared := manifest(path.parent.parent):
                yield declared


def _file(package: str, state: State) -> Path | None:
    """Return the package.xml of a package that is in a folder, beside it, or installed."""
    with working_in(state.folder):
        home = state.library.home(package)
        declared = manifest(home) if home else None
    installed = (prefix / "share" / package / MANIFEST for prefix in ament_prefixes())
    found = (declared and state.folder / declared, *installed)
    return next((one for one in found if one and is_file(one)), None)
