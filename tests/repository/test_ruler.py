"""Decisions that can be read once: limits for functions that ruff does not count."""

import ast

import pytest
from radon.complexity import cc_visit

from tests.support.paths import ROOT

MOST_DECISIONS = 20
#: Modules with a decision that is longer still. Delete rows, add none.
ABOVE = {
    "idlc/check/cmake_lists.py",
    "idlc/check/installation.py",
    "idlc/cli/init.py",
    "idlc/packaging/facts.py",
    "idlc/packaging/layout.py",
    "idlc/packaging/setup_edits.py",
    "idlc/packaging/setup_py.py",
    "idlc/recordings/columns/plan.py",
    "idlc/recordings/containers/bag.py",
    "idlc/robot/live/graph.py",
    "idlc/robot/live/overview.py",
    "idlc/robot/live/types.py",
    "idlc/robot/nodes/overrides.py",
    "idlc/scaffold/init.py",
    "idlc/scaffold/layouts.py",
    "idlc/scaffold/package.py",
    "idlc/tasks/breaking/graph.py",
    "idlc/tasks/breaking/recordings.py",
    "idlc/versions/conversion.py",
    "idlc/versions/converters.py",
    "idlc/versions/stubs.py",
}
MODULES = {path.relative_to(ROOT).as_posix() for path in ROOT.joinpath("idlc").rglob("*.py")}


def functions(blocks):
    for block in blocks:
        if hasattr(block, "methods"):
            yield from functions(block.methods)
        else:
            yield block
            yield from functions(block.closures)


def loops(tree):
    kinds = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
    return (node for node in ast.walk(tree) if isinstance(node, kinds))


def conditionals(tree):
    return [node for node in ast.walk(tree) if isinstance(node, ast.IfExp)]


@pytest.mark.parametrize("path", sorted(MODULES - ABOVE))
def test_decisions_can_be_read_once(path):
    text = ROOT.joinpath(path).read_text(encoding="utf-8")
    tree = ast.parse(text)
    long = [each.name for each in functions(cc_visit(text)) if each.complexity > MOST_DECISIONS]
    filtered = [loop.lineno for loop in loops(tree) if sum(len(g.ifs) for g in loop.generators) > 1]
    nested = [node.lineno for node in conditionals(tree) if len(conditionals(node)) > 1]
    assert (long, filtered, nested) == ([], [], [])
