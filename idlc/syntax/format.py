"""Syntax tree → the same file in canonical layout.

Changes blanks, line ends and nothing else: no word, value or comment is added, lost or moved to
another line, so the meaning stays. Formatting twice is formatting once.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import takewhile

from idlc.syntax import tree
from idlc.syntax.alignment import lay_out

#: Blanks at the end of a line.
_INVISIBLE = re.compile(r"[ \t]+$", re.MULTILINE)
#: More blank lines than these in a row say nothing.
BLANK_LINES = 2


def format_file(file: tree.File) -> str:
    """Return the text of a file in canonical layout; lines that are no definitions stay.

    A file that differs only in what nobody sees, at the ends of lines and of the file, is in order.
    """
    newline = _newline(file)
    out: list[str] = []
    for number, section in enumerate(file.sections):
        if number:
            out.append("---")
        out += _trimmed(_texts(section), first=number == 0)
    while out and not out[-1]:
        del out[-1]
    text = "".join(line + newline for line in out)
    return file.source.text if _look_alike(text, file.source.text) else text


def _look_alike(one: str, other: str) -> bool:
    return _INVISIBLE.sub("", one).rstrip() == _INVISIBLE.sub("", other).rstrip()


def _newline(file: tree.File) -> str:
    """Return the file's first usual line end, which all lines get."""
    ends = (line.newline for section in file.sections for line in section.lines)
    found = next((end for end in ends if end in ("\n", "\r\n")), "\n")
    if file.separators and file.source.text.startswith("---\r\n", file.separators[0]):
        return "\r\n"
    return found


def _texts(section: tree.Section) -> list[str]:
    # ROS 2 keeps blanks at the ends of the comment lines that head a section
    head = [line.comment for line in takewhile(_is_comment_line, section.lines)]
    return [*head, *lay_out(section.lines[len(head) :])]


def _is_comment_line(line: tree.Line) -> bool:
    return bool(line.comment) and not line.code


def _trimmed(texts: Iterable[str], *, first: bool) -> Iterator[str]:
    """Yield lines without needless blank ones; those that divide comments stay."""
    blanks = 0
    begun = False
    for text in texts:
        if not text:
            blanks += 1
            continue
        # a blank line before the first comment says that it is not about the whole structure
        yield from [""] * min(blanks, BLANK_LINES if begun else 1)
        yield text
        blanks, begun = 0, True
    if not first or begun:
        yield from [""] * min(blanks, BLANK_LINES)
