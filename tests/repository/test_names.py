"""One name, one concept: a search for a class or an alias finds one definition."""

import ast
from collections import defaultdict

from tests.support.paths import ROOT

#: The syntax of an element and its meaning, side by side, and what rclpy calls as `model.ir` does.
PAIRS = {
    "Constant": {"idlc/language/tree.py", "idlc/model/ir.py"},
    "Field": {"idlc/language/tree.py", "idlc/model/ir.py"},
    "Service": {"idlc/model/ir.py", "idlc/robot/nodes/services.py"},
}


def defined(tree):
    """Yield the names of the public classes and aliases of a module."""
    for statement in tree.body:
        if isinstance(statement, ast.ClassDef):
            names = [statement.name]
        elif isinstance(statement, ast.Assign):
            names = [target.id for target in statement.targets if isinstance(target, ast.Name)]
        elif isinstance(statement, ast.AnnAssign):
            names = [statement.target.id]
        else:
            continue
        # constants are in capitals
        yield from (name for name in names if name[0].isupper() and not name.isupper())


def test_no_class_or_alias_is_defined_twice():
    """The runtime stands alone, in the packages of others."""
    places = defaultdict(set)
    for path in ROOT.joinpath("idlc").rglob("*.py"):
        name = path.relative_to(ROOT).as_posix()
        if not name.startswith("idlc/runtime/"):
            for each in defined(ast.parse(path.read_text(encoding="utf-8"))):
                places[each].add(name)
    assert {name: where for name, where in places.items() if len(where) > 1} == PAIRS
