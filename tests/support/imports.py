"""The modules of idlc, and the imports in them: read from the source, nothing is imported."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.support.paths import ROOT

PACKAGE = ROOT / "idlc"


class Import(NamedTuple):
    """An import: the module by its full name, and where and when it is imported."""

    module: str
    line: int
    level: int
    at_once: bool
    for_types: bool


def dotted(path: Path) -> str:
    """Return the name by which a file is imported."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {dotted(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def room(module: str) -> str:
    """Return the folder below idlc/, or the module directly in it."""
    return module.split(".")[1] if "." in module else "idlc"


@cache
def imports(module: str) -> tuple[Import, ...]:
    """Return the imports of a module, those inside of functions too."""
    path = MODULES[module]
    tree = ast.parse(path.read_text(encoding="utf-8"))
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    return tuple(_imports(tree, package.split(".")))


def _imports(tree: ast.Module, package: list[str]) -> Iterator[Import]:
    late = {
        id(node)
        for function in ast.walk(tree)
        if is_function(function)
        for node in ast.walk(function)
    }
    typing = {id(node) for block in ast.walk(tree) for node in _type_checking(block)}
    for node in ast.walk(tree):
        when = (id(node) not in late, id(node) in typing)
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(alias.name, node.lineno, 0, *when)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            name = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                whole = f"{name}.{alias.name}"
                yield Import(whole if whole in MODULES else name, node.lineno, node.level, *when)


def is_function(node: ast.AST) -> bool:
    """Return whether the statements in a node run when it is called."""
    return isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))


def _type_checking(block: ast.AST) -> Iterator[ast.AST]:
    test = block.test if isinstance(block, ast.If) else None
    if isinstance(block, ast.If) and isinstance(test, ast.Name) and test.id == "TYPE_CHECKING":
        for statement in block.body:
            yield from ast.walk(statement)


def graph() -> dict[str, set[str]]:
    """Return the modules of idlc that each of them imports."""
    return {
        module: {each.module for each in imports(module)} & MODULES.keys() - {module}
        for module in MODULES
    }
