"""What Python files say, read from their syntax; nothing is imported or run."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import lru_cache

from idlc.diagnostics.source import Source, Span

BOM = "\ufeff"


@lru_cache(maxsize=256)
def parsed(text: str) -> ast.Module | None:
    """Return the syntax of a file; `None` if it is not Python."""
    try:
        return ast.parse(text.removeprefix(BOM))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


@lru_cache(maxsize=16)
def _lines(text: str) -> tuple[list[int], list[bytes]]:
    """Return where the lines of Python begin, and these lines; ast counts bytes."""
    starts = [0, *(found.end() for found in re.finditer(r"\r\n?|\n", text))]
    ends = [*starts[1:], len(text)]
    lines = [
        text[start:end].encode("utf-8", "replace") for start, end in zip(starts, ends, strict=True)
    ]
    return starts, lines


def range_of(source: Source, node: ast.AST) -> tuple[int, int]:
    """Return where a node begins and ends, in characters."""
    starts, lines = _lines(source.text)

    def offset(line: int, column: int) -> int:
        at = min(line, len(starts)) - 1
        mark = len(BOM) if at == 0 and source.text.startswith(BOM) else 0
        if lines[at].isascii():
            return starts[at] + column
        before = lines[at][: column + mark * len(BOM.encode())].decode("utf-8", "ignore")
        return starts[at] + len(before)

    line, column = getattr(node, "lineno", 1), getattr(node, "col_offset", 0)
    end_line, end = getattr(node, "end_lineno", None), getattr(node, "end_col_offset", None)
    return offset(line, column), offset(end_line or line, end or column)


def start_of(source: Source, node: ast.AST) -> int:
    """Return where a node begins."""
    return range_of(source, node)[0]


def span_of(source: Source, node: ast.AST) -> Span:
    """Return where a node begins, to the end of it or of its line."""
    start, end = range_of(source, node)
    first = re.match(r"[^\r\n]*", source.text[start:end])
    return Span(source, start, start + max(first.end() if first else 0, 1))


def imported_modules(source: Source) -> Iterator[tuple[str, ast.AST]]:
    """Yield the module of each absolute import, with its place."""
    tree = parsed(source.text)
    for node in ast.walk(tree) if tree else ():
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, alias
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            yield node.module, node


def defines(source: Source, name: str) -> bool:
    """Return whether a file gives a meaning to a name at its top level."""
    tree = parsed(source.text)
    if tree is None:
        return True
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            names = [node.name]
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            names = [alias.asname or alias.name for alias in node.names]
        elif isinstance(node, (ast.If, ast.Try, ast.With)):
            return True
        else:
            names = [one.id for one in ast.walk(node) if isinstance(one, ast.Name)]
        if name in names or "*" in names:
            return True
    return False
