"""Three tiers of tests by measured cost: `quick`, `test` and `long`, from one committed table.

The table names each test that takes more than QUICK CPU-seconds, the programs that it starts
included. A test that the table does not name is quick. What a fixture of a module or of the session
costs is divided among the tests that use it. `make costs` measures, and rewrites the table.
"""

from __future__ import annotations

import argparse
import json
import os
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from math import inf
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.support.paths import ROOT

TABLE = ROOT / "tests/costs.tsv"
#: CPU-seconds up to which a test is quick, and up to which it is not long.
QUICK = 0.1
LONG = 0.4
TIERS = ("quick", "test", "long")
#: The number of turns among which `--turn` divides the tests of the tier long.
TURNS = 4
#: The names of all tests of a run, before any is left out.
COLLECTED = pytest.StashKey[set[str]]()
HEADER = f"""\
# CPU-seconds of each test that takes more than {QUICK}, written by `make costs`
# above {LONG}: `make test-long`
"""


class Costs(NamedTuple):
    """The CPU-seconds of the tests that are not quick."""

    seconds: dict[str, float]

    @classmethod
    def read(cls, path: Path = TABLE) -> Costs:
        """Read a table."""
        lines = path.read_text(encoding="utf-8").splitlines()
        rows = [line.partition("\t") for line in lines if not line.startswith("#")]
        return cls({test: float(seconds) for seconds, _, test in rows})

    def write(self, path: Path = TABLE) -> None:
        """Write a table, the most expensive tests first."""
        rounded = {test: round(seconds, 2) for test, seconds in self.seconds.items()}
        rows = sorted(rounded.items(), key=lambda row: (-row[1], row[0]))
        lines = [f"{seconds}\t{test}\n" for test, seconds in rows if seconds > QUICK]
        path.write_text(HEADER + "".join(lines), encoding="utf-8")

    def of(self, test: str) -> float:
        """Return the CPU-seconds of a test, 0 if it is quick."""
        return self.seconds.get(test, 0.0)

    def tier(self, test: str) -> str:
        """Return the tier of a test."""
        seconds = self.of(test)
        if seconds > LONG:
            return "long"
        return "test" if seconds > QUICK else "quick"


@cache
def committed() -> Costs:
    """Return the committed table."""
    return Costs.read()


def tiers(item: pytest.Item) -> set[str]:
    """Return the tiers that run a test."""
    tier = committed().tier(item.nodeid)
    if tier == "long" or item.get_closest_marker("long"):
        return {"long"}
    if item.get_closest_marker("rounds"):
        return {tier, "test", "long"}
    return {tier, "test"}


@cache
def turns() -> dict[str, int]:
    """Return the turn of each file in the table: files of similar cost have different turns."""
    files: dict[str, float] = defaultdict(float)
    for test, seconds in committed().seconds.items():
        files[test.partition("::")[0]] += seconds
    by_cost = sorted(files, key=files.__getitem__, reverse=True)
    return {file: number % TURNS for number, file in enumerate(by_cost)}


def is_due(item: pytest.Item, turn: int) -> bool:
    """Return whether a test runs in a turn. Long tests of one file share fixtures, and turns."""
    file = item.nodeid.partition("::")[0]
    return "long" not in tiers(item) or turns().get(file, 0) == turn % TURNS


class Meter:
    """Measures the CPU-seconds of tests and of shared fixtures in one process that runs tests."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.tests: dict[str, float] = {}
        self.fixtures: dict[str, float] = {}
        self.users: dict[str, list[str]] = {}
        self._in_fixtures = 0.0

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Measure a test with its own fixtures."""
        started, before = cpu_seconds(), self._in_fixtures
        try:
            return (yield)
        finally:
            shared = self._in_fixtures - before
            self.tests[item.nodeid] = cpu_seconds() - started - shared
            self.users[item.nodeid] = list(getattr(item, "fixturenames", ()))

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[object], request: pytest.FixtureRequest
    ) -> Iterator[None]:
        """Measure a fixture that several tests share."""
        started, before = cpu_seconds(), self._in_fixtures
        try:
            return (yield)
        finally:
            if fixturedef.scope != "function":
                spent = cpu_seconds() - started - (self._in_fixtures - before)
                key = f"{request.node.nodeid}\t{fixturedef.argname}"
                self.fixtures[key] = self.fixtures.get(key, 0.0) + spent
                self._in_fixtures = before + cpu_seconds() - started

    def pytest_sessionfinish(self) -> None:
        """Write what was measured."""
        self.folder.mkdir(parents=True, exist_ok=True)
        worker = os.environ.get("PYTEST_XDIST_WORKER", "alone")
        measured = {"tests": self.tests, "fixtures": self.fixtures, "users": self.users}
        (self.folder / f"{worker}.json").write_text(json.dumps(measured), encoding="ascii")


def cpu_seconds() -> float:
    """Return the CPU-seconds of this process and of all that it started, also what still runs."""
    return sum(os.times()[:4]) + _of_children(os.getpid())


def _of_children(process: int) -> float:
    """Return the CPU-seconds of processes that run, and of the children that they waited for."""
    total = 0.0
    for path in Path(f"/proc/{process}/task").glob("*/children"):
        for child in _read(path).split():
            stat = _read(Path(f"/proc/{child}/stat"))
            if not stat:
                continue
            ticks = stat.rpartition(")")[2].split()[11:15]
            total += sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK") + _of_children(int(child))
    return total


def _read(path: Path) -> str:
    """Return a file of /proc, empty if its process or thread ended meanwhile."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""


def measured(folder: Path) -> dict[str, float]:
    """Return what a `Meter` in each process measured, with shared fixtures divided among tests."""
    tests: dict[str, float] = {}
    fixtures: dict[str, list[float]] = defaultdict(list)
    users: dict[str, list[str]] = {}
    for path in folder.glob("*.json"):
        part = json.loads(path.read_text(encoding="ascii"))
        tests.update(part["tests"])
        users.update(part["users"])
        for key, seconds in part["fixtures"].items():
            fixtures[key].append(seconds)
    for key, seconds in fixtures.items():
        node, _, name = key.partition("\t")
        sharing = [test for test in tests if test.startswith(node) and name in users[test]]
        for test in sharing:
            tests[test] += sum(seconds) / len(seconds) / len(sharing)
    return tests


def main() -> None:
    """Write the table, or with `--repeat FILE` the tests to measure again, in the reverse order.

    The arguments are folders that `--costs` wrote. The first test that needs a module pays for its
    import, and so on; in another order, another test is the first. The smallest figure counts.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--repeat", type=Path)
    options = parser.parse_args()
    runs = [measured(folder) for folder in options.folders]
    seconds = {test: min(run.get(test, inf) for run in runs) for run in runs for test in run}
    if options.repeat:
        tests = [test for test in reversed(seconds) if seconds[test] > QUICK]
        options.repeat.write_text(json.dumps(tests), encoding="ascii")
    else:
        Costs(seconds).write()


if __name__ == "__main__":
    main()
