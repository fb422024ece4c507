"""Actions on problems: fixes, other words, and remarks that silence them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from idlc.check.run import keep_layout
from idlc.check.select import REMARK
from idlc.diagnostics.report import Diagnostic, Edit, Severity, apply
from idlc.diagnostics.source import Span
from idlc.editor.elements import differences, of_documents, workspace_edit
from idlc.editor.features import commands
from idlc.editor.features.rename import can_move_files
from idlc.editor.protocol.capabilities import RENAME_FILE, UPDATE_KIND
from idlc.editor.protocol.parts import CodeActionParams, Part, Range
from idlc.editor.publish import DocumentDiagnostic, problems, to_diagnostic
from idlc.editor.state import ServerState
from idlc.editor.workspace import Snapshot

_FIX, _FIX_ALL, _UPDATE = "quickfix", "source.fixAll.idlc", UPDATE_KIND
#: Hints that name the text to write instead.
_MEANT = re.compile(r"(?:did you mean|write|use) `")
#: Hints that name the file to rename to.
_OTHER_FILE = re.compile(r"call it `((\w+)\.\w+)`")
#: Of the names in a hint, so many are tried.
MOST = 3


class CodeAction(Part, frozen=True):
    """A code action."""

    title: str
    kind: str
    edit: dict[str, object] | None = None
    diagnostics: tuple[DocumentDiagnostic, ...] = ()
    is_preferred: bool = False
    command: dict[str, object] | None = None


class ProblemInContext(NamedTuple):
    """A problem of a document, with the snapshot and the state that its edits need."""

    diagnostic: Diagnostic
    snapshot: Snapshot
    path: Path
    state: ServerState

    @property
    def shown(self) -> DocumentDiagnostic:
        """The problem as the client has it."""
        return to_diagnostic(self.diagnostic, self.snapshot, self.state)

    def action(self, title: str, edits: Iterable[Edit], *, best: bool = False) -> CodeAction:
        """Return an action on this problem."""
        change = workspace_edit(edits, self.snapshot, self.state)
        return CodeAction(title, _FIX, change, (self.shown,), best)


def actions(state: ServerState, params: CodeActionParams) -> list[CodeAction]:
    """Return actions on the problems in a range, and on all of a document."""
    state.notice_changes()  # or edits may be of older files
    path = state.path(params.text_document.uri)
    all_ = [
        ProblemInContext(diagnostic, snapshot, at, state)
        for at, diagnostic, snapshot in problems(state)
        if at == path
    ]
    offered: list[CodeAction] = []
    if _is_requested(_FIX, params.context.only):
        for problem in all_:
            if _touch(problem.shown.range, params.range):
                offered += _about(problem)
    if _is_requested(_FIX_ALL, params.context.only) and path is not None:
        offered += _everything(all_, params.text_document.uri, state)
    if _is_requested(_UPDATE, params.context.only):
        command = commands.command(state, params.text_document.uri)
        offered += [CodeAction(str(command["title"]), _UPDATE, command=command)] if command else []
    return offered


def _is_requested(kind: str, only: tuple[str, ...] | None) -> bool:
    return only is None or any(f"{kind}.".startswith(f"{other}.") for other in only)


def _touch(range_: Range, other: Range) -> bool:
    places = (
        (end.line, end.character) for end in (range_.start, range_.end, other.start, other.end)
    )
    start, end, first, last = places
    return start <= last and first <= end


def _about(problem: ProblemInContext) -> Iterator[CodeAction]:
    diagnostic = problem.diagnostic
    if diagnostic.edits:
        hint = diagnostic.hint or f"fix {diagnostic.code}"
        yield problem.action(hint[:1].upper() + hint[1:], diagnostic.edits, best=True)
    elif diagnostic.span is not None:
        best = bool(_MEANT.match(diagnostic.hint or ""))
        for title, edit in _offers(diagnostic.hint or "", diagnostic.span):
            if _helps(problem, edit):
                yield problem.action(title, [edit], best=best)
    if can_move_files(problem.state) and (moved := _moved(problem)):
        yield moved
    remark = _remark(problem) if diagnostic.severity is Severity.WARNING else None
    if remark is not None and _helps(problem, remark):
        yield problem.action(f"Ignore {diagnostic.code} here", [remark])


def _moved(problem: ProblemInContext) -> CodeAction | None:
    """Return the action that gives a file the name that a hint says, if nothing has it."""
    hint = _OTHER_FILE.match(problem.diagnostic.hint or "")
    if hint is None or os.path.lexists(problem.path.with_name(hint[1])):
        return None
    title = f"Rename the file to `{hint[1]}`"
    arguments = [problem.state.uri(problem.path), hint[2]]
    command: dict[str, object] = {"title": title, "command": RENAME_FILE, "arguments": arguments}
    return CodeAction(title, _FIX, diagnostics=(problem.shown,), command=command)


def _offers(hint: str, span: Span) -> Iterator[tuple[str, Edit]]:
    """Yield edits that a hint may suggest, with their titles; some do not help.

    A text in backticks replaces the span; if it has several words, the line's definition.
    """
    source = span.source
    number, _ = source.position(span.start)
    start, line = source.line_starts[number - 1], source.line_text(number)
    definition = line.partition("#")[0]
    words = re.findall(r"`([^`]+)`", hint)[:MOST]
    has_one_definition = sum(" " in word for word in words) == 1
    for word in words:
        if " " not in word:
            yield f"Write `{word}`", _instead(span, word)
        elif has_one_definition:
            whole = Span(source, start, start + len(definition.rstrip()))
            yield f"Write `{word}`", Edit(whole, word)
    if bound := re.search(r"raise the bound to (\d+)", hint):
        at = re.match(r"[^#\s]*<=(\d+)", definition)
        if at:
            title = f"Raise the bound to {bound[1]}"
            yield title, Edit(Span(source, start + at.start(1), start + at.end(1)), bound[1])
    if re.search(r"\bremove (?:it|one of them)$", hint):
        end = source.line_starts_after(span.start)
        yield "Remove this line", Edit(Span(source, start, end), "")


def _instead(span: Span, word: str) -> Edit:
    """Return the edit that replaces a span, or the name in a type, with a word."""
    package, slash, _ = span.text.rpartition("/")
    if slash and "/" not in word:
        span = span.at(len(package) + 1, len(span.text))
    return Edit(span, word)


def _helps(problem: ProblemInContext, edit: Edit) -> bool:
    """Return whether a check of the text after an edit finds fewer problems."""
    workspace = problem.state.workspace_of(problem.path)
    text, _ = apply(edit.span.source.text, [edit])
    after = workspace.snapshot_with(problem.path, text) if workspace else None
    if after is None:
        return False
    before = _count(problem.snapshot.problems)
    return _count(after.problems) < before


def _count(diagnostics: Iterable[Diagnostic]) -> tuple[int, int]:
    """Return the numbers of errors and of all problems."""
    severities = [diagnostic.severity for diagnostic in diagnostics]
    return severities.count(Severity.ERROR), len(severities)


def _remark(problem: ProblemInContext) -> Edit | None:
    """Return the edit that adds a remark to the line of a problem, or to the head of its file."""
    if problem.path not in problem.snapshot.interfaces:
        return None
    source = problem.snapshot.interfaces[problem.path][1]
    code, span = problem.diagnostic.code, problem.diagnostic.span
    if span is None or not span.text:
        return Edit(Span(source, 0, 0), f"# idlc: ignore[{code}] TODO: say why\n")
    number, _ = source.position(span.start)
    start, line = source.line_starts[number - 1], source.line_text(number)
    comment = line.find("#")
    existing = re.search(REMARK, line[comment:]) if comment >= 0 else None
    if existing is not None:
        at = start + comment + existing.end(1)
        return Edit(Span(source, at, at), f", {code}")
    end = start + len(line.rstrip())
    sign = "  # " if comment < 0 else " "
    # with square brackets, ROS 2 would take it for the unit
    return Edit(Span(source, end, start + len(line)), f"{sign}idlc: ignore({code}) TODO: say why")


def _everything(all_: list[ProblemInContext], uri: str, state: ServerState) -> Iterator[CodeAction]:
    """Yield the action that applies every fix of a document, as `idlc check --fix` does."""
    fixed = [problem for problem in all_ if problem.diagnostic.edits]
    edits = [
        edit
        for problem in fixed
        for edit in problem.diagnostic.edits
        if problem.snapshot.path_of(edit.span.source) == problem.path
    ]
    if not edits:
        return
    old = edits[0].span.source
    new = keep_layout(old.path, old.text, apply(old.text, edits)[0])
    change = of_documents({uri: differences(old.text, new, state.encoding)}, state)
    title = "Fix all that can be fixed without harm"
    yield CodeAction(title, _FIX_ALL, change, tuple(problem.shown for problem in fixed))
