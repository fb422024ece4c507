"""Problems as diagnostics of documents: what `idlc check` says, at the same places."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from idlc.diagnostics import codes, explain
from idlc.diagnostics.report import Diagnostic, Severity
from idlc.editor.projects import Project
from idlc.editor.protocol import uris
from idlc.editor.protocol.parts import Location, Part, Position, Range
from idlc.editor.workspace import State
from idlc.editor.world import World

_SEVERITIES = {Severity.ERROR: 1, Severity.WARNING: 2}
_UNNECESSARY = 1
#: What is about text that could as well be removed.
_NEEDLESS = frozenset({codes.UNUSED_DEPENDENCY.id, codes.UNUSED_IGNORE.id})
#: Where the pages of codes are installed.
_PAGES = Path(explain.__file__).parent / "explain"
_TOP = Range(Position(0, 0), Position(0, 0))


class Page(Part, frozen=True):
    """The page of a code."""

    href: str


class Related(Part, frozen=True):
    """A second place that explains the first."""

    location: Location
    message: str


class Shown(Part, frozen=True):
    """A problem at its place in a document."""

    range: Range
    severity: int
    code: str
    code_description: Page
    source: str
    message: str
    tags: tuple[int, ...] = ()
    related_information: tuple[Related, ...] = ()


def diagnostics(world: World) -> dict[str, list[Shown]]:
    """Return the problems of all documents that have any, by URI."""
    found: dict[str, dict[Shown, None]] = {}
    for path, one, state in problems(world):
        found.setdefault(world.uri(path), {})[shown(one, state, world)] = None
    for project in world.projects:
        if project.failure is not None:
            failed = world.uri(project.folder / project.failure.path)
            found.setdefault(failed, {})[_shown(project.failure, _TOP)] = None
    return {uri: list(some) for uri, some in found.items()}


def problems(world: World) -> Iterator[tuple[Path, Diagnostic, State]]:
    """Yield the problems of all folders, each with its file; the innermost folder counts."""
    inner: list[Project] = []
    for project in world.projects.all():
        state = project.state(world.documents)
        for one in state.problems if state else ():
            assert state is not None
            path = _path(one, state)
            if path is not None and not any(other.has(path) for other in inner):
                yield path, one, state
        inner.append(project)


def _path(problem: Diagnostic, state: State) -> Path | None:
    """Return the file that a problem is shown in."""
    if problem.span is not None:
        return state.path_of(problem.span.source)
    return (state.folder / problem.path) if problem.path else None


def shown(problem: Diagnostic, state: State, world: World) -> Shown:
    """Return a problem as a diagnostic; one with a whole file is shown at its top."""
    related = tuple(
        Related(world.location(label.span, state), label.text) for label in problem.labels
    )
    return _shown(problem, world.range(problem.span) if problem.span else _TOP, related)


def _shown(problem: Diagnostic, place: Range, related: tuple[Related, ...] = ()) -> Shown:
    lines = [problem.message, problem.breaks, problem.holds_for, problem.detail]
    lines += [f"hint: {problem.hint}"] if problem.hint else []
    return Shown(
        range=place,
        severity=_SEVERITIES[problem.severity],
        code=problem.code,
        code_description=Page(uris.from_path(_PAGES / f"{problem.code}.md")),
        source="idlc",
        message="\n".join(filter(None, lines)),
        tags=(_UNNECESSARY,) if problem.code in _NEEDLESS else (),
        related_information=related,
    )
