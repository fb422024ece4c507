"""Problems as diagnostics of documents, at the same places as `idlc check` has them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec

from idlc.diagnostics import codes, explain
from idlc.diagnostics.report import Diagnostic, Severity
from idlc.editor.documents import Document
from idlc.editor.protocol import uris
from idlc.editor.protocol.parts import Location, Part, Position, Range
from idlc.editor.state import RELATIVE, ServerState
from idlc.editor.workspace import Snapshot, Workspace

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


def diagnostics(state: ServerState) -> dict[str, list[Shown]]:
    """Return the problems of all documents that have any, by URI."""
    found: dict[str, dict[Shown, None]] = {}
    for path, one, snapshot in problems(state):
        found.setdefault(state.uri(path), {})[shown(one, snapshot, state)] = None
    for workspace in state.workspaces():
        if workspace.failure is not None:
            failed = state.uri(workspace.folder / workspace.failure.path)
            found.setdefault(failed, {})[_shown(workspace.failure, _TOP)] = None
    return {uri: list(some) for uri, some in found.items()}


def problems(state: ServerState) -> Iterator[tuple[Path, Diagnostic, Snapshot]]:
    """Yield the problems of all folders, each with its file; the innermost folder counts."""
    inner: list[Workspace] = []
    for workspace in state.workspaces():
        snapshot = workspace.snapshot()
        for one in snapshot.problems if snapshot else ():
            assert snapshot is not None
            path = _path(one, snapshot)
            if path is not None and not any(other.has(path) for other in inner):
                yield path, one, snapshot
        inner.append(workspace)


def _path(problem: Diagnostic, snapshot: Snapshot) -> Path | None:
    """Return the file that a problem is shown in."""
    if problem.span is not None:
        return snapshot.path_of(problem.span.source)
    return (snapshot.folder / problem.path) if problem.path else None


def shown(problem: Diagnostic, snapshot: Snapshot, state: ServerState) -> Shown:
    """Return a problem as a diagnostic; one with a whole file is shown at its top."""
    related = tuple(
        Related(state.location(label.span, snapshot), label.text) for label in problem.labels
    )
    return _shown(problem, state.range(problem.span) if problem.span else _TOP, related)


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


#: Parts of a document that are shown and may change with another document.
_PARTS = ("inlayHint", "codeLens", "semanticTokens")


def publish(state: ServerState) -> None:
    """Send the client the problems that there are now, where that changed."""
    if not state.is_changed:
        return
    state.is_changed = False
    new_documents = [one for one in state.documents if one.uri not in state.fingerprints]
    state.fingerprints |= _fingerprints(state, new_documents) if new_documents else {}
    problems_now = diagnostics(state)
    versions = {document.uri: document.version for document in state.documents}
    new = {
        uri: (versions.get(uri), msgspec.json.encode(problems_now.get(uri, ())))
        for uri in (*problems_now, *versions)
    }
    gone = state.published.keys() - new.keys()
    changed = {uri for uri, some in new.items() if state.published.get(uri) != some} | gone
    state.published = new
    # a client that asks for problems itself would show pushed ones again
    if state.supports("textDocument", "diagnostic"):
        if changed and state.supports("workspace", "diagnostics", "refreshSupport"):
            state.ask("workspace/diagnostic/refresh", None)
        return
    for uri in sorted(changed):
        version, encoded = new.get(uri, (None, b"[]"))
        params: dict[str, object] = {"uri": uri, "diagnostics": msgspec.Raw(encoded)}
        params |= {} if version is None else {"version": version}
        state.notify("textDocument/publishDiagnostics", params)


def idle(state: ServerState) -> None:
    """Look for what a client does not tell, while it says nothing."""
    if not state.supports("workspace", "didChangeWatchedFiles", RELATIVE):
        state.refresh_moved_lenses()
    rest(state)


def rest(state: ServerState) -> None:
    """Do what can wait until the client says nothing."""
    if not state.is_watching and state.notice_changes():
        publish(state)
    _refresh(state)


def _refresh(state: ServerState) -> None:
    """Have the client ask again for what it shows where another document changed that."""
    before = state.fingerprints
    state.fingerprints = _fingerprints(state, state.documents)
    for uri, (version, number) in state.fingerprints.items():
        old_version, old = before.get(uri, (None, number))
        if old_version == version and old != number:  # or the client asks by itself
            for part in _PARTS:
                state.refresh(part)
            return


def _fingerprints(
    state: ServerState, documents: Iterable[Document]
) -> dict[str, tuple[int | None, int]]:
    if not any(state.supports("workspace", part, "refreshSupport") for part in _PARTS):
        return {}
    from idlc.editor.features.tokens import fingerprints

    return {one.uri: (one.version, number) for one, number in fingerprints(state, documents)}
