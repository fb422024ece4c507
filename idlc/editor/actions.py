"""Actions on problems, commands that an editor sends when one was chosen, and formatting."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from idlc.check.manifest import dependency
from idlc.check.select import REMARK
from idlc.diagnostics.report import Edit, Report, ReportedError, Severity, apply, first_few
from idlc.diagnostics.source import Span
from idlc.editor import parts, protocol
from idlc.editor.elements import by_uri, differences, workspace_edit
from idlc.editor.problems import DocumentDiagnostic, Problem, problems
from idlc.editor.protocol import INVALID_PARAMS, REQUEST_FAILED, RequestError
from idlc.editor.rename import can_move_files, rename_interface
from idlc.editor.state import InterfaceContext, ServerState
from idlc.editor.workspace import in_folder
from idlc.tasks.check import keep_layout
from idlc.tasks.fmt import laid_out

if TYPE_CHECKING:
    from idlc.project.inputs import Inputs
    from idlc.tasks.gen import Run

_FIX, _FIX_ALL = "quickfix", "source.fixAll.idlc"
#: Hints that name the text to write instead.
_MEANT = re.compile(r"(?:did you mean|write|use) `")
#: Hints that name the file to rename to.
_OTHER_FILE = re.compile(r"call it `((\w+)\.\w+)`")
#: Of the names in a hint, so many are tried.
MOST = 3


class CodeAction(parts.ProtocolStruct, frozen=True):
    """A code action."""

    title: str
    kind: str
    edit: dict[str, object] | None = None
    diagnostics: tuple[DocumentDiagnostic, ...] = ()
    is_preferred: bool = False
    command: Mapping[str, object] | None = None


def actions(state: ServerState, params: parts.CodeActionParams) -> list[CodeAction]:
    """Return actions on the problems in a range, and on all of a document."""
    state.notice_changes()  # or edits may be of older files
    uri, only = params.text_document.uri, params.context.only
    path = state.path(uri)
    all_ = [problem for problem in problems(state) if problem.path == path]
    offered: list[CodeAction] = []
    if _is_requested(_FIX, only):
        for problem in all_:
            range_ = problem.shown.range
            if range_.start <= params.range.end and params.range.start <= range_.end:
                offered += _about(problem)
    if _is_requested(_FIX_ALL, only) and path is not None:
        fixed = [problem for problem in all_ if problem.diagnostic.edits]
        edits = [
            edit
            for problem in fixed
            for edit in problem.diagnostic.edits
            if in_folder(problem.workspace.folder, edit.span.source.path) == path
        ]
        if edits:  # as `idlc check --fix` makes them
            old = edits[0].span.source
            new = keep_layout(old.path, old.text, apply(old.text, edits)[0])
            change = workspace_edit({uri: differences(old.text, new, state.encoding)}, state)
            title = "Apply all safe fixes"
            shown = tuple(problem.shown for problem in fixed)
            offered.append(CodeAction(title, _FIX_ALL, change, shown))
    if _is_requested(protocol.UPDATE_KIND, only):
        run, inputs, key = _generation(state, uri)
        if run and inputs and run.is_needed(inputs.package, inputs.digests, key):
            title = f"Update the generated package in {run.options.out}"
            command = {"title": title, "command": protocol.UPDATE_GENERATED, "arguments": (uri,)}
            offered.append(CodeAction(title, protocol.UPDATE_KIND, command=command))
    return offered


def _is_requested(kind: str, only: tuple[str, ...] | None) -> bool:
    return only is None or any(f"{kind}.".startswith(f"{other}.") for other in only)


def _action(
    problem: Problem, title: str, edits: Iterable[Edit], *, best: bool = False
) -> CodeAction:
    change = workspace_edit(by_uri(edits, problem.workspace.folder, problem.state), problem.state)
    return CodeAction(title, _FIX, change, (problem.shown,), best)


def _about(problem: Problem) -> Iterator[CodeAction]:
    diagnostic = problem.diagnostic
    hint = diagnostic.hint or ""
    if diagnostic.edits:
        title = hint or f"fix {diagnostic.code}"
        yield _action(problem, title[:1].upper() + title[1:], diagnostic.edits, best=True)
    elif diagnostic.span is not None:
        for title, edit in _offers(hint, diagnostic.span):
            if _helps(problem, edit):
                yield _action(problem, title, [edit], best=bool(_MEANT.match(hint)))
    file = _OTHER_FILE.match(hint) if can_move_files(problem.state) else None
    if file and not os.path.lexists(problem.path.with_name(file[1])):
        title = f"Rename the file to `{file[1]}`"
        arguments = (problem.state.uri(problem.path), file[2])
        command = {"title": title, "command": protocol.RENAME_FILE, "arguments": arguments}
        yield CodeAction(title, _FIX, diagnostics=(problem.shown,), command=command)
    remark = _remark(problem) if diagnostic.severity is Severity.WARNING else None
    if remark is not None and _helps(problem, remark):
        yield _action(problem, f"Ignore {diagnostic.code} here", [remark])


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
            package, slash, _ = span.text.rpartition("/")
            name = span.at(len(package) + 1, len(span.text))  # in a type with its package
            yield f"Write `{word}`", Edit(name if slash and "/" not in word else span, word)
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


def _helps(problem: Problem, edit: Edit) -> bool:
    """Return whether a check of the text after an edit finds fewer problems."""
    text, _ = apply(edit.span.source.text, [edit])
    before = problem.workspace.snapshot()
    after = problem.workspace.snapshot_with(problem.path, text)
    if before is None or after is None:
        return False
    new, old = ([problem.severity for problem in snapshot.problems] for snapshot in (after, before))
    return (new.count(Severity.ERROR), len(new)) < (old.count(Severity.ERROR), len(old))


def _remark(problem: Problem) -> Edit | None:
    """Return the edit that adds a remark to the line of a problem, or to the head of its file."""
    snapshot = problem.workspace.snapshot()
    if snapshot is None or problem.path not in snapshot.interfaces:
        return None
    source = snapshot.interfaces[problem.path][1]
    code, span = problem.diagnostic.code, problem.diagnostic.span
    if span is None or not span.text:
        return Edit(Span(source, 0, 0), f"# idlc: ignore[{code}] TODO: reason\n")
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
    return Edit(Span(source, end, start + len(line)), f"{sign}idlc: ignore({code}) TODO: reason")


# Commands.

#: Problems, and packages, that a message names.
NAMED = 5
_ERROR, _INFO = 1, 3


def execute(state: ServerState, params: parts.CommandParams) -> None:
    """Run a command."""
    match params.command, *params.arguments:
        case protocol.ADD_DEPENDENCY, str(uri), str(package):
            state.notice_changes()  # or the edit may be of an older package.xml
            context = state.context(uri)
            facts = context.workspace.facts(context.path) if context else None
            edit = dependency(facts, package) if facts else None
            if context and edit:
                change = workspace_edit(by_uri([edit], context.workspace.folder, state), state)
                state.ask("workspace/applyEdit", {"label": f"declare {package}", "edit": change})
        case protocol.RENAME_FILE, str(uri), str(new):
            state.forget()
            context = state.context(uri)
            renaming = rename_interface(context, new, context) if context else None
            if renaming is not None:
                state.ask("workspace/applyEdit", {"label": f"rename to {new}", "edit": renaming})
        case protocol.UPDATE_GENERATED, str(uri):
            _update(state, uri)
        case _:
            raise RequestError(INVALID_PARAMS, f"there is no command `{params.command}` for these")


def _generation(state: ServerState, uri: str) -> tuple[Run | None, Inputs | None, str]:
    """Return the run that a document is an input of, its package, and its name in that."""
    from idlc.tasks.gen import run_for

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
        raise RequestError(REQUEST_FAILED, "set `out` in [tool.idlc] to generate the package")
    unsaved = []
    for document in state.documents.values():
        context = state.context(document.uri)
        is_input = context is not None and context.interface.name.package == inputs.package
        if is_input and document.path and not document.is_on_disk():
            unsaved.append(f"`{document.path.name}`")
    if unsaved:
        names = first_few(sorted(unsaved), NAMED)
        raise RequestError(
            REQUEST_FAILED, f"save first, because idlc compiles the files on disk: {names}"
        )
    report = Report()
    kind = _INFO
    try:
        generated = run.make(report)
        outcomes = (f"{each.package}: {each.changes} in {each.out}" for each in generated)
        message = f"idlc gen: {first_few(outcomes, NAMED)}"
    except OSError as error:
        raise RequestError(REQUEST_FAILED, f"nothing was generated: {error}") from error
    except ReportedError:
        kind = _ERROR
        texts = (f"{each.where[0]}: {each.code}: {each.message}" for each in report.errors)
        message = f"idlc gen: nothing was written: {first_few(texts, NAMED)}"
    state.forget()
    state.notify("window/showMessage", {"type": kind, "message": message})


# Formatting, as `idlc fmt` does it.


def format_document(context: InterfaceContext, _: parts.DocumentParams) -> list[parts.TextEdit]:
    """Return the edits that format a document; none where it has syntax errors."""
    old = context.source.text
    new = laid_out(context.source, context.interface.name, Report())
    return [] if new is None else differences(old, new, context.state.encoding)


def format_range(context: InterfaceContext, params: parts.RangeParams) -> list[parts.TextEdit]:
    """Return those edits that touch the lines of a range."""
    first, last = params.range.start.line, params.range.end.line
    if params.range.end.character == 0 and last > first:
        last -= 1
    return [
        edit
        for edit in format_document(context, params)
        if edit.range.start.line <= last and max(edit.range.end.line - 1, first) >= first
    ]


def format_typed(context: InterfaceContext, params: parts.PositionParams) -> list[parts.TextEdit]:
    """Return those edits that touch the line before the one that was begun."""
    before = params.position.line - 1
    return [
        edit
        for edit in format_document(context, params)
        if edit.range.start.line == before == edit.range.end.line - 1
    ]
