"""Tests wait for one thing for 30 seconds at most, and then name what they wait for."""

import ast
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from tests.support import waiting
from tests.support.paths import ROOT

#: Methods that wait without an end if no argument gives a limit.
ENDLESS = {"acquire", "get", "join", "wait"}
LIMITS = {"limit", "patience", "time_to_wait", "timeout", "timeout_sec"}
WAITING = {"communicate", "join", "result", "wait", "wait_for_server", "wait_for_service"}


def waits(source: str) -> Iterator[str]:
    """Yield each wait that has no limit, or one that no comment in its line explains."""
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Call(func=ast.Attribute(attr=name), args=[], keywords=[]) if name in ENDLESS:
                problem = "no limit"
            case ast.Call(func=ast.Attribute(attr=name), args=args, keywords=keywords):
                limits = [word.value for word in keywords if word.arg in LIMITS]
                limits += args if name in WAITING else []
                problem = "a long limit" if any(map(is_long, limits)) else ""
            case ast.Assign(targets=[ast.Name(id="PATIENCE" | "TIMEOUT" | "LONG")], value=value):
                problem = "a long limit" if is_long(value) else ""
            case ast.Assert() if "monotonic()" in ast.unparse(node.test):
                problem = "a loop of its own; use wait_for"
            case _:
                problem = ""
        if problem and "#" not in lines[node.lineno - 1]:
            yield f"{node.lineno}: {problem}: {ast.unparse(node).splitlines()[0]}"


def is_long(limit: ast.expr) -> bool:
    return isinstance(limit, ast.Constant) and (
        isinstance(limit.value, int | float) and limit.value > waiting.LIMIT
    )


def test_each_wait_ends():
    problems = [
        f"{path.relative_to(ROOT)}:{problem}"
        for path in sorted((ROOT / "tests").rglob("*.py"))
        for problem in waits(path.read_text(encoding="utf-8"))
    ]
    assert problems == []


@pytest.mark.parametrize(
    "wait",
    [
        "thread.join()",
        "event.wait()",
        "replies.get()",
        "process.communicate(timeout=60)",
        "event.wait(31)",
        "future.result(90.0)",
        "PATIENCE = 60",
        "while not done():\n assert time.monotonic() < end",
    ],
)
def test_endless_and_long_waits_are_found(wait):
    assert len([*waits(wait)]) == 1


@pytest.mark.parametrize(
    "wait",
    [
        "thread.join(LIMIT)",
        "', '.join(names)",
        "replies.get(timeout=5)",
        "x.wait()  # a reason",
    ],
)
def test_short_and_explained_waits_are_not(wait):
    assert [*waits(wait)] == []


HANGS = [sys.executable, "-c", "import time; time.sleep(30)"]


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(waiting, "PROGRAM", 0.1)


def test_a_program_that_hangs_is_named(impatient):
    with pytest.raises(subprocess.TimeoutExpired, match=r"time.sleep.* timed out after "):
        subprocess.run(HANGS, check=False)
    with subprocess.Popen(HANGS) as process:
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait()  # with the limit that it has by itself
        process.kill()
        process.wait(30)


def test_programs_that_install_and_build_have_more_time():
    assert waiting.limit_of([sys.executable, "-m", "pip", "install", "x"]) == waiting.WORK
    assert waiting.limit_of("cmake -P script.cmake") == waiting.WORK
    assert waiting.limit_of([sys.executable, "-m", "idlc", "gen", "pipe"]) == waiting.PROGRAM


def test_a_wait_in_vain_shows_its_condition():
    numbers = []
    with pytest.raises(
        AssertionError, match=r"in vain for waiting.wait_for\(lambda: numbers == \[1\]"
    ):
        waiting.wait_for(lambda: numbers == [1], limit=0)
    with pytest.raises(AssertionError, match="in vain for the router to listen"):
        waiting.wait_for(lambda: numbers, "the router to listen", limit=0)
    assert waiting.wait_for(lambda: len(numbers) == 3, between=lambda: numbers.append(1))


def test_a_thread_that_runs_on_is_named(monkeypatch):
    monkeypatch.setattr(waiting, "LIMIT", 0.01)
    is_over = threading.Event()
    thread = threading.Thread(target=is_over.wait, args=[30], name="runs on", daemon=True)
    thread.start()
    try:
        with pytest.raises(AssertionError, match=r"in vain for the end of .*runs on"):
            waiting.join(thread)
    finally:
        is_over.set()
