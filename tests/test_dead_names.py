"""Nothing is kept that nobody uses."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: What is called by its name from outside: click, pytest, setuptools, generated code, Python.
CALLED = re.compile(r"__\w+__|pytest_\w+|command")
SEARCHED = ("idlc", "templates", "tests", "benchmarks", "pyproject.toml", ".pre-commit-hooks.yaml")


def texts() -> Iterator[str]:
    for name in SEARCHED:
        path = ROOT / name
        files = [path] if path.is_file() else path.rglob("*")
        for file in files:
            if file.suffix in {".py", ".jinja", ".toml", ".yaml", ".lark"}:
                yield file.read_text(encoding="utf-8")


def defined(tree: ast.Module) -> Iterator[str]:
    """Yield the names that a module defines, and the methods of its classes."""
    for node in tree.body:
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                yield node.name
            case ast.ClassDef():
                yield node.name
                bases = [base for base in node.bases if not isinstance(base, ast.Subscript)]
                if not bases:  # what others define, they call
                    yield from (one.name for one in node.body if isinstance(one, ast.FunctionDef))
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                yield name


def test_every_name_is_used():
    words = Counter(word for text in texts() for word in re.findall(r"\w+", text))
    unused = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in sorted((ROOT / "idlc").rglob("*.py"))
        for name in defined(ast.parse(path.read_text(encoding="utf-8")))
        if words[name] < 2 and not CALLED.fullmatch(name)
    ]
    assert unused == []
