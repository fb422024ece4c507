"""Decisions that can be read once: limits for functions that ruff does not count."""

import ast

import pytest
from radon.complexity import cc_visit

from tests.support.paths import ROOT

MOST_DECISIONS = 20
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


@pytest.mark.parametrize("path", sorted(MODULES))
def test_decisions_can_be_read_once(path):
    text = ROOT.joinpath(path).read_text(encoding="utf-8")
    tree = ast.parse(text)
    long = [each.name for each in functions(cc_visit(text)) if each.complexity > MOST_DECISIONS]
    filtered = [loop.lineno for loop in loops(tree) if sum(len(g.ifs) for g in loop.generators) > 1]
    nested = [node.lineno for node in conditionals(tree) if len(conditionals(node)) > 1]
    assert (long, filtered, nested) == ([], [], [])
