"""Wrapping lines of a setup.py that edits made too long, one item to a line."""

from __future__ import annotations

import ast
import re

from idlc.checks.package.python_files import parsed, range_of
from idlc.checks.package.setup_edits import STEP, WIDTH, indent_of, line_end
from idlc.diagnostics.source import Source

#: How many lists are tried; each costs as much as reading the file.
_TRIES = 40
_LINE_END = re.compile(r"\r\n?|\n")


def wrapped(old: str, new: str) -> str:
    """Return an edited file whose lines are not too wide, as far as lists can be wrapped.

    Lines that `old` has stay as they are.
    """
    before = frozenset(_LINE_END.split(old))
    refused: set[str] = set()
    for _ in range(_TRIES):
        lines = enumerate(_LINE_END.split(new), 1)
        wide = {at for at, line in lines if len(line) > WIDTH and line not in before}
        tree = parsed(new) if wide else None
        nodes = ast.walk(tree) if tree else ()
        text = next((one for node in nodes if (one := _spread(new, node, wide, refused))), None)
        if tree is None or text is None:
            break
        # parentheses around items are not in the tree, nor is what may follow a generator
        if _same(tree, parsed(text)):
            new = text
        else:
            refused.add(text)
    return new


def _same(before: ast.Module, after: ast.Module | None) -> bool:
    try:
        return after is not None and ast.dump(before) == ast.dump(after)
    except RecursionError:
        return False


def _spread(text: str, node: ast.AST, wide: set[int], refused: set[str]) -> str | None:
    """Return the text with one item of a node to a line, if it is on a line that is too wide."""
    if not isinstance(node, (ast.List, ast.Tuple, ast.Dict, ast.Call)):
        return None
    if node.lineno not in wide or node.lineno != node.end_lineno:
        return None
    source = Source("", text)
    start, end = range_of(source, node)
    if isinstance(node, ast.Call):
        start = text.find("(", range_of(source, node.func)[1])

    def code(item: ast.AST) -> str:
        return text[slice(*range_of(source, item))]

    if isinstance(node, ast.Dict):
        pairs = zip(node.keys, node.values, strict=True)
        items = [(f"{code(key)}: " if key else "**") + code(value) for key, value in pairs]
    elif isinstance(node, ast.Call):
        given: list[ast.expr | ast.keyword] = [*node.args, *node.keywords]
        items = [code(one) for one in sorted(given, key=lambda one: one.col_offset)]
    else:
        items = [code(one) for one in node.elts]
    margin, line = indent_of(source, start), line_end(source)
    body = "".join(f"{margin}{STEP}{item},{line}" for item in items)
    found = f"{text[: start + 1]}{line}{body}{margin}{text[end - 1 :]}"
    return found if items and found not in refused else None
