"""A pytest plugin: `--lines FOLDER` records which tests execute which lines of idlc.

coverage measures the process of the tests and the programs that they start. Its contexts are keys
of the tests in FOLDER/tests.json. A copy of the runtime in a generated package counts as
idlc/runtime.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path

import coverage
import pytest

from maintenance.mutants.lines import OUTSIDE, key

#: The variable in which a program reads the test that started it.
TEST = "IDLC_MUTANTS_TEST"
CONFIG = f"""\
[run]
core = ctrace
include =
    {{root}}/idlc/*
    */_idlc/*
data_file = {{folder}}/data
parallel = true
context = ${{{{{TEST}-{OUTSIDE}}}}}
disable_warnings =
    no-data-collected
    module-not-measured
    couldnt-parse
"""


class Recorder:
    """Hooks that pytest calls while tests run, in each worker."""

    def __init__(self, folder: Path, root: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        config = folder / f"coverage-{os.getpid()}.ini"
        config.write_text(CONFIG.format(folder=folder, root=root), encoding="utf-8")
        os.environ["COVERAGE_PROCESS_START"] = str(config)
        os.environ.pop(TEST, None)
        self.coverage = coverage.Coverage(config_file=str(config))
        self.coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Count what runs during a test as its."""
        os.environ[TEST] = key(item.nodeid)
        self.coverage.switch_context(key(item.nodeid))
        try:
            return (yield)
        finally:
            del os.environ[TEST]
            self.coverage.switch_context("")

    def pytest_sessionfinish(self) -> None:
        """Write what was recorded."""
        self.coverage.stop()
        self.coverage.save()

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Write the names of the tests."""
        names = [item.nodeid for item in session.items]
        (self.folder / "tests.json").write_text(json.dumps(names), encoding="ascii")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option."""
    parser.addoption("--lines", metavar="FOLDER", help="record the lines that each test executes")


def pytest_configure(config: pytest.Config) -> None:
    """Record in the processes that run tests: the workers, or the only process."""
    folder = config.getoption("lines")
    alone = not config.getoption("numprocesses", None)
    if folder and (alone or hasattr(config, "workerinput")):
        config.pluginmanager.register(Recorder(Path(folder).absolute(), config.rootpath))
