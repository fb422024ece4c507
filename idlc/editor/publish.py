"""Problems as diagnostics of documents, at the same locations as in `idlc check`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec

from idlc.diagnostics import codes, explain
from idlc.diagnostics.report import Diagnostic, Severity
from idlc.editor.documents import Document
from idlc.editor.protocol import uris
from idlc.editor.protocol.capabilities import requests_problems
from idlc.editor.protocol.parts import Location, Part, Position, Range
from idlc.editor.state import RELATIVE, ServerState
from idlc.editor.workspace import Snapshot, Workspace

_SEVERITIES = {Severity.ERROR: 1, Severity.WARNING: 2}
_UNNECESSARY = 1
#: Codes about text that could as well be removed.
_NEEDLESS = frozenset({codes.UNUSED_DEPENDENCY.id, codes.UNUSED_IGNORE.id})
#: Where the pages of codes are installed.
_PAGES = Path(explain.__file__).parent / "explain"
_TOP = Range(Position(0, 0), Position(0, 0))


class Page(Part, frozen=True):
    """The page of a code."""

    href: str


class RelatedInformation(Part, frozen=True):
    """A second place that explains the first."""

    location: Location
    message: str


class DocumentDiagnostic(Part, frozen=True):
    """A problem at its place in a document."""

    range: Range
    severity: int
    code: str
    code_description: Page
    source: str
    message: str
    tags: tuple[int, ...] = ()
    related_information: tuple[RelatedInformation, ...] = ()


def diagnostics(state: ServerState) -> dict[str, list[DocumentDiagnostic]]:
    """Return the problems of all documents that have any, by URI."""
    by_uri: dict[str, dict[DocumentDiagnostic, None]] = {}
    for path, problem, snapshot in problems(state):
        by_uri.setdefault(state.uri(path), {})[to_diagnostic(problem, snapshot, state)] = None
    for workspace in state.workspaces():
        if workspace.failure is not None:
            failed = state.uri(workspace.folder / workspace.failure.path)
            by_uri.setdefault(failed, {})[_shown(workspace.failure, _TOP)] = None
    return {uri: list(some) for uri, some in by_uri.items()}


def problems(state: ServerState) -> Iterator[tuple[Path, Diagnostic, Snapshot]]:
    """Yield the problems of all folders, each with its file; of two folders, the innermost's."""
    inner: list[Workspace] = []
    for workspace in state.workspaces():
        snapshot = workspace.snapshot()
        for problem in snapshot.problems if snapshot else ():
            assert snapshot is not None
            path = _path(problem, snapshot)
            if path is not None and not any(other.has(path) for other in inner):
                yield path, problem, snapshot
        inner.append(workspace)


def _path(problem: Diagnostic, snapshot: Snapshot) -> Path | None:
    """Return the file that a problem is shown in."""
    if problem.span is not None:
        return snapshot.path_of(problem.span.source)
    return (snapshot.folder / problem.path) if problem.path else None


def to_diagnostic(
    problem: Diagnostic, snapshot: Snapshot, state: ServerState
) -> DocumentDiagnostic:
    """Return a problem as a diagnostic; one with a whole file is shown at its top."""
    related = tuple(
        RelatedInformation(state.location(label.span, snapshot), label.text)
        for label in problem.labels
    )
    return _shown(problem, state.range(problem.span) if problem.span else _TOP, related)


def _shown(
    problem: Diagnostic, place: Range, related: tuple[RelatedInformation, ...] = ()
) -> DocumentDiagnostic:
    lines = [problem.message, problem.breaks, problem.holds_for, problem.detail]
    lines += [f"hint: {problem.hint}"] if problem.hint else []
    return DocumentDiagnostic(
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
    """Send the client the problems of each document for which they changed."""
    if not state.is_changed:
        return
    state.is_changed = False
    new_documents = [
        document for document in state.documents if document.uri not in state.fingerprints
    ]
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
    # a client that requests problems would show pushed ones again
    if requests_problems(state.client):
        if changed:
            state.ask("workspace/diagnostic/refresh", None)
        return
    for uri in sorted(changed):
        version, encoded = new.get(uri, (None, b"[]"))
        params: dict[str, object] = {"uri": uri, "diagnostics": msgspec.Raw(encoded)}
        params |= {} if version is None else {"version": version}
        state.notify("textDocument/publishDiagnostics", params)


def idle(state: ServerState) -> None:
    """Poll for changes that a client does not report, while it is idle."""
    if not state.supports("workspace", "didChangeWatchedFiles", RELATIVE):
        state.refresh_moved_lenses()
    rest(state)


def rest(state: ServerState) -> None:
    """Do the work that can wait until the client is idle."""
    if not state.is_watching and state.notice_changes():
        publish(state)
    _refresh(state)


def _refresh(state: ServerState) -> None:
    """Have the client request features again where another document changed their answers."""
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

    return {
        document.uri: (document.version, number)
        for document, number in fingerprints(state, documents)
    }
