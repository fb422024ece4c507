"""Nothing is kept that nobody uses."""

import ast
import re
from collections.abc import Iterator

from tests.support.paths import ROOT

#: What is called by its name from outside: by click, pytest, Python, and PEP 517's frontends.
CALLED = re.compile(r"__\w+__|pytest_\w+|command|(get_requires_for_)?build_\w+")
SEARCHED = ("idlc", "tests", "benchmarks", "examples")
WORD = re.compile(r"\w+")


def used() -> Iterator[str]:
    """Yield the names that code, templates and settings refer to."""
    for path in (*(ROOT / "templates").rglob("*.jinja"), ROOT / "pyproject.toml"):
        yield from WORD.findall(path.read_text(encoding="utf-8"))
    for folder in SEARCHED:
        for path in (ROOT / folder).rglob("*.py"):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            for node in ast.walk(tree):
                yield from names(node)


def names(node: ast.AST) -> Iterator[str]:
    match node:
        case (
            ast.Name(id=name, ctx=ast.Load())
            | ast.Attribute(attr=name)
            | ast.keyword(arg=str(name))
        ):
            yield name
        case ast.alias(name=name):
            yield name.rpartition(".")[2]
        case ast.Constant(value=str(text)) if len(text) < 200:  # not a docstring
            yield from WORD.findall(text) if " " not in text else ()


def defined(tree: ast.Module) -> Iterator[str]:
    """Yield the names that a module defines, and the methods of its classes."""
    for node in tree.body:
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield name
            case ast.ClassDef(name=name, bases=bases, body=body):
                yield name
                if not bases:  # what a base asks for, it calls
                    yield from (one.name for one in body if isinstance(one, ast.FunctionDef))
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                yield name


def test_every_name_is_used():
    known = set(used())
    unused = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in sorted((ROOT / "idlc").rglob("*.py"))
        for name in defined(ast.parse(path.read_text(encoding="utf-8")))
        if name not in known and not CALLED.fullmatch(name)
    ]
    assert unused == []
