import faulthandler
import gc
import json
import os
import signal
import sys
import tempfile
from pathlib import Path

import pytest

import tests.support.shell  # noqa: F401 - first, see there
from tests.support import costs, generated, waiting
from tests.support.windows import NOT_THERE

# Who starts tests in the background may ignore these, and what tests start would, too.
for name, handler in (("SIGINT", signal.default_int_handler), ("SIGHUP", signal.SIG_DFL)):
    number = getattr(signal, name, None)  # Windows has only the first
    if number is not None and signal.getsignal(number) == signal.SIG_IGN:
        signal.signal(number, handler)

waiting.limit_programs()

# What tests load is kept for this run alone, in all its processes.
CACHE = tempfile.TemporaryDirectory(prefix="idlc-cache-")
os.environ["IDLC_CACHE"] = CACHE.name

# Seconds until a process is ended whose test hangs in machine code: pytest-timeout cannot end it.
HANG = 400
# A copy of the standard error, which pytest replaces while a test runs.
STDERR = pytest.StashKey[int]()

# Where pytest keeps the names of the tests that passed in the last run, for --left-out.
PASSED = "idlc/passed"


def pytest_addoption(parser):
    parser.addoption("--tier", choices=costs.TIERS, help="which tests to run, by what they cost")
    parser.addoption(
        "--left-out",
        action="store_true",
        help="run what has not passed in earlier runs, besides what takes long with --tier long",
    )
    parser.addoption("--turn", type=int, help="leave out long tests that have another turn")
    parser.addoption("--only", type=Path, help="run what this JSON file names, in its order")
    parser.addoption("--costs", type=Path, help="measure what tests cost, in files of this folder")


def pytest_configure(config):
    config.stash[STDERR] = os.dup(2)
    if config.getoption("tier") == "long":
        os.environ.setdefault("IDLC_ROUNDS", "1")
    runs_tests = hasattr(config, "workerinput") or not config.getoption("numprocesses", None)
    if runs_tests:
        gc.disable()  # until all tests are collected
    if config.getoption("costs") and runs_tests:
        config.pluginmanager.register(costs.Meter(config.getoption("costs")))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Leave out on Windows, and name, what cannot be there; select what the options name."""
    config.stash[costs.COLLECTED] = {item.nodeid for item in items}
    for item in items if sys.platform == "win32" else ():
        for name, reason in NOT_THERE.items():
            if name in item.nodeid:
                item.add_marker(pytest.mark.skip(reason=reason))
    tier = config.getoption("tier")
    selected = items if tier is None else [item for item in items if tier in costs.tiers(item)]
    if config.getoption("left_out"):
        passed = set(config.cache.get(PASSED, []))
        left_out = {item for item in items if item.nodeid not in passed}
        wanted = left_out.union(selected) if tier == "long" else left_out.intersection(selected)
        selected = [item for item in items if item in wanted]
    turn = config.getoption("turn")
    if turn is not None:
        selected = [item for item in selected if costs.is_due(item, turn)]
    if config.getoption("only"):
        order = json.loads(config.getoption("only").read_text(encoding="ascii"))
        by_name = {item.nodeid: item for item in selected}
        selected = [by_name[name] for name in order if name in by_name]
    if selected is not items:
        config.hook.pytest_deselected(items=list(set(items).difference(selected)))
        items[:] = selected


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    """Print where the threads of a test that hangs are, and end this process."""
    if item.config.getoption("timeout") != 0 and not item.get_closest_marker("timeout"):
        faulthandler.dump_traceback_later(HANG, exit=True, file=item.config.stash[STDERR])
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


def pytest_collection_finish():
    """Keep the collector of garbage from looking at all tests again and again."""
    gc.freeze()
    gc.enable()


def pytest_sessionfinish(session):
    """Accept that nothing is left to run."""
    if (
        session.config.getoption("left_out")
        and session.exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED
    ):
        session.exitstatus = pytest.ExitCode.OK


def pytest_terminal_summary(terminalreporter, config):
    """Keep the names of tests that passed, and print what tests recorded as found."""
    passed = {report.nodeid for report in terminalreporter.getreports("passed")}
    if config.getoption("left_out") or config.getoption("lf", default=False):
        passed.update(config.cache.get(PASSED, []))
    if hasattr(config, "cache"):  # without -p no:cacheprovider
        config.cache.set(PASSED, sorted(passed))
    for report in terminalreporter.getreports("passed"):
        for name, value in report.user_properties:
            if name == "found":
                terminalreporter.write_line(f"{report.nodeid}: {value}")


@pytest.fixture(scope="session", autouse=True)
def nested_folders(tmp_path_factory):
    """Keep pytest, where a test starts it, from removing the folders of all earlier runs."""
    os.environ["PYTEST_DEBUG_TEMPROOT"] = str(tmp_path_factory.mktemp("nested"))


@pytest.fixture
def here(tmp_path, monkeypatch):
    """The working folder, which is empty."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="session")
def standard_folder(tmp_path_factory):
    """A folder with the catalogue and the recorded packages, generated."""
    folder = tmp_path_factory.mktemp("generated")
    for package, files in generated.catalog_files().items():
        generated.write_package(folder, package, files)
    for path in sorted(generated.RECORDED.iterdir()):
        generated.write_package(folder, path.name, generated.files_of(path))
    return folder


@pytest.fixture(scope="module")
def standard(standard_folder):
    """The packages of `standard_folder`, importable for one test module."""
    with generated.importable(standard_folder):
        yield standard_folder
