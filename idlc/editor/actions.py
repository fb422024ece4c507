"""Actions on problems, commands that an editor sends when one was chosen, and formatting."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from idlc.check.format import laid_out
from idlc.check.package.manifest import dependency
from idlc.check.run import keep_layout
from idlc.check.select import REMARK
from idlc.diagnostics.report import Diagnostic, Edit, Report, Severity, apply, first_few
from idlc.diagnostics.source import Span
from idlc.editor import protocol
from idlc.editor.elements import by_uri, differences, workspace_edit
from idlc.editor.parts import (
    CodeActionParams,
    Command,
    DocumentParams,
    Part,
    PositionParams,
    Range,
    RangeParams,
    TextEdit,
)
from idlc.editor.problems import DocumentDiagnostic, problems, to_diagnostic
from idlc.editor.protocol import INVALID_PARAMS, REQUEST_FAILED, RequestError
from idlc.editor.rename import can_move_files, rename_interface
from idlc.editor.state import InterfaceContext, ServerState
from idlc.editor.workspace import Snapshot

if TYPE_CHECKING:
    from idlc.generate.gen import Run
    from idlc.generate.package import Generated
    from idlc.project.inputs import Inputs

_FIX, _FIX_ALL = "quickfix", "source.fixAll.idlc"
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
        return to_diagnostic(self.diagnostic, self.snapshot.folder, self.state)

    def action(self, title: str, edits: Iterable[Edit], *, best: bool = False) -> CodeAction:
        """Return an action on this problem."""
        change = workspace_edit(by_uri(edits, self.snapshot, self.state), self.state)
        return CodeAction(title, _FIX, change, (self.shown,), best)


def actions(state: ServerState, params: CodeActionParams) -> list[CodeAction]:
    """Return actions on the problems in a range, and on all of a document."""
    state.notice_changes()  # or edits may be of older files
    uri, only = params.text_document.uri, params.context.only
    path = state.path(uri)
    all_ = [
        ProblemInContext(diagnostic, snapshot, at, state)
        for at, diagnostic, snapshot in problems(state)
        if at == path
    ]
    offered: list[CodeAction] = []
    if _is_requested(_FIX, only):
        for problem in all_:
            if _touch(problem.shown.range, params.range):
                offered += _about(problem)
    if _is_requested(_FIX_ALL, only) and path is not None:
        offered += _everything(all_, uri, state)
    if _is_requested(protocol.UPDATE_KIND, only) and (command := _update_command(state, uri)):
        title = str(command["title"])
        offered.append(CodeAction(title, protocol.UPDATE_KIND, command=command))
    return offered


def _is_requested(kind: str, only: tuple[str, ...] | None) -> bool:
    return only is None or any(f"{kind}.".startswith(f"{other}.") for other in only)


def _touch(range_: Range, other: Range) -> bool:
    start, end, first, last = (
        (at.line, at.character) for at in (range_.start, range_.end, other.start, other.end)
    )
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
    command = _command(title, protocol.RENAME_FILE, *arguments)
    return CodeAction(title, _FIX, diagnostics=(problem.shown,), command=command)


def _command(title: str, command: str, *arguments: str) -> dict[str, object]:
    return {"title": title, "command": command, "arguments": arguments}


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
    return after is not None and _count(after.problems) < _count(problem.snapshot.problems)


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
    change = workspace_edit({uri: differences(old.text, new, state.encoding)}, state)
    title = "Fix all that can be fixed without harm"
    yield CodeAction(title, _FIX_ALL, change, tuple(problem.shown for problem in fixed))


# Commands.

#: Problems, and packages, that a message names.
NAMED = 5
_ERROR, _INFO = 1, 3


def execute(state: ServerState, params: Command) -> None:
    """Run a command."""
    match params.command, *params.arguments:
        case protocol.ADD_DEPENDENCY, str(uri), str(package):
            state.notice_changes()  # or the edit may be of an older package.xml
            _declare(state.context(uri), package)
        case protocol.RENAME_FILE, str(uri), str(new):
            state.forget()
            _rename(state.context(uri), new)
        case protocol.UPDATE_GENERATED, str(uri):
            _update(state, uri)
        case _:
            raise RequestError(INVALID_PARAMS, f"there is no command `{params.command}` for these")


def _declare(context: InterfaceContext | None, package: str) -> None:
    facts = context.workspace.facts(context.path) if context else None
    edit = dependency(facts, package) if facts else None
    if context is not None and edit is not None:
        state = context.state
        change = workspace_edit(by_uri([edit], context.snapshot, state), state)
        state.ask("workspace/applyEdit", {"label": f"declare {package}", "edit": change})


def _rename(context: InterfaceContext | None, new: str) -> None:
    edit = rename_interface(context, new, context) if context else None
    if context is not None and edit is not None:
        context.state.ask("workspace/applyEdit", {"label": f"rename to {new}", "edit": edit})


def _update_command(state: ServerState, uri: str) -> dict[str, object] | None:
    """Return the command for a document whose generated package is out of date."""
    run, inputs, key = _generation(state, uri)
    if run is None or inputs is None or not run.is_needed(inputs.package, inputs.digests, key):
        return None
    title = f"Update the generated package in {run.options.out}"
    return _command(title, protocol.UPDATE_GENERATED, uri)


def _generation(state: ServerState, uri: str) -> tuple[Run | None, Inputs | None, str]:
    """Return the run that a document is an input of, its package, and its name in that."""
    from idlc.generate.gen import run_for

    path = state.path(uri)
    workspace = state.workspace_of(path) if path else None
    if path is None or workspace is None:
        return None, None, ""
    inputs, file = workspace.inputs(path)
    return run_for(path, inputs.package), inputs, file.key


def _update(state: ServerState, uri: str) -> None:
    """Generate as `idlc gen` does, and report the outcome; raises RequestError."""
    run, inputs, _ = _generation(state, uri)
    if run is None or inputs is None:
        raise RequestError(REQUEST_FAILED, "[tool.idlc] does not say where to generate it")
    unsaved = sorted(f"`{path.name}`" for path in _unsaved(state, inputs.package))
    if unsaved:
        names = first_few(unsaved, NAMED)
        raise RequestError(REQUEST_FAILED, f"save first, what is on disk is compiled: {names}")
    report = Report()
    try:
        generated = run.make(report)
    except OSError as error:
        raise RequestError(REQUEST_FAILED, f"nothing was generated: {error}") from error
    state.forget()
    if report.had_errors:
        texts = (f"{each.where[0]}: {each.code}: {each.message}" for each in report.errors)
        message = f"idlc gen: nothing was written: {first_few(texts, NAMED)}"
    else:
        message = f"idlc gen: {first_few(map(_outcome, generated), NAMED)}"
    kind = _ERROR if report.had_errors else _INFO
    state.notify("window/showMessage", {"type": kind, "message": message})


def _unsaved(state: ServerState, package: str) -> Iterator[Path]:
    """Yield the files of a package that hold another text than their documents."""
    for document in state.documents.values():
        context = state.context(document.uri)
        is_input = context is not None and context.interface.name.package == package
        if is_input and document.path and not document.is_on_disk():
            yield document.path


def _outcome(generated: Generated) -> str:
    counts = [f"{generated.written} written"] if generated.written else []
    counts += [f"{generated.removed} removed"] if generated.removed else []
    return f"{generated.package}: {', '.join(counts) or 'unchanged'} in {generated.out}"


# Formatting, as `idlc fmt` does it.


def format_document(context: InterfaceContext, _: DocumentParams) -> list[TextEdit]:
    """Return the edits that format a document; none where it has syntax errors."""
    old = context.source.text
    new = laid_out(context.source, context.interface.name, Report())
    return [] if new is None else differences(old, new, context.state.encoding)


def format_range(context: InterfaceContext, params: RangeParams) -> list[TextEdit]:
    """Return those edits that touch the lines of a range."""
    first, last = params.range.start.line, params.range.end.line
    if params.range.end.character == 0 and last > first:
        last -= 1
    return [
        edit
        for edit in format_document(context, params)
        if edit.range.start.line <= last and max(edit.range.end.line - 1, first) >= first
    ]


def format_typed(context: InterfaceContext, params: PositionParams) -> list[TextEdit]:
    """Return those edits that touch the line before the one that was begun."""
    before = params.position.line - 1
    return [
        edit
        for edit in format_document(context, params)
        if edit.range.start.line == before == edit.range.end.line - 1
    ]
