"""Actions on problems: fixes, other words, and remarks that silence them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from idlc.check.run import tidied
from idlc.check.select import REMARK
from idlc.diagnostics.report import Diagnostic, Edit, Severity, apply
from idlc.diagnostics.source import Span
from idlc.editor.elements import differences, of_documents, workspace_edit
from idlc.editor.features import commands
from idlc.editor.features.rename import can_move_files
from idlc.editor.protocol.capabilities import RENAME_FILE, UPDATE_KIND
from idlc.editor.protocol.parts import AskedActions, Part, Range
from idlc.editor.publish import Shown, problems, shown
from idlc.editor.state import ServerState
from idlc.editor.workspace import Snapshot

_FIX, _FIX_ALL, _UPDATE = "quickfix", "source.fixAll.idlc", UPDATE_KIND
#: Hints that name what should stand there instead.
_MEANT = re.compile(r"(?:did you mean|write|use) `")
#: Hints that name what a file should be called.
_OTHER_FILE = re.compile(r"call it `((\w+)\.\w+)`")
#: Of the names in a hint, so many are tried.
MOST = 3


class Action(Part, frozen=True):
    """Something that can be done."""

    title: str
    kind: str
    edit: dict[str, object] | None = None
    diagnostics: tuple[Shown, ...] = ()
    is_preferred: bool = False
    command: dict[str, object] | None = None


class Guilty(NamedTuple):
    """A problem of a document."""

    problem: Diagnostic
    snapshot: Snapshot
    path: Path
    state: ServerState

    @property
    def shown(self) -> Shown:
        """The problem as the client has it."""
        return shown(self.problem, self.snapshot, self.state)

    def action(self, title: str, edits: Iterable[Edit], *, best: bool = False) -> Action:
        """Return an action on this problem."""
        change = workspace_edit(edits, self.snapshot, self.state)
        return Action(title, _FIX, change, (self.shown,), best)


def actions(state: ServerState, asked: AskedActions) -> list[Action]:
    """Return what can be done about the problems in a range, and about all of a document."""
    state.notice_changes()  # or edits may be of older files
    path = state.path(asked.text_document.uri)
    all_ = [Guilty(one, snapshot, at, state) for at, one, snapshot in problems(state) if at == path]
    found: list[Action] = []
    if _wanted(_FIX, asked.context.only):
        for one in all_:
            if _touch(one.shown.range, asked.range):
                found += _about(one)
    if _wanted(_FIX_ALL, asked.context.only) and path is not None:
        found += _everything(all_, asked.text_document.uri, state)
    if _wanted(_UPDATE, asked.context.only):
        command = commands.command(state, asked.text_document.uri)
        found += [Action(str(command["title"]), _UPDATE, command=command)] if command else []
    return found


def _wanted(kind: str, only: tuple[str, ...] | None) -> bool:
    return only is None or any(f"{kind}.".startswith(f"{one}.") for one in only)


def _touch(one: Range, other: Range) -> bool:
    places = ((end.line, end.character) for end in (one.start, one.end, other.start, other.end))
    start, end, first, last = places
    return start <= last and first <= end


def _about(one: Guilty) -> Iterator[Action]:
    problem = one.problem
    if problem.edits:
        hint = problem.hint or f"fix {problem.code}"
        yield one.action(hint[:1].upper() + hint[1:], problem.edits, best=True)
    elif problem.span is not None:
        best = bool(_MEANT.match(problem.hint or ""))
        for title, edit in _offers(problem.hint or "", problem.span):
            if _helps(one, edit):
                yield one.action(title, [edit], best=best)
    if can_move_files(one.state) and (moved := _moved(one)):
        yield moved
    remark = _remark(one) if problem.severity is Severity.WARNING else None
    if remark is not None and _helps(one, remark):
        yield one.action(f"Ignore {problem.code} here", [remark])


def _moved(one: Guilty) -> Action | None:
    """Return the action that gives a file the name that a hint says, if nothing has it."""
    hint = _OTHER_FILE.match(one.problem.hint or "")
    if hint is None or os.path.lexists(one.path.with_name(hint[1])):
        return None
    title = f"Rename the file to `{hint[1]}`"
    arguments = [one.state.uri(one.path), hint[2]]
    command: dict[str, object] = {"title": title, "command": RENAME_FILE, "arguments": arguments}
    return Action(title, _FIX, diagnostics=(one.shown,), command=command)


def _offers(hint: str, span: Span) -> Iterator[tuple[str, Edit]]:
    """Yield edits that a hint may mean, with their titles; some do not help.

    A text in backticks stands for the span; if it has several words, for the line's definition.
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
    """Return the edit that puts a word in the place of a span, or of the name in a type."""
    package, slash, _ = span.text.rpartition("/")
    if slash and "/" not in word:
        span = span.at(len(package) + 1, len(span.text))
    return Edit(span, word)


def _helps(one: Guilty, edit: Edit) -> bool:
    """Return whether there is less wrong after an edit, as a check of the new text says."""
    workspace = one.state.workspace_of(one.path)
    text, _ = apply(edit.span.source.text, [edit])
    after = workspace.snapshot_with(one.path, text) if workspace else None
    if after is None:
        return False
    before = _count(one.snapshot.problems)
    return _count(after.problems) < before


def _count(found: Iterable[Diagnostic]) -> tuple[int, int]:
    """Return how many errors there are, and how many problems."""
    severities = [one.severity for one in found]
    return severities.count(Severity.ERROR), len(severities)


def _remark(one: Guilty) -> Edit | None:
    """Return the edit that adds a remark to the line of a problem, or to the head of its file."""
    if one.path not in one.snapshot.interfaces:
        return None
    source = one.snapshot.interfaces[one.path][1]
    code, span = one.problem.code, one.problem.span
    if span is None or not span.text:
        return Edit(Span(source, 0, 0), f"# idlc: ignore[{code}] TODO: say why\n")
    number, _ = source.position(span.start)
    start, line = source.line_starts[number - 1], source.line_text(number)
    comment = line.find("#")
    known = re.search(REMARK, line[comment:]) if comment >= 0 else None
    if known is not None:
        at = start + comment + known.end(1)
        return Edit(Span(source, at, at), f", {code}")
    end = start + len(line.rstrip())
    sign = "  # " if comment < 0 else " "
    # with square brackets, ROS 2 would take it for the unit
    return Edit(Span(source, end, start + len(line)), f"{sign}idlc: ignore({code}) TODO: say why")


def _everything(all_: list[Guilty], uri: str, state: ServerState) -> Iterator[Action]:
    """Yield the action that makes every fix of a document, as `idlc check --fix` does."""
    fixed = [one for one in all_ if one.problem.edits]
    edits = [
        edit
        for one in fixed
        for edit in one.problem.edits
        if one.snapshot.path_of(edit.span.source) == one.path
    ]
    if not edits:
        return
    old = edits[0].span.source
    new = tidied(old.path, old.text, apply(old.text, edits)[0])
    change = of_documents({uri: differences(old.text, new, state.encoding)}, state)
    title = "Fix all that can be fixed without harm"
    yield Action(title, _FIX_ALL, change, tuple(one.shown for one in fixed))
