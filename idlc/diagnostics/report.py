"""Diagnostics as values: a problem, its location, and a hint.

Passes append to one `Report`; nothing here prints or knows a file system.
Messages are lower-case, without a final stop, with the user's words in backticks.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator, Mapping, Sequence

import msgspec

from idlc.diagnostics.source import Span


class Severity(enum.IntEnum):
    """The severity of a problem: an error rejects the file, a warning does not."""

    ERROR = 0
    WARNING = 1


class Label(msgspec.Struct, frozen=True):
    """A second location that explains the first, such as an earlier definition."""

    span: Span
    text: str


class Edit(msgspec.Struct, frozen=True):
    """A replacement that fixes a problem and does no harm."""

    span: Span
    text: str


class Diagnostic(msgspec.Struct, frozen=True, kw_only=True):
    """One problem.

    `span` is the smallest range at fault; a problem with a whole file or folder has none
    and names it in `path`. `hint` is something to do, in the imperative or as a question.
    `detail` is preformatted text of several lines, such as a diff.
    `levels` are the levels of compatibility that a change breaks; `check --fix` makes the `edits`.
    `distros` are the distributions of ROS 2 with the problem, where others were checked, too.
    `place` is the file that services show if `path` is no file, such as a removed one.
    """

    code: str
    severity: Severity
    message: str
    span: Span | None = None
    path: str = ""
    labels: tuple[Label, ...] = ()
    hint: str | None = None
    detail: str = ""
    levels: tuple[str, ...] = ()
    edits: tuple[Edit, ...] = ()
    distros: tuple[str, ...] = ()
    place: str = ""

    @property
    def where(self) -> tuple[str, int]:
        """The path and offset that order diagnostics."""
        return (self.span.source.path, self.span.start) if self.span else (self.path, -1)

    @property
    def file(self) -> str:
        """The file of a repository that services show it in."""
        return self.place or (self.span.source.file if self.span else self.path)

    @property
    def within(self) -> str:
        """Its location in words, if that is not a range of its file."""
        return f"in {self.where[0]}" if self.file != self.where[0] else ""

    @property
    def breaks(self) -> str:
        """The broken levels in words, such as `breaks: wire, hash`; empty without levels."""
        return f"breaks: {', '.join(self.levels)}" if self.levels else ""

    @property
    def holds_for(self) -> str:
        """The distributions with the problem, in words; empty if all have it."""
        return f"for: {', '.join(self.distros)}" if self.distros else ""

    def sentences(self, *, hint: bool = True) -> list[str]:
        """Return the texts that services show, the message first."""
        advice = self.hint if hint else ""
        parts = (self.message, self.breaks, self.holds_for, advice, self.within)
        return [part for part in parts if part]

    @property
    def identity(self) -> tuple[str, str, int, int, str]:
        """The code and location, which are equal in two reports of the same problem."""
        path, start = self.where
        end = self.span.end if self.span else -1
        # a removed element has no location of its own
        about = "" if self.span and not self.levels else self.message
        return path, self.code, start, end, about


class ReportedError(Exception):
    """A task cannot go on, for reasons that are in its report."""


class Report:
    """The problems of one run, one per cause: the same code at the same location counts once.

    `notes` are no problems: assumptions and omissions, for commands that print them.
    """

    def __init__(self) -> None:
        self._diagnostics: dict[tuple[str, str, int, int, str], Diagnostic] = {}
        #: Whether any problem is an error.
        self.had_errors = False
        self.notes: list[str] = []

    def add(self, diagnostic: Diagnostic) -> None:
        """Add a problem unless the same code was already reported at the same location."""
        self._diagnostics.setdefault(diagnostic.identity, diagnostic)
        self.had_errors |= diagnostic.severity is Severity.ERROR

    def extend(self, diagnostics: Iterable[Diagnostic]) -> None:
        """Add several problems."""
        for diagnostic in diagnostics:
            self.add(diagnostic)

    def refused(self, diagnostic: Diagnostic) -> ReportedError:
        """Add a problem after which the task cannot go on, and return what to raise."""
        self.add(diagnostic)
        return ReportedError()

    def raise_errors(self) -> None:
        """Raise ReportedError if any problem is an error, after a pass has reported all of them."""
        if self.had_errors:
            raise ReportedError

    def __iter__(self) -> Iterator[Diagnostic]:
        """Yield problems by file, offset and code."""
        problems = self._diagnostics.values()
        return iter(sorted(problems, key=lambda problem: (problem.where, problem.code)))

    def __len__(self) -> int:
        return len(self._diagnostics)

    @property
    def errors(self) -> list[Diagnostic]:
        """The problems that are errors, in order."""
        return [problem for problem in self if problem.severity is Severity.ERROR]


def enumerated(texts: Sequence[str]) -> str:
    """Return texts as a sentence lists them: `a`, `a and b`, `a, b and c`."""
    return " and ".join(filter(None, (", ".join(texts[:-1]), *texts[-1:])))


def first_few(texts: Iterable[str], most: int) -> str:
    """Return the first texts of a list, for a sentence, and the number of the others."""
    listed = list(texts)
    shown = ", ".join(listed[:most])
    return f"{shown} and {len(listed) - most} more" if len(listed) > most else shown


def merge(runs: Mapping[str, Report]) -> Report:
    """Return the problems of runs for several distributions, each once.

    A problem that is not in every run names the distributions that have it.
    """
    everywhere: dict[object, list[tuple[str, Diagnostic]]] = {}
    together = Report()
    for name, report in runs.items():
        for diagnostic in report:
            everywhere.setdefault(diagnostic.identity, []).append((name, diagnostic))
    for reported in everywhere.values():
        distros = tuple(name for name, _ in reported) if len(reported) < len(runs) else ()
        together.add(msgspec.structs.replace(reported[0][1], distros=distros))
    return together


def without_overruled(diagnostics: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """Yield problems, without warnings for some distributions on lines that others reject."""
    errors = (diagnostic for diagnostic in diagnostics if diagnostic.severity is Severity.ERROR)
    refused = {place for error in errors for place in _line(error)}
    for diagnostic in diagnostics:
        advice = diagnostic.distros and diagnostic.severity is Severity.WARNING
        if not (advice and refused.intersection(_line(diagnostic))):
            yield diagnostic


def _line(diagnostic: Diagnostic) -> set[tuple[str, int]]:
    """Return the file and line of a problem, if it has one."""
    span = diagnostic.span
    return {(span.source.path, span.corners[0])} if span else set()


def apply(text: str, edits: Iterable[Edit]) -> tuple[str, int]:
    """Return a text with edits made, and their number; overlapping later edits are left out."""
    parts: list[str] = []
    at = done = 0
    for edit in sorted(dict.fromkeys(edits), key=lambda edit: (edit.span.start, edit.span.end)):
        if edit.span.start < at:
            continue
        parts += [text[at : edit.span.start], edit.text]
        at = edit.span.end
        done += 1
    return "".join([*parts, text[at:]]), done
