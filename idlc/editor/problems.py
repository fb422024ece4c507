"""Problems as diagnostics of documents, at the same locations as in `idlc check`.

Clients request them, or get them pushed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import msgspec

from idlc.diagnostics import codes, explain
from idlc.diagnostics.report import Diagnostic, Severity
from idlc.editor import parts
from idlc.editor.documents import TOP, Document
from idlc.editor.elements import uses
from idlc.editor.protocol import requests_problems
from idlc.editor.state import ServerState
from idlc.editor.workspace import Workspace, in_folder

_SEVERITIES = {Severity.ERROR: 1, Severity.WARNING: 2}
_UNNECESSARY = 1
#: Codes about text that could as well be removed.
_NEEDLESS = frozenset({codes.UNUSED_DEPENDENCY.id, codes.UNUSED_IGNORE.id})
#: Where the pages of codes are installed.
_PAGES = Path(explain.__file__).parent / "explain"


class CodeDescription(parts.ProtocolStruct, frozen=True):
    """The page of a code."""

    href: str


class RelatedInformation(parts.ProtocolStruct, frozen=True):
    """A second place that explains the first."""

    location: parts.Location
    message: str


class DocumentDiagnostic(parts.ProtocolStruct, frozen=True):
    """A problem at its place in a document."""

    range: parts.Range
    severity: int
    code: str
    code_description: CodeDescription
    source: str
    message: str
    tags: tuple[int, ...] = ()
    related_information: tuple[RelatedInformation, ...] = ()


class Problem(NamedTuple):
    """A problem in a file, with the workspace that it was found in."""

    diagnostic: Diagnostic
    path: Path
    workspace: Workspace
    state: ServerState

    @property
    def shown(self) -> DocumentDiagnostic:
        """The problem as the client has it; one with a whole file is shown at its top."""
        problem, state = self.diagnostic, self.state
        lines = [problem.message, problem.breaks, problem.holds_for, problem.detail]
        lines += [f"hint: {problem.hint}"] if problem.hint else []
        return DocumentDiagnostic(
            range=state.range(problem.span) if problem.span else TOP,
            severity=_SEVERITIES[problem.severity],
            code=problem.code,
            code_description=CodeDescription((_PAGES / f"{problem.code}.md").as_uri()),
            source="idlc",
            message="\n".join(filter(None, lines)),
            tags=(_UNNECESSARY,) if problem.code in _NEEDLESS else (),
            related_information=tuple(
                RelatedInformation(state.location(label.span, self.workspace.folder), label.text)
                for label in problem.labels
            ),
        )


def problems(state: ServerState) -> Iterator[Problem]:
    """Yield the problems of all folders; of two folders with a file, the innermost's."""
    inner: list[Workspace] = []
    for workspace in state.workspaces():
        snapshot = workspace.snapshot()
        failures = (workspace.failure,) if workspace.failure else ()
        for diagnostic in snapshot.problems if snapshot else failures:
            name = diagnostic.span.source.path if diagnostic.span else diagnostic.path
            path = in_folder(workspace.folder, name)
            if name and not any(other.has(path) for other in inner):
                yield Problem(diagnostic, path, workspace, state)
        inner.append(workspace)


def diagnostics(state: ServerState) -> dict[str, list[DocumentDiagnostic]]:
    """Return the problems of all documents that have any, by URI."""
    by_uri: dict[str, dict[DocumentDiagnostic, None]] = {}
    for problem in problems(state):
        by_uri.setdefault(state.uri(problem.path), {})[problem.shown] = None
    return {uri: list(some) for uri, some in by_uri.items()}


def document(state: ServerState, params: parts.DocumentParams) -> dict[str, object]:
    """Return the problems of a document.

    All of them each time: Neovim forgets them with a document that it reads again, but not their
    result id.
    """
    return _report(diagnostics(state).get(params.text_document.uri, []), None)


def workspace(state: ServerState, params: parts.WorkspaceDiagnosticParams) -> dict[str, object]:
    """Return the problems of every document that has any, or had some in the last answer."""
    by_uri = diagnostics(state)
    before = {previous.uri: previous.value for previous in params.previous_result_ids}
    items = []
    for uri in sorted({*by_uri, *before}):
        opened = state.documents.get(uri)
        report = _report(by_uri.get(uri, []), before.get(uri))
        items.append({"uri": uri, "version": opened.version if opened else None, **report})
    return {"items": items}


def _report(problems: list[DocumentDiagnostic], before: str | None) -> dict[str, object]:
    now = f"{crc32(msgspec.json.encode(problems)):08x}-{len(problems)}"
    if now == before:
        return {"kind": "unchanged", "resultId": now}
    return {"kind": "full", "resultId": now, "items": problems}


def publish(state: ServerState) -> None:
    """Send the client the problems of each document for which they changed."""
    if not state.is_changed:
        return
    state.is_changed = False
    opened = state.documents.items()
    new_documents = [document for uri, document in opened if uri not in state.fingerprints]
    state.fingerprints |= _fingerprints(state, new_documents)
    problems_now = diagnostics(state)
    versions = {uri: document.version for uri, document in opened}
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


#: Parts of a document that are shown and may change with another document.
_PARTS = ("inlayHint", "codeLens", "semanticTokens")


def rest(state: ServerState) -> None:
    """Do the work that can wait until the client is idle.

    Look for changes that it does not report, and have it request features again where another
    document changed their answers.
    """
    state.refresh_moved_lenses()
    if not state.is_watching and state.notice_changes():
        publish(state)
    before = state.fingerprints
    state.fingerprints = _fingerprints(state, state.documents.values())
    for uri, (version, shown) in state.fingerprints.items():
        old_version, old = before.get(uri, (None, shown))
        if old_version == version and old != shown:  # or the client asks by itself
            for part in _PARTS:
                state.refresh(part)
            return


def _fingerprints(
    state: ServerState, documents: Iterable[Document]
) -> dict[str, tuple[int | None, object]]:
    """Return for documents their version, and what others decide of their hints and lenses."""
    refreshes = any(state.supports("workspace", part, "refreshSupport") for part in _PARTS)
    if not documents or not refreshes:
        return {}
    counts = Counter(target for _, _, target in uses(state))
    shown: dict[str, tuple[int | None, object]] = {}
    for opened in documents:
        context = state.context(opened.uri)
        if context is None:
            shown[opened.uri] = (opened.version, None)
            continue
        name, model = context.interface.name, context.model
        against = context.workspace.baseline.name
        hash_ = model.describer.hash(str(name)) if model else ""
        shown[opened.uri] = (opened.version, (hash_, counts[name], against))
    return shown
