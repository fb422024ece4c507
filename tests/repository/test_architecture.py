"""The invariants of docs/architecture.md that can be read off the source."""

import ast
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from jinja2 import Environment, nodes

from tests.support.imports import MODULES, graph, imports, room, tree
from tests.support.paths import DOCS, EXAMPLE, ROOT

TEMPLATES = sorted((ROOT / "templates").rglob("*.jinja"))
RUNTIME = [module for module in MODULES if room(module) == "runtime"]

#: The rooms from top to bottom: the picture in docs/architecture.md.
ROOMS = re.findall(
    r"(?m)^  ([a-z]+)  ", (DOCS / "architecture.md").read_text(encoding="utf-8").split("```")[1]
)
#: What is beside the rooms: the ways in are above all, and the version is below.
ORDER = ["__main__", "backend", "idlc", *ROOMS, "version"]
#: A room, and a module above it that a text there names -> why this is allowed.
NAMED_ABOVE = {
    (
        "runtime",
        "idlc.recordings.columns",
    ): "generated packages make tables where idlc is installed",
    ("scaffold", "idlc.backend"): "the pyproject.toml of a user names it",
    ("build", "idlc.backend"): "the same",
}
#: The rooms that do no I/O.
CORE = ("diagnostics", "language", "model", "wire")
#: What they share with the runtime, so that there is one rule for the names in Python.
SHARED_WITH_RUNTIME = {"idlc.runtime.names"}

#: The pages that name the tests which hold the house.
HOUSE_PAGES = ("architecture.md", "contributing/type-support.md", "contributing/tests.md")

MOST_MODULES = 319
MOST_IN_A_FOLDER = 15
#: The share of the imports of idlc's own modules that stands in functions.
MOST_IN_FUNCTIONS = 0.05
#: The command line has one module for each command; the runtime is one folder in each package.
CROWDED = {"idlc/cli", "idlc/runtime"}

#: Rooms that a program imports by their name: what is in them is what they offer.
OFFERED_AT_ONCE = {"runtime", "build", "robot"}

IO_MODULES = {"glob", "io", "os", "pathlib", "shutil", "socket", "subprocess", "tempfile"}
IO_CALLS = {"open", "print", "input"}
#: What of the core reads files of idlc: the grammars, the catalogue.
READS_ITS_OWN = {"idlc.language.definition", "idlc.language.idl", "idlc.model.catalog"}
#: What prints besides `cli` -> why.
PRINTS = {
    "idlc.build.setup_command": "a build that pip runs has no other way to say why it stops",
    "idlc.build.hooks": "the same",
    "idlc.tasks.columns": "a table goes to standard output where `-o -` says so",
    "idlc.robot.__main__": "it is a command line of its own",
    "idlc.robot.nodes.logger": "nodes log to standard error, as in ROS 2",
}

#: What runtime modules may import besides the standard library and each other, and only inside
#: functions: none of it is needed until rclpy, or a tool of ROS 2, asks.
RUNTIME_ON_DEMAND = {"numpy", "pyarrow", "rclpy", "rosidl_parser"}
#: The runtime modules that import numpy at once, and that no other imports at once.
NUMPY_AT_ONCE = ("idlc.runtime.arrays",)


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


# the house


def test_imports_have_no_cycle():
    """Imports inside of functions, relative ones and those for type checkers are counted."""
    TopologicalSorter(graph()).prepare()


def named(module: str) -> set[str]:
    """Return the modules that texts in a module name, as those of import_module() do."""
    values = (node.value for node in ast.walk(tree(module)) if isinstance(node, ast.Constant))
    words = {word for value in values if isinstance(value, str) for word in value.split()}
    return {name for word in words if "." in word for name in (word, f"idlc.{word}")} & {*MODULES}


def test_the_picture_shows_all_rooms():
    assert sorted(ORDER) == sorted(set(map(room, MODULES)))


def test_each_room_imports_only_rooms_below_it():
    """Imports inside of functions, those for type checkers and names in texts are counted."""
    upwards = {
        (room(module), name)
        for module, names in graph().items()
        for name in names | named(module)
        if ORDER.index(room(module)) > ORDER.index(room(name))
    }
    assert upwards == NAMED_ABOVE.keys()


def test_the_core_shares_one_module_with_the_runtime():
    core = (name for module, names in graph().items() if room(module) in CORE for name in names)
    assert {name for name in core if room(name) == "runtime"} == SHARED_WITH_RUNTIME


def test_few_imports_are_in_functions():
    """A reader sees at the top what a module needs; a slow import that few runs need can wait."""
    own = [
        each
        for module in MODULES
        for each in imports(module)
        if room(module) != "runtime" and each.module.startswith("idlc.") and not each.for_types
    ]
    within = [each for each in own if not each.at_once]
    assert len(within) / len(own) <= MOST_IN_FUNCTIONS


def test_folders_and_the_house_stay_small():
    assert len(MODULES) <= MOST_MODULES
    folders = Counter(name_of(path.parent) for path in MODULES.values())
    crowded = {folder for folder, number in folders.items() if number > MOST_IN_A_FOLDER}
    assert crowded <= CROWDED


def only_forwards(module: str) -> bool:
    """Return whether a module holds names of others and nothing of its own."""
    return all(
        isinstance(statement, (ast.Import, ast.ImportFrom))
        or (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant))
        or (
            isinstance(statement, ast.Assign)
            and isinstance(statement.value, (ast.Name, ast.Attribute, ast.List, ast.Tuple))
            and all(isinstance(name, ast.Name) for name in statement.targets)
            and (
                statement.targets[0].id == "__all__"
                or isinstance(statement.value, (ast.Name, ast.Attribute))
            )
        )
        for statement in tree(module).body
    )


def test_nothing_but_a_package_only_forwards():
    modules = [name for name, path in MODULES.items() if path.name != "__init__.py"]
    assert [name for name in modules if only_forwards(name)] == []


@pytest.mark.parametrize(
    "module",
    [name for name, path in MODULES.items() if path.name == "__init__.py" and name.count(".") == 1],
)
def test_a_room_says_what_it_offers_without_loading_it(module):
    assert ast.get_docstring(tree(module))
    if room(module) not in OFFERED_AT_ONCE:
        assert [each for each in imports(module) if not each.for_types] == []


@pytest.mark.parametrize("module", [name for name in MODULES if room(name) in CORE])
def test_the_core_does_no_io(module):
    allowed = {"pathlib"} if module in READS_ITS_OWN else set()
    for each in imports(module):
        top = each.module.split(".")[0]
        assert top in allowed or top not in IO_MODULES, f"line {each.line}: imports {top}"
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in IO_CALLS, f"line {node.lineno}: calls {node.func.id}"


def test_records_are_structs_or_named_tuples():
    """The runtime knows dataclasses, because the generated classes are some."""
    names = [name for name in MODULES if room(name) != "runtime"]
    assert [name for name in names for each in imports(name) if each.module == "dataclasses"] == []


def prints(node: ast.AST) -> bool:
    match node:
        case ast.Call(func=ast.Name(id="print")):
            return True
        case ast.Attribute(value=ast.Name(id="sys"), attr="stdout" | "stderr"):
            return True
    return False


def test_only_the_command_line_prints():
    printing = {
        module
        for module in MODULES
        if room(module) not in {"cli", "runtime"} and any(map(prints, ast.walk(tree(module))))
    }
    assert printing == set(PRINTS)


@pytest.mark.parametrize("module", RUNTIME)
def test_the_runtime_stands_alone(module):
    with_numpy = [module == name or module.startswith(f"{name}.") for name in NUMPY_AT_ONCE]
    for each in imports(module):
        top = each.module.split(".")[0]
        at_once = each.at_once and not each.for_types
        if each.for_types:
            continue
        if each.level:
            assert room(each.module) == "runtime", f"line {each.line}: reaches outside the package"
            borrowed = any(
                each.module == name or each.module.startswith(f"{name}.") for name in NUMPY_AT_ONCE
            )
            assert any(with_numpy) or not (at_once and borrowed), (
                f"line {each.line}: imports numpy at once"
            )
        elif top not in sys.stdlib_module_names:
            assert top in RUNTIME_ON_DEMAND, f"line {each.line}: imports {each.module}"
            assert (any(with_numpy) and top == "numpy") or not at_once, (
                f"line {each.line}: imports {each.module} at once"
            )


# templates


def template_risks(node: nodes.Node) -> Iterator[str]:
    """Yield each way in which a template could undo an escape, or run what Python offers."""
    match node:
        case nodes.Filter(name="attr" | "safe"):
            yield f"line {node.lineno}: filter {node.name}"
        case nodes.Call():
            if not isinstance(node.node, nodes.Name):  # a macro
                yield f"line {node.lineno}: call of a method"
        case nodes.Getattr():
            if node.attr.startswith("_"):
                yield f"line {node.lineno}: attribute {node.attr}"
        case nodes.EvalContextModifier() | nodes.MarkSafe() | nodes.MarkSafeIfAutoescape():
            yield f"line {node.lineno}: turns escaping on or off"
    for child in node.iter_child_nodes():
        yield from template_risks(child)


@pytest.mark.parametrize("path", TEMPLATES, ids=name_of)
def test_templates_call_nothing_but_macros(path):
    text = path.read_text(encoding="utf-8")
    assert list(template_risks(Environment(autoescape=True).parse(text))) == []


# documents


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
    text = "".join((DOCS / page).read_text(encoding="utf-8") for page in HOUSE_PAGES)
    named = re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", text)
    assert len(named) >= 60
    for path, function in named:
        source = ROOT / path
        assert source.exists(), path
        assert f"def {function}" in source.read_text(encoding="utf-8"), f"{path}::{function}"
    assert text.count("\n1. ") == 1
    assert "\n13. " not in text, "more invariants than anyone remembers"


def test_this_document_names_real_modules():
    """A name in a row of the table is of a room in that row, any other is whole."""
    for line in (DOCS / HOUSE_PAGES[0]).read_text(encoding="utf-8").splitlines():
        rooms = [ROOT / path for path in re.findall(r"`(idlc/[\w/]+)/`", line)]
        for path in re.findall(r"`([a-z][\w/]*\.(?:py|lark)|[a-z]+/)`", line):
            folders = [*rooms, ROOT] if line.startswith("|") else [ROOT / "idlc", ROOT]
            assert any((folder / path).exists() for folder in folders), path


def test_every_folder_of_tests_is_explained():
    text = (DOCS / "contributing/tests.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"(?m)^\| `(tests/\w+)/` \|.*\| (.*) \|$", text))
    folders = {name_of(path.parent) for path in (ROOT / "tests").glob("*/__init__.py")}
    assert rows.keys() == folders
    for folder, files in rows.items():
        for name in re.findall(r"`(\w+\.py)`", files):
            assert (ROOT / folder / name).exists(), f"{folder}/{name}"
    rooms = {path.parent.name for path in (ROOT / "idlc").glob("*/__init__.py")}
    assert {f"tests/{name}" for name in rooms} <= rows.keys()


# starting up


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
    found = imported_by("check", "msg/Drive.msg", cwd=tmp_path, given="msgspec, lark")
    needless = {"argparse", "ast", "click", "dataclasses", "hashlib", "importlib.metadata"}
    needless |= {"importlib.resources", "inspect", "jinja2", "json", "logging"}
    needless |= {"numpy", "pkgutil", "rich", "shutil", "subprocess", "tempfile", "tomllib"}
    assert needless & found == set()
    own = {name for name in found if name.partition(".")[0] == "idlc"}
    assert "idlc.check.manifest" in own
    assert "idlc.scaffold" not in own
    assert len(own) <= 82, "what a run without problems does not need can wait"


def test_commands_without_a_robot_import_nothing_of_robots(tmp_path):
    for words in (("gen", str(EXAMPLE), "-o", "out"), ("show", "std_msgs/msg/String")):
        assert [name for name in imported_by(*words, cwd=tmp_path) if ".robot" in name] == []
