"""What Python files say, read from their syntax; nothing is imported or run."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple, TypeGuard

from idlc.diagnostics.source import Source, Span


@lru_cache(maxsize=256)
def parsed(text: str) -> ast.Module | None:
    """Return the syntax of a file; `None` if it is not Python."""
    try:
        return ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def start_of(source: Source, node: ast.AST) -> int:
    """Return where a node begins; ast counts bytes."""
    line = getattr(node, "lineno", 1)
    start = source.line_starts[min(line, len(source.line_starts)) - 1]
    before = source.text[start:].encode("utf-8")[: getattr(node, "col_offset", 0)]
    return start + len(before.decode("utf-8", "ignore"))


def _span(source: Source, node: ast.AST) -> Span:
    """Return where a node begins, to the end of it or of its line."""
    begin = start_of(source, node)
    text = ast.get_source_segment(source.text, node) or ""
    return Span(source, begin, begin + max(len(text.split("\n")[0]), 1))


def imported_packages(source: Source) -> Iterator[tuple[str, Span]]:
    """Yield the first part of each absolute import, with its place."""
    tree = parsed(source.text)
    for node in ast.walk(tree) if tree else ():
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name.partition(".")[0], _span(source, alias)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            yield node.module.partition(".")[0], _span(source, node)


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


class Text(NamedTuple):
    """A text in the arguments of setup(), and its place."""

    value: str
    span: Span


class Setup(NamedTuple):
    """The arguments of setup() that matter here; what is computed is missing.

    `data_files` are all texts below that argument, `None` without it.
    """

    name: Text | None = None
    data_files: tuple[Text, ...] | None = None
    scripts: tuple[Text, ...] = ()


def read_setup(source: Source) -> Setup:
    """Return what a setup.py says."""
    tree = parsed(source.text)
    if tree is None:
        return Setup()
    known = {
        target.id: node.value
        for node in tree.body
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    call = next((one for one in ast.walk(tree) if is_setup(one)), None)
    arguments = {one.arg: one.value for one in call.keywords} if call else {}
    name = list(_texts(source, arguments["name"], known)) if "name" in arguments else []
    data = arguments.get("data_files")
    return Setup(
        name[0] if name else None,
        None if data is None else tuple(_texts(source, data, known)),
        tuple(_scripts(source, arguments.get("entry_points"), known)),
    )


def is_setup(node: ast.AST) -> TypeGuard[ast.Call]:
    """Return whether a piece of syntax is a call of setuptools' function."""
    function = node.func if isinstance(node, ast.Call) else None
    name = function.id if isinstance(function, ast.Name) else getattr(function, "attr", "")
    return name == "setup"


def _texts(source: Source, node: ast.AST, known: dict[str, ast.expr]) -> Iterator[Text]:
    for one in ast.walk(node):
        if isinstance(one, ast.Constant) and isinstance(one.value, str):
            yield Text(one.value, _span(source, one))
        elif isinstance(one, ast.Name) and one.id in known:
            value = known[one.id]
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield Text(value.value, _span(source, one))


def _scripts(source: Source, node: ast.expr | None, known: dict[str, ast.expr]) -> Iterator[Text]:
    if isinstance(node, ast.Dict):
        for key, value in zip(node.keys, node.values, strict=True):
            if isinstance(key, ast.Constant) and key.value == "console_scripts":
                yield from _texts(source, value, known)
