"""Showing reports to people and to programs, and the exit status that goes with them."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from idlc.cli.streams import colours, written_as
from idlc.diagnostics import codes, terminal
from idlc.diagnostics.ci import Form
from idlc.diagnostics.report import Report
from idlc.diagnostics.terminal import Paint
from idlc.diagnostics.text import display_width, one_line, visible
from idlc.version import __version__

#: The text in our console scripts.
_OURS = b"idlc.cli.main"


def program() -> str:
    """Return `idlc` if that is this program, else another name for it."""
    import shutil

    for name in ("idlc", "rosidlc"):
        path = shutil.which(name)
        with suppress(OSError):
            if path and _OURS in Path(path).read_bytes():
                return name
    return f"{Path(sys.executable).name} -m idlc"


WIDTH = 30
#: Characters of a type hash that people compare.
SHORT = len("RIHS01_") + 8
#: The words of the column `installed`: is the installed type that of the recording or robot?
INSTALLED = {"same": "same", "differs": "different", "unknown": "-"}
#: The titles of columns that are aligned at the right.
NUMBERS = frozenset({"messages", "rate", "size"})


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table; its titles are a row, too."""
    widths = [max(map(display_width, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = []
        for title, text, width in zip(head, row, widths, strict=True):
            space = " " * (width - display_width(text))
            cells.append(space + text if title in NUMBERS else text + space)
        yield "  ".join(cells).rstrip() + "\n"


@contextmanager
def progress_bar(stream: TextIO) -> Iterator[Callable[[str, int, int], None]]:
    """Give a function that updates a progress bar; the bar is erased at the end."""
    if not stream.isatty():
        yield lambda _what, _done, _total: None
        return
    size = 0

    def update(what: str, done: int, total: int) -> None:
        nonlocal size
        full = WIDTH * min(done, total) // max(total, 1)
        line = f"{'█' * full}{'░' * (WIDTH - full)} {done:,} of {total:,}  {one_line(what)[:40]}"
        stream.write(f"\r{line.ljust(size)}")
        stream.flush()
        size = len(line)

    try:
        yield update
    finally:
        stream.write(f"\r{' ' * size}\r")


def painter(stream: TextIO) -> Paint:
    """Return the function that styles text for a stream."""
    return terminal.painter(colour=colours(stream))


def show(report: Report, style: str, stream: TextIO, *, fixable: bool = False) -> None:
    """Write every problem to a stream, as text or as JSON lines; see `terminal.text`."""
    if style == "json":
        with written_as(Form.JSON, stream):
            stream.writelines(terminal.json_lines(report))
    else:
        blocks = terminal.text(report, colour=colours(stream), fixable=fixable)
        stream.writelines([f"{block}\n" for block in blocks])


def show_internal_error(error: Exception) -> None:
    """Write an unexpected exception as IDL901."""
    from idlc.compiler.compiler import internal_error

    report = Report()
    hint = "this is a bug in idlc, please report it; IDLC_DEBUG=1 shows where it happened"
    report.add(internal_error(error, "", hint))
    show(report, "text", sys.stderr)


def usage_error(message: str, hint: str) -> None:
    """Write a problem of the command line or the environment, which has no code."""
    paint = painter(sys.stderr)
    head = f"{paint('error', 'error')}: {paint('bold', one_line(message))}"
    advice = f"{paint('frame', '=')} {paint('hint', 'hint')}: {one_line(hint)}"
    sys.stderr.write(f"{head}\n  {advice}\n")


def diff(path: str, old: str, new: str, stream: TextIO) -> None:
    """Write a unified diff: for a program as it is, for a terminal without control characters."""
    with written_as(Form.EXACT, stream):
        stream.write("".join(_diff(path, old, new, stream)))


def _diff(path: str, old: str, new: str, stream: TextIO) -> Iterator[str]:
    from difflib import unified_diff

    path = one_line(path)
    before, after = old.splitlines(keepends=True), new.splitlines(keepends=True)
    styles, paint = {"+": "good", "-": "bad", "@": "type"}, painter(stream)
    for line in unified_diff(before, after, f"a/{path}", f"b/{path}"):
        text = line.rstrip("\r\n")
        shown = visible(text) if stream.isatty() else text
        style = styles.get(line[:1])
        yield f"{paint(style, shown) if style else shown}\n"
        if not line.endswith(("\n", "\r")):
            yield "\\ No newline at end of file\n"


def notes(report: Report, stream: TextIO) -> None:
    """Write notes, which are not problems."""
    stream.writelines(f"note: {one_line(note)}\n" for note in dict.fromkeys(report.notes))


def fact(stream: TextIO, kind: str, **facts: object) -> None:
    """Write a JSON line that is not a problem."""
    import json

    with written_as(Form.JSON, stream):
        stream.write(json.dumps({"type": kind, **facts}) + "\n")


#: The coloured elements of an interface; quoted text is first, because it may contain `#`.
_ELEMENTS = re.compile(
    r"""(?mx) (?P<value> '(?:[^'\\\n]|\\.)*' | "(?:[^"\\\n]|\\.)*" )
    | (?P<comment> \#.* ) | (?P<type> ^\ *[^\s\#]+ )"""
)


def texts(parts: Iterable[str], style: str, stream: TextIO, *, interfaces: bool = False) -> None:
    """Write texts, one after the other; `interfaces` in the text format are coloured.

    Text in other formats than JSON is exact.
    """
    text = "\n".join(parts)
    if style == "text" or stream.isatty():  # other formats are for other tools
        text = "\n".join(map(visible, text.split("\n")))
    if interfaces and style == "text":
        paint = painter(stream)
        text = _ELEMENTS.sub(lambda match: paint(str(match.lastgroup), match[0]), text)
    with written_as(_FORMS.get(style, Form.EXACT), stream):
        stream.write(text)


#: The forms of formats that are not exact.
_FORMS = {
    "text": Form.TEXT,
    "json": Form.JSON,
    "jsonschema": Form.JSON,
    "yaml": Form.YAML,
    "github": Form.COMMANDS,
    "junit": Form.XML,
    "gitlab": Form.JSON,
    "sarif": Form.JSON,
}


def lines(text: str, style: str, stream: TextIO) -> None:
    """Write whole lines in a format; a terminal gets them without control characters."""
    with written_as(_FORMS.get(style, Form.EXACT), stream):
        stream.write("\n".join(map(visible, text.split("\n"))) if stream.isatty() else text)


def counts(report: Report) -> dict[str, int]:
    """Return the number of errors and warnings."""
    errors = len(report.errors)
    return {"errors": errors, "warnings": len(report) - errors}


def status(report: Report) -> int:
    """Return the exit status: 0 clean, 1 findings, 2 usage or configuration."""
    if any(diagnostic.code in codes.USAGE for diagnostic in report.errors):
        return 2
    return 1 if report.had_errors else 0


def document(
    report: Report, style: str, command: str, files: tuple[str, ...] = (), *, strict: bool = False
) -> None:
    """Write a report on files as the document of a CI system to standard output.

    With `strict`, warnings fail as errors do.
    """
    from idlc.diagnostics.formats import DOCUMENTS, RunFacts

    with written_as(_FORMS.get(style, Form.EXACT), sys.stdout):
        sys.stdout.write(DOCUMENTS[style](report, RunFacts(command, __version__, files, strict)))
