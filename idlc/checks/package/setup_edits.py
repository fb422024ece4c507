"""Edits of a setup.py: elements for a list, an argument for setup(), an import.

Everything added looks like what stands beside it: quotes, indentation, line ends.
"""

from __future__ import annotations

import ast
import re
import tokenize
from collections.abc import Sequence
from itertools import accumulate

from idlc.checks.package.python_files import range_of, start_of
from idlc.checks.package.setup_py import Setup
from idlc.diagnostics.report import Edit
from idlc.diagnostics.source import Source, Span

STEP = "    "
#: The widest line that the linters of ROS 2 accept.
WIDTH = 99


def insertion(source: Source, at: int, text: str) -> Edit:
    """Return the edit that inserts a text, with the line ends of the file."""
    return Edit(Span(source, at, at), text.replace("\n", line_end(source)))


def line_end(source: Source) -> str:
    """Return the line end of a file."""
    found = re.search(r"\r\n?|\n", source.text)
    return found[0] if found else "\n"


def indent_of(source: Source, at: int) -> str:
    """Return the whitespace before the first word of a line."""
    start = max(source.text.rfind("\n", 0, at), source.text.rfind("\r", 0, at)) + 1
    found = re.compile(r"[ \t]*").match(source.text, start)
    return found[0] if found else ""


def quote_of(source: Source, node: ast.AST) -> str:
    """Return the quote of the first literal in an expression."""
    start, end = range_of(source, node)
    found = re.search("['\"]", source.text[start:end])
    return found[0] if found else "'"


def appended(source: Source, node: ast.List, elements: Sequence[str]) -> tuple[Edit, ...]:
    """Return the edits that give a list more elements, written with single quotes."""
    begin, end = range_of(source, node)
    quote = quote_of(source, node)
    new = [element.replace("'", quote) for element in elements]
    last = range_of(source, node.elts[-1])[1] if node.elts else begin + 1
    after, comma = _behind(source.text[last : end - 1])
    last += after
    bracket = indent_of(source, end - 1)
    tail = re.search(r"(?:\r\n?|\n)[ \t]*\Z", source.text[last : end - 1])
    if tail is None:
        before, behind = (" ", ",") if comma else (", ", "") if node.elts else ("", ", ")
        return (insertion(source, last, before + ", ".join(new) + behind),)
    ends = [start_of(source, element) for element in (node.elts[:1] + node.elts[-1:])]
    margins = [indent_of(source, at) for at in ends if _begins_line(source, at)]
    margin = margins[-1] if margins else bracket + STEP
    lines = "".join(f"\n{_broken(margin, element)}," for element in new)
    edits = () if comma or not node.elts else (insertion(source, last, ","),)
    return (*edits, insertion(source, last + tail.start(), lines))


def _broken(margin: str, element: str) -> str:
    """Return an element on a line of its own, on two if it is long."""
    line = margin + element
    return line if len(line) < WIDTH else line.replace(", ", f",\n{margin}{STEP}", 1)


def _begins_line(source: Source, at: int) -> bool:
    return source.text[:at].endswith(("\n" + indent_of(source, at), "\r" + indent_of(source, at)))


def _behind(text: str) -> tuple[int, bool]:
    """Return how much of what stands behind an element belongs to it, and whether a comma does."""
    lines = re.findall(r"[^\r\n]*(?:\r\n?|\n)|[^\r\n]+", f"({text}")
    starts = [length - 1 for length in accumulate(map(len, lines), initial=0)]
    length = 0
    try:
        for token in tokenize.generate_tokens(iter([*lines, ""]).__next__):
            at = starts[min(token.end[0], len(starts)) - 1] + token.end[1]
            if token.string == ",":
                return at, True
            if token.string == ")":
                length = at
    except (tokenize.TokenError, SyntaxError):
        pass  # it ends within the bracket
    return length, False


def argument(setup: Setup, text: str) -> tuple[Edit, ...]:
    """Return the edit that gives setup() one argument more, laid out like its first one."""
    call, source = setup.call, setup.source
    if call is None or call.args or not call.keywords:
        return ()
    at = start_of(source, call.keywords[0])
    spread = call.keywords[0].lineno > call.lineno
    between = "\n" + indent_of(source, at) if spread else " "
    return (insertion(source, at, f"{text},{between}"),)


def imported(setup: Setup, module: str, name: str) -> tuple[str, tuple[Edit, ...]]:
    """Return how a file calls a function of a module, and the edit that imports it if need be."""
    imports = [node for node in setup.nodes if isinstance(node, (ast.Import, ast.ImportFrom))]
    for node in imports:
        for alias in node.names:
            if isinstance(node, ast.ImportFrom):
                if node.module == module and alias.name in (name, "*"):
                    return alias.asname or name, ()
            elif alias.name == module:
                return f"{alias.asname or module}.{name}", ()
    source = setup.source
    for node in imports:
        if isinstance(node, ast.ImportFrom) and node.module == module and node.col_offset == 0:
            at = start_of(source, node.names[0])
            return name, (insertion(source, at, f"{name}, "),)
    body = setup.tree.body
    first = next((node for node in body if node in imports), body[0])
    if isinstance(first, ast.ImportFrom) and first.module == "__future__":
        first = body[body.index(first) + 1]
    gap = "\n" if getattr(first, "module", "") == "setuptools" else ""
    line = f"from {module} import {name}\n{gap}"
    return name, (insertion(source, start_of(source, first), line),)
