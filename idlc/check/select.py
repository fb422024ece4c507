"""The selection of warnings by category, code or path. Errors are always reported."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase
from typing import Annotated

import msgspec
from msgspec import Meta

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Report, Severity
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import closest, did_you_mean
from idlc.language import tree
from idlc.language.parse import parse
from idlc.project.settings import Config, TableValue, TextsValue, command_table, read_value


def is_selector(word: str) -> bool:
    """Return whether a word selects any code: `all`, a category, an id, its start or a slug."""
    return any(_means(word, code) for code in codes.CODES.values())


def similar_selector(word: str) -> str:
    """Return the hint for a word that selects no code."""
    known = [*codes.CATEGORIES, *(code.slug for code in codes.CODES.values())]
    return did_you_mean(word, known) or "`idlc explain` lists the codes"


def _means(word: str, code: codes.DiagnosticCode) -> bool:
    named = codes.find(word)
    if named is not None:
        return named is code
    beginning = word.upper()
    begins = beginning.startswith("IDL") and code.id.startswith(beginning)
    return begins or word in ("all", code.category)


class RuleSelection(msgspec.Struct, frozen=True):
    """The selected codes; `select` replaces the default ones, `ignore` removes some.

    `per_path` are pairs of a path, in which `*` and `?` match any text, and the codes to ignore
    there.
    """

    select: tuple[str, ...] | None = None
    ignore: tuple[str, ...] = ()
    per_path: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def with_lists(self, select: str | None, ignore: str | None) -> RuleSelection:
        """Return the selection changed by comma-separated lists from the command line."""
        chosen = tuple(select.split(",")) if select else self.select
        ignored = (*self.ignore, *(ignore.split(",") if ignore else ()))
        return RuleSelection(chosen, ignored, self.per_path)

    def has(self, code: codes.DiagnosticCode) -> bool:
        """Return whether a code is switched on."""
        words = self.select
        chosen = code.default if words is None else any(_means(word, code) for word in words)
        return chosen and not any(_means(word, code) for word in self.ignore)

    def wants(self, diagnostic: Diagnostic) -> bool:
        """Return whether a problem is to be shown."""
        code = codes.CODES[diagnostic.code]
        if diagnostic.severity is Severity.ERROR or code is codes.IGNORE_WITHOUT_REASON:
            return True
        path = diagnostic.where[0]
        return self.has(code) and not any(
            any(_means(word, code) for word in ignored)
            for pattern, ignored in self.per_path
            if fnmatchcase(path, pattern) or fnmatchcase(path, f"*/{pattern}")
        )


# the lengths are bounded, or a long comment without an end would take forever
REMARK = r"idlc:\s{0,20}ignore\s{0,20}[\[(]([^\])]{0,200})[\])]\s*(.*)"
_ANY_REMARK = re.compile(r"#\s{0,20}idlc:\s{0,20}(\w{1,40})(\s{0,20}(?:[\[(]|$))?")
#: Each remark, as a hint shows it.
_FORMS = {"enum": "idlc: enum", "ignore": "idlc: ignore[CODE] REASON"}


class Remark(msgspec.Struct, frozen=True):
    """One code that a remark names; `line` is the one it applies to, `None` for the file."""

    code: str
    reason: str
    span: Span
    line: int | None
    edit: Edit | None

    def silences(self, diagnostic: Diagnostic) -> bool:
        """Return whether the remark applies to a problem."""
        if diagnostic.code != self.code or diagnostic.severity is Severity.ERROR or not self.reason:
            return False
        if diagnostic.span is None:
            return self.line is None and diagnostic.path == self.span.source.path
        if diagnostic.span.source.path != self.span.source.path:
            return False
        return self.line in (None, diagnostic.span.corners[0])


def without_ignored(
    diagnostics: Iterable[Diagnostic], sources: Iterable[Source]
) -> Iterator[Diagnostic]:
    """Yield the problems that no remark silences, then the problems of remarks."""
    remarks = [remark for source in sources for remark in _remarks(source)]
    used: set[int] = set()
    for diagnostic in diagnostics:
        silent = {at for at, remark in enumerate(remarks) if remark.silences(diagnostic)}
        used |= silent
        if not silent:
            yield diagnostic
    for at, remark in enumerate(remarks):
        if not remark.reason:
            message = f"the comment does not give a reason to ignore `{remark.code}`"
            hint = f"write a reason after the code: `ignore[{remark.code}] REASON`"
            yield codes.IGNORE_WITHOUT_REASON.at(remark.span, message, hint=hint)
        elif at not in used:
            code = codes.CODES.get(remark.code)
            if code is None:
                message = f"no such code: `{remark.code}`"
            elif code.severity is Severity.ERROR:
                message = f"`{remark.code}` is an error, which you cannot ignore"
            else:
                message = f"unused `ignore` comment: idlc does not report `{remark.code}` here"
            hint, edits = "remove the unused `ignore`", (remark.edit,) if remark.edit else ()
            yield codes.UNUSED_IGNORE.at(remark.span, message, hint=hint, edits=edits)
    for source in sources:
        yield from _unknown_remarks(source)


def _unknown_remarks(source: Source) -> Iterator[Diagnostic]:
    if "idlc:" not in source.text:
        return
    for line in (line for section in parse(source).sections for line in section.lines):
        match = _ANY_REMARK.match(line.comment)
        if not match or match[1] == "enum" or re.search(REMARK, line.comment):
            continue
        near = closest(match[1], _FORMS)
        if not near and match[2] is None:
            continue  # a sentence
        start = line.start + len(line.code)
        forms = [_FORMS[near]] if near else _FORMS.values()
        yield codes.UNKNOWN_REMARK.at(
            Span(source, start + match.start(1), start + match.end(1)),
            f"`idlc: {match[1]}` is not a comment that idlc supports",
            hint=f"write {' or '.join(f'`# {form}`' for form in forms)}",
        )


def switched_off(diagnostic: Diagnostic, selection: RuleSelection) -> bool:
    """Return whether an unused remark names a rule that did not run."""
    if diagnostic.code != codes.UNUSED_IGNORE.id or diagnostic.span is None:
        return False
    code = codes.find(diagnostic.span.text)
    return code is not None and code.severity is not Severity.ERROR and not selection.has(code)


def _remarks(source: Source) -> Iterator[Remark]:
    if "idlc:" not in source.text:
        return
    for number, section in enumerate(parse(source).sections):
        in_head = number == 0
        waiting: list[Remark] = []
        for line in section.lines:
            in_head = in_head and bool(line.comment) and not line.code
            line_number, _ = source.position(line.start)
            in_line = list(_in_line(source, line, line_number, in_head))
            if line.definition:
                yield from in_line
                yield from (msgspec.structs.replace(remark, line=line_number) for remark in waiting)
                waiting = []
            elif in_head:
                yield from in_line
            else:
                waiting += in_line
        yield from waiting


def _in_line(source: Source, line: tree.Line, number: int, in_head: bool) -> Iterator[Remark]:
    match = re.search(REMARK, line.comment)
    if match is None:
        return
    start = line.start + len(line.code)
    listed = re.finditer(r"[^\s,]+", match.group(1))
    names = [(word.group(), start + match.start(1) + word.start()) for word in listed]
    edit = None
    if len(names) == 1 and not line.comment[: match.start()].strip("# \t"):  # nothing else is said
        code_end = len(line.code.rstrip())
        end = start + len(line.comment) + (0 if code_end else len(line.newline))
        edit = Edit(Span(source, line.start + code_end, min(end, len(source.text))), "")
    for name, at in names:
        span = Span(source, at, at + len(name))
        named = codes.find(name)
        code = named.id if named else name
        yield Remark(code, match.group(2).strip(), span, None if in_head else number, edit)


class CheckSettings(msgspec.Struct, frozen=True, rename="kebab"):
    """`[tool.idlc.check]`; without `select`, the default codes apply."""

    select: Annotated[tuple[str, ...] | None, Meta(title="a list of strings")] = None
    ignore: TextsValue = ()
    per_path: TableValue = {}


def selection(config: Config, report: Report) -> RuleSelection:
    """Return the selection in `[tool.idlc.check]`."""
    table, place = command_table(config, "check", CheckSettings, report)
    if place is None:
        return RuleSelection()
    paths = place._replace(table=f"{place.table}.per-path", shown=f"[{place.table}.per-path]")
    per_path = {
        path: read_value(words, TextsValue, path, paths, report) or ()
        for path, words in table.per_path.items()
    }
    lists = [(place, "select", table.select or ()), (place, "ignore", table.ignore)]
    for where, key, words in (*lists, *((paths, *entry) for entry in per_path.items())):
        for word in words:
            if not is_selector(word):
                message = f"`{key}` in {where.shown} contains `{word}`, which is not a rule"
                where.wrong(key, message, report, similar_selector(word))
    return RuleSelection(table.select, table.ignore, tuple(per_path.items()))
