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
def tree(module: str) -> ast.Module:
    """Return the syntax tree of a module."""
    return ast.parse(MODULES[module].read_text(encoding="utf-8"))


@cache
def imports(module: str) -> tuple[Import, ...]:
    """Return the imports of a module, those inside of functions too."""
    path = MODULES[module]
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    return tuple(_imports(tree(module), package.split("."), at_once=True, for_types=False))


def _imports(
    parent: ast.AST, package: list[str], *, at_once: bool, for_types: bool
) -> Iterator[Import]:
    when = (at_once, for_types)
    for node in ast.iter_child_nodes(parent):
        match node:
            case ast.Import(names=names):
                for alias in names:
                    yield Import(alias.name, node.lineno, 0, *when)
            case ast.ImportFrom(module=name, names=names, level=level):
                base = package[: len(package) - level + 1] if level else []
                home = ".".join([*base, *([name] if name else [])])
                for alias in names:
                    whole = f"{home}.{alias.name}"
                    yield Import(whole if whole in MODULES else home, node.lineno, level, *when)
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                yield from _imports(node, package, at_once=False, for_types=for_types)
            case ast.If(test=ast.Name(id="TYPE_CHECKING"), body=body, orelse=orelse):
                typing, running = ast.Module(body, []), ast.Module(orelse, [])
                yield from _imports(typing, package, at_once=at_once, for_types=True)
                yield from _imports(running, package, at_once=at_once, for_types=for_types)
            case ast.stmt() | ast.ExceptHandler() | ast.match_case():
                yield from _imports(node, package, at_once=at_once, for_types=for_types)


def graph() -> dict[str, set[str]]:
    """Return the modules of idlc that each of them imports."""
    return {
        module: {each.module for each in imports(module)} & MODULES.keys() - {module}
        for module in MODULES
    }
