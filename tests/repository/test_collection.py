"""Collecting the tests imports no library that is slow to import; each process of a run does it."""

import re
import subprocess
import sys

from tests.support.paths import ROOT

TESTS = ROOT / "tests"
#: What takes a tenth of a second or more, alone or with what it imports.
SLOW = "IPython,dask,daft,distributed,duckdb,launch,matplotlib,pandas,polars,rclpy"
#: Imports modules, and prints which line of the tests was the first to import each slow library.
PROGRAM = """
import importlib, sys, traceback
import pytest

slow, modules = (words.split(",") for words in sys.argv[1:])

class Watch:
    def find_spec(self, name, path=None, target=None):
        if name in slow:
            lines = [line for line in traceback.extract_stack() if "/tests/" in line.filename]
            print(f"{lines[-1].filename}:{lines[-1].lineno} imports {name}")

sys.meta_path.insert(0, Watch())
for module in modules:
    try:
        importlib.import_module(module)
    except (ImportError, pytest.skip.Exception):
        continue  # it needs what this machine does not have
"""


def test_test_modules_import_nothing_slow():
    paths = [*TESTS.rglob("conftest.py"), *TESTS.rglob("test_*.py")]
    modules = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in paths]
    assert len(modules) > 200
    command = [sys.executable, "-c", PROGRAM, SLOW, ",".join(sorted(modules))]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "", "import it in the test: collecting tests becomes slow"


def test_hypothesis_has_the_settings_of_this_project():
    """tests/support/examples.py has them, so that tests without Hypothesis do not import it."""
    direct = re.compile(r"^\s*(from|import) hypothesis\b", re.MULTILINE)
    files = [path for path in TESTS.rglob("*.py") if direct.search(path.read_text("utf-8"))]
    assert files == [TESTS / "support/examples.py"]
