"""The invariants of docs/architecture.md that can be read off the source."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from jinja2 import Environment, nodes

from tests.support.paths import DOCS, ROOT

PACKAGE = ROOT / "idlc"
MODULES = sorted(PACKAGE.rglob("*.py"))
TEMPLATES = sorted((ROOT / "templates").rglob("*.jinja"))
RUNTIME = [path for path in MODULES if "runtime" in path.parts]

#: Each stage may import those before it; `runtime` stands apart and imports none.
STAGES = (
    "diagnostics syntax model breaking export checks templating emit native site "
    "scaffold disk recordings driver lsp cli backend"
).split()
#: Stages that need fewer of those before them.
NEEDS_ONLY = {"native": {"native", "model"}}
#: What emit shares with the runtime, so that there is one rule for the names in Python.
SHARED_WITH_RUNTIME = {"idlc.runtime.names"}
#: The outermost modules, which belong to the command line or to programs.
OUTERMOST = {"__main__": "cli", "__init__": "driver", "build": "cli", "loaded": "disk"}

#: Only these stages may touch files, the environment or the terminal.
MAY_DO_IO = {"disk", "recordings", "lsp", "cli", "backend"}
IO_MODULES = {"glob", "io", "os", "pathlib", "shutil", "socket", "subprocess", "tempfile"}
IO_CALLS = {"open", "print", "input"}
#: What may read files of idlc: grammar, catalogue, templates, runtime, texts of licences.
READS_ITS_OWN = {
    "idlc/generate/python/render.py",
    "idlc/model/catalog.py",
    "idlc/scaffold/package.py",
    "idlc/language/grammar.py",
    "idlc/language/idl.py",
    "idlc/project/templates.py",
}

#: What runtime modules may import besides the standard library and each other, and only inside
#: functions: none of it is needed until rclpy, or a tool of ROS 2, asks.
RUNTIME_ON_DEMAND = {"numpy", "pyarrow", "rclpy", "rosidl_parser"}
#: The runtime modules that import numpy at once, and that no other imports at once.
NUMPY_AT_ONCE = ("idlc/runtime/arrays.py", "idlc/runtime/on_demand/columns/")

MODULE_BUDGET = 600
FUNCTION_BUDGET = 60
#: path, or path:function, that is over budget -> why it stays so.
OVER_BUDGET: dict[str, str] = {}


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def stage_of(path: Path) -> str:
    first = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    return OUTERMOST.get(first, first)


def imports_of(path: Path) -> Iterator[tuple[str, ast.stmt, bool]]:
    """Yield each absolute module name, its statement, and whether it runs at import.

    Imports that only type checkers see are left out.
    """
    tree = ast.parse(path.read_text(encoding="utf-8"))
    unseen = {id(node) for block in ast.walk(tree) for node in type_checking_part(block)}
    inner = {
        id(node)
        for function in ast.walk(tree)
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef))
        for node in ast.walk(function)
    }
    package = [*path.relative_to(ROOT).parts[:-1]]
    for node in ast.walk(tree):
        if id(node) in unseen:
            continue
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node, id(node) not in inner
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            names = [f"{module}.{alias.name}" for alias in node.names]
            for name in names if module == "idlc" or node.level else [module]:
                yield name, node, id(node) not in inner


def type_checking_part(block: ast.AST) -> Iterator[ast.AST]:
    test = block.test if isinstance(block, ast.If) else None
    if isinstance(block, ast.If) and isinstance(test, ast.Name) and test.id == "TYPE_CHECKING":
        for statement in block.body:
            yield from ast.walk(statement)


def test_every_module_belongs_to_a_stage():
    assert {stage_of(path) for path in MODULES} <= {*STAGES, "runtime"}


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_point_one_way(path):
    own = stage_of(path)
    before = {*STAGES[: STAGES.index(own) + 1], "__version__"} if own != "runtime" else {"runtime"}
    allowed = NEEDS_ONLY.get(own, before)
    for name, node, _ in imports_of(path):
        parts = name.split(".")
        if parts[0] == "idlc" and not (own == "emit" and name in SHARED_WITH_RUNTIME):
            assert len(parts) > 1, f"line {node.lineno}: name the module of idlc that is meant"
            assert parts[1] in allowed, f"line {node.lineno}: {own} imports {name}"


@pytest.mark.parametrize(
    "path", [p for p in MODULES if stage_of(p) not in {*MAY_DO_IO, "runtime"}], ids=name_of
)
def test_the_core_does_no_io(path):
    allowed = {"pathlib"} if name_of(path) in READS_ITS_OWN else set()
    for name, node, _ in imports_of(path):
        top = name.split(".")[0]
        assert top in allowed or top not in IO_MODULES, f"line {node.lineno}: imports {name}"
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in IO_CALLS, f"line {node.lineno}: calls {node.func.id}"


@pytest.mark.parametrize("path", RUNTIME, ids=name_of)
def test_the_runtime_stands_alone(path):
    has_numpy = name_of(path).startswith(NUMPY_AT_ONCE)
    with_numpy = {one.removesuffix(".py").strip("/").replace("/", ".") for one in NUMPY_AT_ONCE}
    for name, node, at_import in imports_of(path):
        top = name.split(".")[0]
        if isinstance(node, ast.ImportFrom) and node.level:
            depth = len(path.relative_to(PACKAGE / "runtime").parts)
            assert node.level <= depth, f"line {node.lineno}: reaches outside the package"
            borrowed = any(name == one or name.startswith(f"{one}.") for one in with_numpy)
            assert has_numpy or not (at_import and borrowed), (
                f"line {node.lineno}: imports numpy at once"
            )
        elif top not in sys.stdlib_module_names:
            assert top in RUNTIME_ON_DEMAND, f"line {node.lineno}: imports {name}"
            assert (has_numpy and top == "numpy") or not at_import, (
                f"line {node.lineno}: imports {name} at once"
            )


def over_budget() -> Iterator[tuple[str, int]]:
    for path in MODULES:
        text = path.read_text(encoding="utf-8")
        if (lines := len(text.splitlines())) > MODULE_BUDGET:
            yield name_of(path), lines
        for node in ast.walk(ast.parse(text)):
            function = isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
            if function and (lines := body_lines(node)) > FUNCTION_BUDGET:
                yield f"{name_of(path)}:{node.name}", lines


def body_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return how many lines a function takes without its signature and docstring."""
    documented = ast.get_docstring(function) is not None
    statements = function.body[documented:]
    if not statements:
        return 0
    first, last = statements[0], statements[-1]
    return (last.end_lineno or last.lineno) - first.lineno + 1


def test_modules_and_functions_stay_small():
    breaches = dict(over_budget())
    unexplained = {name: lines for name, lines in breaches.items() if name not in OVER_BUDGET}
    assert not unexplained, "over budget (split by idea, or say why not in OVER_BUDGET)"
    assert set(OVER_BUDGET) <= set(breaches), "entries of OVER_BUDGET that are no longer needed"


def template_sins(node: nodes.Node, within_if: bool = False) -> Iterator[str]:
    """Yield what a template does besides laying out: templates place finished strings."""
    match node:
        case nodes.Filter():
            if node.name not in {"indent", "join"}:
                yield f"line {node.lineno}: filter {node.name}"
        case nodes.Call():
            if not isinstance(node.node, (nodes.Name, nodes.Getattr)):
                yield f"line {node.lineno}: computed call"
        case nodes.If():
            if within_if or not isinstance(node.test, (nodes.Name, nodes.Getattr)):
                yield f"line {node.lineno}: a condition that is not one flag"
        case nodes.BinExpr() | nodes.UnaryExpr() | nodes.Compare() | nodes.Concat():
            yield f"line {node.lineno}: computes"
        case nodes.Assign() | nodes.AssignBlock() | nodes.CondExpr() | nodes.Test():
            yield f"line {node.lineno}: {type(node).__name__}"
    for child in node.iter_child_nodes():
        yield from template_sins(child, within_if or isinstance(node, nodes.If))


@pytest.mark.parametrize("path", TEMPLATES, ids=name_of)
def test_templates_only_lay_out(path):
    text = path.read_text(encoding="utf-8")
    assert list(template_sins(Environment(autoescape=True).parse(text))) == []
    assert len(text.splitlines()) <= 80


def project_files(folder: Path = ROOT) -> Iterator[Path]:
    """Yield what a clone holds: no environments, caches or build results."""
    for path in folder.iterdir():
        if path.is_file():
            yield path
        elif not (
            path.name in {".git", ".venv", "build", "dist", "node_modules"} or "cache" in path.name
        ):
            yield from project_files(path)


def test_nothing_reaches_outside_the_clone():
    neighbour = "/".join(["..", "shared"]).encode()  # in two pieces, or this file would be found
    assert [name_of(path) for path in project_files() if neighbour in path.read_bytes()] == []


def test_the_security_policy_names_real_tests():
    text = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", text)
    assert len(named) >= 15
    for path, function in named:
        assert f"def {function}(" in (ROOT / path).read_text(encoding="utf-8"), function


def test_this_document_names_real_tests():
    text = (DOCS / "architecture.md").read_text(encoding="utf-8")
    named = re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", text)
    assert len(named) >= 8
    for path, function in named:
        source = ROOT / path
        assert source.exists(), path
        assert f"def {function}" in source.read_text(encoding="utf-8"), f"{path}::{function}"
    assert text.count("\n1. ") == 1
    assert "\n13. " not in text, "more invariants than anyone remembers"


def imported_by(*words: str, cwd: Path, given: str = "runpy") -> set[str]:
    """Return the modules that a run of idlc imports besides `given` and what that imports."""
    code = (
        f"import runpy, sys, {given}\n"
        "before = set(sys.modules)\n"
        f"sys.argv = {['idlc', *words]!r}\n"
        "try:\n    runpy.run_module('idlc', run_name='__main__')\n"
        "except SystemExit as done:\n    assert not done.code, done.code\n"
        "print('imported', *set(sys.modules) - before)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=cwd, capture_output=True, text=True, check=True
    )
    first, *names = done.stdout.splitlines()[-1].split()
    assert first == "imported"
    return set(names)


@pytest.mark.parametrize("option", ["--version", "--help"])
def test_starting_up_imports_nothing_heavy(option, tmp_path):
    heavy = {"jinja2", "lark", "msgspec", "numpy", "rich", "idlc.scaffold"}
    assert heavy & imported_by(option, cwd=tmp_path) == set()


def test_checking_a_file_imports_little(tmp_path):
    """A hook does it for each commit: it is to cost less than five starts of Python."""
    files = {
        "package.xml": '<package format="3"><name>demo</name><depend>std_msgs</depend></package>',
        "msg/Drive.msg": "# How fast to drive.\nstd_msgs/Header header\nfloat64 speed  # [m/s]\n",
        "msg/Other.msg": "int8 other\n",
    }
    for path, text in files.items():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(text)
    found = imported_by("check", "msg/Drive.msg", cwd=tmp_path, given="msgspec")
    needless = {"argparse", "ast", "click", "dataclasses", "hashlib", "importlib.metadata"}
    needless |= {"importlib.resources", "inspect", "jinja2", "json", "lark", "libcst", "logging"}
    needless |= {"numpy", "pkgutil", "rich", "shutil", "subprocess", "tempfile", "tomllib"}
    assert needless & found == set()
    own = {name for name in found if name.partition(".")[0] == "idlc"}
    assert "idlc.check.package.manifest" in own
    assert "idlc.scaffold" not in own
    assert len(own) <= 82, "what a run without problems does not need can wait"
