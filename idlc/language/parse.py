"""Source → syntax tree: sections of lines, whose code `definition.py` parses. Never raises.

A line has code, then a comment from the first `#` on, even inside quotes. A .msg file has one
section, a .srv file two (request, response), a .action file three (goal, result, feedback).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from idlc.diagnostics.source import Source
from idlc.language import tree

if TYPE_CHECKING:
    from idlc.language import idl

#: The characters that end a line, as `str.splitlines` has it (language 1.1).
LINE_ENDS = "\n\r\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029"


def parse(source: Source) -> tree.File:
    """Return the sections and lines of a file; always succeeds."""
    sections: list[tree.Section] = []
    separators: list[int] = []
    lines: list[tree.Line] = []
    first = start = 0
    for line in source.text.splitlines(keepends=True) or ("",):
        text = line.rstrip(LINE_ENDS)
        end = start + len(line)
        if text == "---":
            sections.append(tree.Section(first, tuple(lines)))
            separators.append(start)
            lines = []
            first = end
        else:
            code, sign, comment = text.partition("#")
            lines.append(tree.Line(start, code, sign + comment, line[len(text) :] or "\n"))
        start = end
    return tree.File(source, (*sections, tree.Section(first, tuple(lines))), tuple(separators))


def parse_any(source: Source) -> tree.File | idl.IdlFile:
    """Return the syntax of a file of either language; always succeeds."""
    if not source.is_idl:
        return parse(source)
    from idlc.language.idl import parse_idl  # only recordings hold IDL

    return parse_idl(source)
