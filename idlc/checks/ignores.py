"""Remarks in interface files that silence a warning: `# idlc: ignore[IDL405] why`.

After a definition such a remark is about that line, on a line of its own about the next
definition, and at the head of a file about the whole file. A reason is mandatory, and a remark
that silences nothing is reported.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import msgspec

from idlc.checks.select import Selection
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Severity
from idlc.diagnostics.source import Source, Span
from idlc.syntax import tree
from idlc.syntax.parse import parse

# the lengths are bounded, or a long comment without an end would take for ever
REMARK = r"idlc:\s{0,20}ignore\s{0,20}[\[(]([^\])]{0,200})[\])]\s*(.*)"


class Remark(msgspec.Struct, frozen=True):
    """One code that a remark names; `lines` are those that it is about, `None` for the file."""

    code: str
    reason: str
    span: Span
    lines: frozenset[int] | None
    edit: Edit | None

    def silences(self, found: Diagnostic) -> bool:
        """Return whether a problem is what the remark is about."""
        if found.code != self.code or found.severity is Severity.ERROR or not self.reason:
            return False
        if found.span is None:
            return self.lines is None and found.path == self.span.source.path
        if found.span.source.path != self.span.source.path:
            return False
        line, _ = found.span.source.position(found.span.start)
        return self.lines is None or line in self.lines


def without_ignored(found: Iterable[Diagnostic], sources: Iterable[Source]) -> Iterator[Diagnostic]:
    """Yield the problems that no remark silences, then what is wrong with remarks."""
    remarks = [remark for source in sources for remark in _remarks(source)]
    used: set[int] = set()
    for one in found:
        silent = {at for at, remark in enumerate(remarks) if remark.silences(one)}
        used |= silent
        if not silent:
            yield one
    for at, remark in enumerate(remarks):
        if not remark.reason:
            yield codes.IGNORE_WITHOUT_REASON.at(
                remark.span,
                f"this does not say why `{remark.code}` is ignored",
                hint=f"write the reason after it: `ignore[{remark.code}] REASON`",
            )
        elif at not in used:
            yield _unused(remark)


def _unused(remark: Remark) -> Diagnostic:
    known = codes.CODES.get(remark.code)
    if known is None:
        message = f"there is no code `{remark.code}`"
    elif known.severity is Severity.ERROR:
        message = f"`{remark.code}` is an error, which cannot be ignored"
    else:
        message = f"there is no `{remark.code}` here to ignore"
    found = codes.UNUSED_IGNORE.at(remark.span, message, hint="remove the remark")
    return msgspec.structs.replace(found, edits=(remark.edit,)) if remark.edit else found


def switched_off(found: Diagnostic, selection: Selection) -> bool:
    """Return whether an unused remark is about a rule that was not asked."""
    if found.code != codes.UNUSED_IGNORE.id or found.span is None:
        return False
    known = codes.find(found.span.text)
    if known is None or known.severity is Severity.ERROR:
        return False
    return not selection.has(known)


def _remarks(source: Source) -> Iterator[Remark]:
    if "idlc:" not in source.text:
        return
    file = parse(source)
    for number, section in enumerate(file.sections):
        in_head = number == 0
        waiting: list[Remark] = []
        for line in section.lines:
            in_head = in_head and bool(line.comment) and not line.code
            here, _ = source.position(line.start)
            found = list(_in_line(source, line, here, in_head))
            if not line.definition and not in_head:
                waiting += found
            else:
                yield from found
            if line.definition:
                lines = frozenset({here})
                yield from (msgspec.structs.replace(one, lines=lines) for one in waiting)
                waiting = []
        yield from waiting


def _in_line(source: Source, line: tree.Line, number: int, in_head: bool) -> Iterator[Remark]:
    match = re.search(REMARK, line.comment)
    if match is None:
        return
    start = line.start + len(line.code)
    listed = re.finditer(r"[^\s,]+", match.group(1))
    names = [(word.group(), start + match.start(1) + word.start()) for word in listed]
    edit = _removal(source, line, match) if len(names) == 1 else None
    for name, at in names:
        span = Span(source, at, at + len(name))
        lines = None if in_head else frozenset({number})
        known = codes.find(name)
        code = known.id if known else name
        yield Remark(code, match.group(2).strip(), span, lines, edit)


def _removal(source: Source, line: tree.Line, match: re.Match[str]) -> Edit | None:
    """Return the edit that removes a comment that is nothing but the remark."""
    if line.comment[: match.start()].strip("# \t"):
        return None
    code = len(line.code.rstrip())
    end = line.start + len(line.code) + len(line.comment)
    if not code:
        end += len(line.newline)
    return Edit(Span(source, line.start + code, min(end, len(source.text))), "")
