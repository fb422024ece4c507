"""Diagnostics as values: what is wrong, where, and what to do about it.

Passes append to one `Report`; nothing here prints, raises or knows a file system.
Messages are lower-case, without a final stop, with the user's words in backticks.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator, Mapping, Sequence

import msgspec

from idlc.diagnostics.source import Span


class Severity(enum.IntEnum):
    """How bad it is: an error rejects the file, a warning does not."""

    ERROR = 0
    WARNING = 1


class Label(msgspec.Struct, frozen=True):
    """A second place that explains the first, such as an earlier definition."""

    span: Span
    text: str


class Edit(msgspec.Struct, frozen=True):
    """A replacement that fixes a problem and does no harm."""

    span: Span
    text: str


class Diagnostic(msgspec.Struct, frozen=True, kw_only=True):
    """One problem.

    `span` is the smallest guilty piece; a problem with a whole file or folder has none
    and names it in `path`. `hint` is something to do, in the imperative or as a question.
    `detail` is preformatted text of several lines, such as a diff.
    `levels` is what a change between two versions breaks, `edits` is what `check --fix` does.
    `distros` are the distributions of ROS 2 that it holds for, where not for all that were asked.
    `place` is the file that services show if `path` is none, such as one that was removed.
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
        """The file of a repository that it is about."""
        return self.place or (self.span.source.file if self.span else self.path)

    @property
    def within(self) -> str:
        """Where it is, in words, if that is no place in its file."""
        return f"in {self.where[0]}" if self.file != self.where[0] else ""

    @property
    def breaks(self) -> str:
        """What it breaks, in words, such as `breaks: wire, hash`; empty if it does not say."""
        return f"breaks: {', '.join(self.levels)}" if self.levels else ""

    @property
    def holds_for(self) -> str:
        """The distributions that it holds for, in words; empty if for all that were asked."""
        return f"for: {', '.join(self.distros)}" if self.distros else ""

    @property
    def identity(self) -> tuple[str, str, int, int, str]:
        """What two reports of the same problem have in common: code and place."""
        path, start = self.where
        end = self.span.end if self.span else -1
        # what is gone has no place of its own
        about = "" if self.span and not self.levels else self.message
        return path, self.code, start, end, about


class Report:
    """The problems of one run, one per cause: the same code at the same place counts once.

    `notes` are no problems: what was assumed or left out, for commands that tell it.
    """

    def __init__(self) -> None:
        self._found: dict[tuple[str, str, int, int, str], Diagnostic] = {}
        self._had_errors = False
        self.notes: list[str] = []

    def add(self, diagnostic: Diagnostic) -> None:
        """Add a problem unless the same code already stands at the same place."""
        self._found.setdefault(diagnostic.identity, diagnostic)
        self._had_errors = self._had_errors or diagnostic.severity is Severity.ERROR

    def extend(self, diagnostics: Iterable[Diagnostic]) -> None:
        """Add several problems."""
        for diagnostic in diagnostics:
            self.add(diagnostic)

    def __iter__(self) -> Iterator[Diagnostic]:
        """Yield problems by file, place and code."""
        return iter(sorted(self._found.values(), key=lambda found: (found.where, found.code)))

    def __len__(self) -> int:
        return len(self._found)

    @property
    def had_errors(self) -> bool:
        """Whether any problem rejects its file."""
        return self._had_errors


def enumerated(texts: Sequence[str]) -> str:
    """Return texts as a sentence lists them: `a`, `a and b`, `a, b and c`."""
    return " and ".join(filter(None, (", ".join(texts[:-1]), *texts[-1:])))


def first_few(texts: Iterable[str], most: int) -> str:
    """Return the first texts of a list, for a sentence, and how many more there are."""
    found = list(texts)
    shown = ", ".join(found[:most])
    return f"{shown} and {len(found) - most} more" if len(found) > most else shown


def merged(runs: Mapping[str, Report]) -> Report:
    """Return the problems of runs for several distributions, each once.

    Those that were not found in every run say in which.
    """
    first: dict[object, Diagnostic] = {}
    names: dict[object, list[str]] = {}
    together = Report()
    for name, report in runs.items():
        for one in report:
            first.setdefault(one.identity, one)
            names.setdefault(one.identity, []).append(name)
    for identity, one in first.items():
        everywhere = len(names[identity]) == len(runs)
        distros = () if everywhere else tuple(names[identity])
        together.add(msgspec.structs.replace(one, distros=distros))
    return together


def without_overruled(found: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """Yield problems without advice for some distributions on lines that others refuse."""
    errors = (one for one in found if one.severity is Severity.ERROR)
    refused = {place for one in errors for place in _line(one)}
    for one in found:
        advice = one.distros and one.severity is Severity.WARNING
        if not (advice and refused.intersection(_line(one))):
            yield one


def _line(found: Diagnostic) -> Iterable[tuple[str, int]]:
    """Return the file and line of a problem, if it has one."""
    if found.span is None:
        return ()
    return ((found.span.source.path, found.span.source.position(found.span.start)[0]),)


def apply(text: str, edits: Iterable[Edit]) -> tuple[str, int]:
    """Return a text with edits made, and how many; one that overlaps an earlier one is left out."""
    parts: list[str] = []
    at = done = 0
    for edit in sorted(dict.fromkeys(edits), key=lambda one: (one.span.start, one.span.end)):
        if edit.span.start < at:
            continue
        parts += [text[at : edit.span.start], edit.text]
        at = edit.span.end
        done += 1
    return "".join([*parts, text[at:]]), done
