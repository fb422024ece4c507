"""Nothing is kept that nobody uses: use in tests, benchmarks and examples does not count."""

import ast
import re
from collections.abc import Iterator

from tests.support.imports import MODULES, tree
from tests.support.paths import ROOT

#: What is called by its name from outside: by click, pytest, Python, and builds.
CALLED = re.compile(
    r"__\w+__|(pytest|hatch|pdm)_\w+|command|get_build_hook|(get_requires_for_)?build_\w+"
)
#: What only programs use, as docs/ says: `Ragged.stacked`, `Columns.structured`.
PUBLIC = {"stacked", "structured"}
#: What generated code has for numbers of each size, and what no golden package happens to use.
NUMBERS = re.compile(r"(U?Int|Float)\d+(Array|Sequence)|(U?INT|FLOAT)\d+|PAD\d")
UNUSUAL = {"PROTOCOL", "flags_writer"}
#: The words of rclpy, which programs use.
WORDS_OF_RCLPY = "idlc.robot."
#: Classes of others that call nothing by its name: what a class adds to them is its own.
RECORDS = {
    "NamedTuple",
    "Struct",
    "msgspec.Struct",
    "Protocol",
    "Generic",
    "Exception",
    "ValueError",
}
WORD = re.compile(r"\w+")
#: What generated code takes from the runtime.
GENERATED = re.compile(r"\b_(?:idlc|arrays)\.(\w+)")


def used() -> Iterator[str]:
    """Yield the names that code, templates, settings and generated code refer to."""
    for path in (ROOT / "golden/gen").rglob("*.py"):
        yield from GENERATED.findall(path.read_text(encoding="utf-8"))
    for path in (*(ROOT / "templates").rglob("*.jinja"), ROOT / "pyproject.toml"):
        yield from WORD.findall(path.read_text(encoding="utf-8"))
    for module in MODULES:
        for node in ast.walk(tree(module)):
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


def base_name(base: ast.expr) -> str:
    """Return the name of a base class as it is written, without what it is a generic of."""
    return ast.unparse(base).partition("[")[0]


def defined(module: ast.Module, own: set[str]) -> Iterator[str]:
    """Yield the names that a module defines, and the methods of its classes.

    What a class of somebody else asks for, it calls; `own` are the classes that are not.
    """
    for node in module.body:
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield name
            case ast.ClassDef(name=name, bases=bases, body=body):
                yield name
                if {*map(base_name, bases)} <= own:
                    yield from (item.name for item in body if isinstance(item, ast.FunctionDef))
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                yield name


def test_every_name_is_used():
    nodes = (node for module in MODULES for node in ast.walk(tree(module)))
    classes = [node for node in nodes if isinstance(node, ast.ClassDef)]
    own = RECORDS | {node.name for node in classes}
    own -= {node.name for node in classes if not {*map(base_name, node.bases)} <= own}
    known = {*used(), *PUBLIC, *UNUSUAL}
    unused = [
        f"{module}: {name}"
        for module in MODULES
        for name in defined(tree(module), own)
        if not module.startswith(WORDS_OF_RCLPY)
        and name not in known
        and not CALLED.fullmatch(name)
        and not NUMBERS.fullmatch(name)
    ]
    assert unused == []
