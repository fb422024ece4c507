"""Small mistakes in source text: another comparison, constant or return value, a statement less."""

from __future__ import annotations

import ast
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

COMPARISONS = {
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.In: "not in",
    ast.NotIn: "in",
    ast.Is: "is not",
    ast.IsNot: "is",
}


class Mutation(NamedTuple):
    """A mistake: the characters from `start` to `end` of `file` become `text`."""

    file: str
    line: int
    start: int
    end: int
    text: str
    kind: str

    def applied(self, source: str) -> str:
        """Return the source with the mistake."""
        return source[: self.start] + self.text + source[self.end :]


def mutations(file: str, source: str) -> Iterator[Mutation]:
    """Yield each mistake that can be made in a file, with the line that has to run for it."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    lines = source.splitlines(keepends=True)

    def offset(line: int, column: int) -> int:
        return starts[line - 1] + len(lines[line - 1].encode()[:column].decode())

    def change(node: ast.AST, text: str, kind: str) -> Mutation:
        start = offset(node.lineno, node.col_offset)  # type: ignore[attr-defined]
        end = offset(node.end_lineno, node.end_col_offset)  # type: ignore[attr-defined]
        return Mutation(file, node.lineno, start, end, text, kind)  # type: ignore[attr-defined]

    for node in executed_nodes(ast.parse(source)):
        match node:
            case ast.Compare(left=left, ops=[operator], comparators=[right]):
                between = (
                    ast.get_source_segment(source, left),
                    COMPARISONS[type(operator)],
                    ast.get_source_segment(source, right),
                )
                yield change(node, "({} {} {})".format(*between), "comparison")
            case ast.Constant(value=bool(value)):
                yield change(node, str(not value), "constant")
            case ast.Constant(value=int(value)):
                yield change(node, str(value + 1), "constant")
            case ast.Return(value=ast.expr() as value) if not is_none(value):
                yield change(node, "return None", "return")
            case ast.Assign() | ast.AugAssign() | ast.Raise() | ast.Continue() | ast.Break():
                yield change(node, "pass", "removed statement")
            case ast.Expr(value=ast.Call()):
                yield change(node, "pass", "removed statement")


def is_none(value: ast.expr) -> bool:
    """Return whether an expression is the constant None."""
    return isinstance(value, ast.Constant) and value.value is None


def executed_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a tree without annotations and what only type checkers read."""
    for name, value in ast.iter_fields(tree):
        if name in {"annotation", "returns", "type_params"}:
            continue
        if isinstance(tree, ast.If) and ast.unparse(tree.test) == "TYPE_CHECKING":
            continue
        # a text inside of an f-string has no place of its own in Python 3.10 and 3.11
        if isinstance(tree, ast.JoinedStr):
            continue
        for node in value if isinstance(value, list) else [value]:
            if isinstance(node, ast.AST):
                yield node
                yield from executed_nodes(node)


def choose(
    root: Path, executed: Callable[[str], set[int]], number: int, seed: int
) -> list[Mutation]:
    """Return mistakes in executed lines: each line of idlc is as likely as any other."""
    choice = random.Random(seed)
    files = [path.relative_to(root).as_posix() for path in sorted((root / "idlc").rglob("*.py"))]
    lines = [(file, line) for file in files for line in sorted(executed(file))]
    possible: dict[str, list[Mutation]] = {}
    chosen: list[Mutation] = []
    while len(chosen) < number:
        file, line = choice.choice(lines)
        if file not in possible:
            possible[file] = list(mutations(file, (root / file).read_text(encoding="utf-8")))
        here = [mistake for mistake in possible[file] if mistake.line == line]
        if here and (mistake := choice.choice(here)) not in chosen:
            chosen.append(mistake)
    return chosen
