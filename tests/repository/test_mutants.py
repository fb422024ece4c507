"""Small mistakes that `make mutants` makes in idlc, and the lines that it records."""

import ast
import json
import subprocess
import sys

import pytest

from maintenance.mutants.lines import Lines, key
from maintenance.mutants.mutations import choose, mutations
from tests.support.paths import ROOT

SOURCE = '''\
"""A module, about 1 thing."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    LIMIT = 3


def f(x: "int | 1") -> int:
    """Say 1."""
    é = x <= 2; y = True
    print(f"{x!r:>1}", é)
    return y
'''


def changed(mistake):
    before, after = SOURCE.splitlines(), mistake.applied(SOURCE).splitlines()
    ((old, new),) = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert old == before[mistake.line - 1]
    return mistake.kind, new.strip()


def test_mistakes_are_in_what_runs():
    assert sorted(map(changed, mutations("m.py", SOURCE))) == [
        ("comparison", "é = (x < 2); y = True"),
        ("constant", "é = x <= 2; y = False"),
        ("constant", "é = x <= 3; y = True"),
        ("removed statement", "pass"),
        ("removed statement", "pass; y = True"),
        ("removed statement", "é = x <= 2; pass"),
        ("return", "return None"),
    ]


def test_every_mistake_can_be_made():
    source = (ROOT / "idlc/wire/layout.py").read_text(encoding="utf-8")
    for mistake in mutations("layout.py", source):
        ast.parse(mistake.applied(source))


def test_a_seed_chooses_among_executed_lines():
    def executed(file):
        return set(range(20, 200)) if file.startswith("idlc/wire/") else set()

    chosen = choose(ROOT, executed, 20, seed=3)
    assert chosen == choose(ROOT, executed, 20, seed=3) != choose(ROOT, executed, 20, seed=4)
    assert {mistake.file.split("/")[1] for mistake in chosen} == {"wire"}
    assert len(set(chosen)) == 20


TESTS = """\
import subprocess
import sys

def test_here():
    from idlc.model.python_names import modules
    modules([])

def test_there():
    subprocess.run([sys.executable, "-m", "idlc", "explain", "IDL101"], check=True)

def test_nothing():
    pass
"""


def test_the_lines_of_tests_and_of_their_programs_are_recorded(tmp_path):
    pytest.importorskip("coverage")
    (tmp_path / "test_it.py").write_text(TESTS, encoding="utf-8")
    plugin = ["-p", "maintenance.mutants.plugin", "--lines", str(tmp_path / "lines")]
    words = [
        *plugin,
        "-p",
        "no:cacheprovider",
        "--rootdir",
        str(ROOT),
        "-c",
        str(ROOT / "pyproject.toml"),
    ]
    subprocess.run([sys.executable, "-m", "pytest", *words, str(tmp_path)], cwd=ROOT, check=True)
    names = json.loads((tmp_path / "lines/tests.json").read_text(encoding="ascii"))
    keys = {key(name): name.partition("::")[2] for name in names}
    lines = Lines(tmp_path / "lines", ROOT)

    def tests_of(file):
        return {keys[test] for line in lines.executed(file) for test in lines.tests_of(file, line)}

    assert tests_of("idlc/model/python_names.py") == {"test_here"}
    assert tests_of("idlc/cli/look.py") == {"test_there"}
