"""A report as text with source lines and carets, or as JSON lines.

In: diagnostics. Out: strings. Colour and width are arguments, not looked up here. Text from
files is made harmless first: no control character, terminal escape or invisible character of
a file reaches the terminal as itself.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import TypeAlias

import msgspec

from idlc.diagnostics.codes import CODES
from idlc.diagnostics.report import Diagnostic, Severity
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import display_width, one_line, visible

LIMIT = 100
#: More problems than these end with a count for each code, and warnings that repeat are cut.
MANY = 10
#: Warnings of one code that are shown whole then; the others get a line each.
REPEATS = 3
LINE_WIDTH = 100
TEXT_WIDTH = 1000
BEFORE_CARET = 40
#: Shows how much of something is done: its name, the bytes done, and all bytes.
Progress: TypeAlias = Callable[[str, int, int], object]

_STYLES = {
    "error": "1;31",
    "warning": "1;33",
    "hint": "1;36",
    "frame": "94",
    "bold": "1",
    "good": "32",
    "bad": "31",
    "type": "36",
    "value": "33",
    "comment": "2",
}

Paint: TypeAlias = Callable[[str, str], str]


def painter(*, colour: bool) -> Paint:
    """Return the function that gives a text a style, or that returns it as it is."""
    if not colour:
        return lambda _, text: text
    return lambda style, text: f"\x1b[{_STYLES[style]}m{text}\x1b[0m" if text else ""


class _Mark(msgspec.Struct, frozen=True):
    """A stretch of one line to underline; `start` and `end` are characters from its start."""

    source: Source
    line: int
    start: int
    end: int
    sign: str
    text: str


def text(
    diagnostics: Iterable[Diagnostic], *, colour: bool = False, fixable: bool = False
) -> Iterator[str]:
    """Yield each problem as a block of lines, repeated warnings as a list of lines.

    With `fixable`, `[*]` marks each problem with an edit. The last block counts the problems
    beyond `LIMIT`.
    """
    paint = painter(colour=colour)
    diagnostics = list(diagnostics)
    if len(diagnostics) > LIMIT:  # no error is left out for a warning
        diagnostics.sort(key=lambda diagnostic: diagnostic.severity)
    repeats = REPEATS if len(diagnostics) > MANY else MANY
    shown: Counter[str] = Counter()
    repeated: list[str] = []
    for diagnostic in diagnostics[:LIMIT]:
        shown[diagnostic.code] += 1
        if diagnostic.severity is Severity.WARNING and shown[diagnostic.code] > repeats:
            repeated.append(_line(diagnostic, paint, fixable))
        else:
            yield "\n".join(_block(diagnostic, paint, fixable)) + "\n"
    if repeated:
        yield "\n".join(("more of these warnings:", *repeated)) + "\n"
    if len(diagnostics) > LIMIT:
        yield f"… and {len(diagnostics) - LIMIT} more; fix the first ones and run again\n"


def _star(diagnostic: Diagnostic, paint: Paint, fixable: bool) -> str:
    return f"{paint('hint', '[*]')} " if fixable and diagnostic.edits else ""


def _line(diagnostic: Diagnostic, paint: Paint, fixable: bool) -> str:
    """Return a problem on one line."""
    span = diagnostic.span
    place = _place(_mark(span, "", "")) if span else one_line(diagnostic.path)
    code = paint(diagnostic.severity.name.lower(), diagnostic.code)
    only = f" ({diagnostic.holds_for})" if diagnostic.distros else ""
    message = f"{_star(diagnostic, paint, fixable)}{one_line(_shortened(diagnostic.message))}"
    return f"  {place}: {code} {message}{only}"


def statistics(diagnostics: Iterable[Diagnostic]) -> Iterator[str]:
    """Yield a line for each reported code, the most frequent first."""
    counts = Counter(sorted(diagnostic.code for diagnostic in diagnostics)).most_common()
    width = len(str(counts[0][1])) if counts else 0
    for code, number in counts:
        yield f"{number:>{width}}  {code} {CODES[code].slug}\n"


def _block(diagnostic: Diagnostic, paint: Paint, fixable: bool) -> Iterator[str]:
    level = diagnostic.severity.name.lower()
    head = paint(level, f"{level}[{diagnostic.code}]")
    message = paint("bold", one_line(_shortened(diagnostic.message)))
    yield f"{head}: {_star(diagnostic, paint, fixable)}{message}"
    marks = [_mark(diagnostic.span, "^", "")] if diagnostic.span else []
    if marks:
        marks += [_mark(label.span, "-", label.text) for label in diagnostic.labels]
    margin = " " * max((len(str(mark.line)) for mark in marks), default=1)
    if marks:
        yield from _snippets(marks, margin, level, paint)
    elif diagnostic.path:
        yield f"{margin}{paint('frame', '-->')} {one_line(diagnostic.path)}"
    if diagnostic.detail:
        bar = f"{margin} {paint('frame', '|')}"
        yield bar
        lines = map(_shortened, diagnostic.detail.split("\n"))
        yield from (f"{bar} {visible(line)}".rstrip() for line in lines)
    facts = {
        "breaks": ", ".join(diagnostic.levels),
        "for": ", ".join(diagnostic.distros),
        "hint": one_line(_shortened(diagnostic.hint or "")),
    }
    for label, fact in facts.items():
        if fact:
            yield f"{margin} {paint('frame', '=')} {paint('hint', label)}: {fact}"


def _shortened(text: str) -> str:
    """Return a text without its middle if it is too long to read."""
    return text if len(text) <= TEXT_WIDTH else f"{text[: TEXT_WIDTH - 200]} … {text[-100:]}"


def _mark(span: Span, sign: str, label: str) -> _Mark:
    """Return the part of a span on its first line; at least one column."""
    line, column = span.source.position(span.start)
    start = min(column - 1, len(span.source.line_text(line)))
    end = min(start + span.end - span.start, len(span.source.line_text(line)))
    return _Mark(span.source, line, start, max(end, start), sign, label)


def _snippets(marks: list[_Mark], margin: str, level: str, paint: Paint) -> Iterator[str]:
    """Yield the lines of a problem, file by file, the file of the first mark first."""
    bar = paint("frame", "|")
    sources = list(dict.fromkeys(mark.source for mark in marks))
    for source in sources:
        own = [mark for mark in marks if mark.source is source]
        arrow = "-->" if source is sources[0] else ":::"
        yield f"{margin}{paint('frame', arrow)} {_place(own[0])}"
        yield f"{margin} {bar}"
        previous = 0
        for mark in sorted(own, key=lambda mark: mark.line):
            if previous and mark.line > previous + 1:
                yield paint("frame", "...")
            shown, lead, width = _cut(source.line_text(mark.line), mark.start, mark.end)
            if mark.line != previous or len(source.line_text(mark.line)) > LINE_WIDTH:
                number = str(mark.line).rjust(len(margin))
                yield f"{paint('frame', number)} {bar} {shown}".rstrip()
            sign = paint(level if mark.sign == "^" else "frame", mark.sign * width)
            label = f" {one_line(mark.text)}" if mark.text else ""
            yield f"{margin} {bar} {' ' * lead}{sign}{label}"
            previous = mark.line


def _place(mark: _Mark) -> str:
    return f"{one_line(mark.source.path)}:{mark.line}:{mark.start + 1}"


def _cut(line: str, start: int, end: int) -> tuple[str, int, int]:
    """Return a line fit for showing, the columns before the mark and the mark's columns."""
    first, last = 0, len(line)
    if last > LINE_WIDTH:
        first = max(0, min(start - BEFORE_CARET, last - LINE_WIDTH))
        last = min(last, first + LINE_WIDTH)
    before = visible(("…" if first else "") + line[first:start])
    lead = display_width(before)
    marked = visible(line[start : min(end, last)], lead)
    width = display_width(marked)
    after = visible(line[min(end, last) : last], lead + width)
    return before + marked + after + ("…" if last < len(line) else ""), lead, max(width, 1)


def summary(diagnostics: Iterable[Diagnostic]) -> str:
    """Return the closing line, such as `2 errors, 1 warning in 3 files`."""
    reported = list(diagnostics)
    errors = sum(diagnostic.severity is Severity.ERROR for diagnostic in reported)
    numbers = {"error": errors, "warning": len(reported) - errors}
    parts = [counted(number, noun) for noun, number in numbers.items() if number]
    files = len({diagnostic.where[0] for diagnostic in reported})
    return f"{', '.join(parts)} in {counted(files, 'file')}" if parts else "no problems"


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, in the plural where needed."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def json_lines(diagnostics: Iterable[Diagnostic]) -> Iterator[str]:
    """Yield each problem as a JSON object on a line of its own, ASCII only."""
    import json

    for diagnostic in diagnostics:
        labels = diagnostic.labels
        facts = {
            "type": "diagnostic",
            "code": diagnostic.code,
            "slug": CODES[diagnostic.code].slug,
            "severity": diagnostic.severity.name.lower(),
            "message": diagnostic.message,
            **_range(diagnostic.span, diagnostic.path),
            "hint": diagnostic.hint,
            "detail": diagnostic.detail or None,
            **({"levels": list(diagnostic.levels)} if diagnostic.levels else {}),
            **({"distros": list(diagnostic.distros)} if diagnostic.distros else {}),
            "labels": [{"message": label.text, **_range(label.span, "")} for label in labels],
        }
        yield json.dumps(facts) + "\n"


def _range(span: Span | None, path: str) -> dict[str, object]:
    corners = span.corners if span else (None,) * 4
    places = zip(("line", "column", "end_line", "end_column"), corners, strict=True)
    return {"path": span.source.path if span else path, **dict(places)}
