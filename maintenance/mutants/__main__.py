"""`python -m maintenance.mutants`: make mistakes in idlc, and see which tests notice them."""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

from maintenance.mutants.lines import Lines, key
from maintenance.mutants.mutations import Mutation, choose
from tests.support.costs import TABLE, TIERS, Costs

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "build/mutants"
#: Tests that cost more CPU-seconds than the last number run after those that cost less.
STEPS = (0.05, 0.3, 1.0, 3.0, float("inf"))
#: A test that takes longer, in seconds, hangs because of the mistake, which is thereby noticed.
HANG = 120


class Outcome(NamedTuple):
    """The result for a mistake: the test that failed, or None, and how many ran."""

    mutation: Mutation
    test: str | None
    ran: int
    seconds: float


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__)
    parser.add_argument("--number", type=int, default=80, help="how many mistakes to make")
    parser.add_argument("--seed", type=int, default=1, help="which mistakes to make")
    parser.add_argument("--jobs", type=int, default=2, help="how many to try at a time")
    parser.add_argument("--tier", choices=TIERS, help="which tests to run; otherwise all")
    options = parser.parse_args()
    lines = FOLDER / "lines"
    clones = [clone(number) for number in range(options.jobs)]
    commit, state = lines / "commit", f"{head()} {options.tier}"
    if not commit.exists() or commit.read_text(encoding="ascii") != state:
        record(clones[0], lines, options.tier)
        commit.write_text(state, encoding="ascii")
    recorded = Lines(lines, clones[0])
    tests = json.loads((lines / "tests.json").read_text(encoding="ascii"))
    chosen = choose(clones[0], recorded.executed, options.number, options.seed)
    outcomes = list(run(chosen, recorded, tests, clones))
    print(report(outcomes, Costs.read(TABLE)))
    return 0


def clone(number: int) -> Path:
    """Return a clone of the last commit with an environment, in which mistakes are made."""
    folder = FOLDER / f"clone-{number}"
    if not folder.exists():
        git("clone", "--quiet", "--shared", str(ROOT), str(folder))
    git("-C", str(folder), "fetch", "--quiet", "origin")
    git("-C", str(folder), "checkout", "--quiet", "--force", "--detach", head())
    make = ["make", "-C", str(folder), "--no-print-directory", "environment"]
    subprocess.run(make, check=True)
    subprocess.run([python(folder), "-m", "pip", "install", "--quiet", "coverage"], check=True)
    return folder


def head() -> str:
    """Return the commit whose tests are tried: what is not committed is left out."""
    return git("rev-parse", "HEAD").strip()


def git(*words: str) -> str:
    """Run git in this repository, and return what it prints."""
    done = subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True)
    return done.stdout


def python(folder: Path) -> str:
    """Return the interpreter of a clone's environment."""
    return str(next(folder.glob(".venv/test-*/bin/python")))


def record(folder: Path, lines: Path, tier: str | None) -> None:
    """Run the tests of a clone, and record which lines of idlc they execute."""
    shutil.rmtree(lines, ignore_errors=True)
    # as many processes as `make test` has, since many tests wait
    words = ["-p", "maintenance.mutants.plugin", "--lines", str(lines), "-n", "6"]
    words += ["--tier", tier] if tier else []
    # once the folder of --lines exists, pytest would look for its root and for tests from there
    words += ["-q", "--timeout", "900", "--rootdir", ".", "tests"]
    done = subprocess.run([python(folder), "-m", "pytest", *words], cwd=folder, check=False)
    if done.returncode > 1:
        sys.exit("the tests cannot be recorded")


def run(
    chosen: list[Mutation], recorded: Lines, tests: list[str], clones: list[Path]
) -> Iterator[Outcome]:
    """Try each mistake in a clone, as many at a time as there are clones."""
    costs = Costs.read(TABLE)
    free: SimpleQueue[Path] = SimpleQueue()
    for folder in clones:
        free.put(folder)

    def attempt(mutation: Mutation) -> Outcome:
        keys = recorded.tests_of(mutation.file, mutation.line)
        candidates = [test for test in tests if key(test) in keys]
        folder = free.get()
        try:
            outcome = try_mutation(folder, mutation, candidates, costs)
        finally:
            free.put(folder)
        print(row(outcome, costs), flush=True)
        return outcome

    with ThreadPoolExecutor(len(clones)) as pool:
        yield from pool.map(attempt, chosen)


def try_mutation(folder: Path, mutation: Mutation, tests: list[str], costs: Costs) -> Outcome:
    """Run the tests of a line with the mistake in it, cheapest first, until one fails."""
    path = folder / mutation.file
    source = path.read_text(encoding="utf-8")
    mistaken = mutation.applied(source)
    started, ran = time.monotonic(), 0
    write(path, mistaken)
    try:
        low = -1.0
        for high in STEPS:
            step = [test for test in tests if low < costs.of(test) <= high]
            # the tests of the same room first: they ask what the line is for
            room = f"tests/{Path(mutation.file).parts[1]}/"
            step.sort(key=lambda test: not test.startswith(room))
            ran += len(step)
            low = high
            while step and (failed := first_failure(folder, step)):
                # a test that also fails without the mistake, or not again with it, says nothing
                write(path, source)
                fails_anyway = first_failure(folder, failed)
                write(path, mistaken)
                if not fails_anyway and first_failure(folder, failed):
                    return Outcome(mutation, failed[0], ran, time.monotonic() - started)
                step = step[step.index(failed[-1]) + 1 :]
    finally:
        write(path, source)
    return Outcome(mutation, None, ran, time.monotonic() - started)


def write(path: Path, text: str) -> None:
    """Write a module so that Python compiles it again, however soon after the last time."""
    before = path.stat().st_mtime
    path.write_text(text, encoding="utf-8")
    os.utime(path, (before + 2, before + 2))


def first_failure(folder: Path, tests: list[str]) -> list[str]:
    """Return the first of the tests that fails; all of them if their run fails and names none.

    A run also fails if its process does not end, for example because a thread of a test goes on.
    """
    names = folder / "build/mutant-tests.json"
    names.parent.mkdir(exist_ok=True)
    names.write_text(json.dumps(tests), encoding="ascii")
    files = dict.fromkeys(test.partition("::")[0] for test in tests)
    words = ["--only", str(names), "-x", "-q"]
    words += ["--timeout", str(HANG), "-p", "no:cacheprovider"]
    try:
        done = subprocess.run(
            [python(folder), "-m", "pytest", *words, *files],
            cwd=folder,
            check=False,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=HANG + 2 * len(tests),
        )
    except subprocess.TimeoutExpired:
        return tests
    if done.returncode in (0, 5):
        return []
    # a module that cannot be imported is named without a test, and a crash names none
    for line in re.findall(r"(?m)^(?:FAILED|ERROR) (.*)", done.stdout):
        for test in tests:
            file = test.partition("::")[0]
            if f"{line} - ".startswith((f"{test} - ", f"{file} - ")):
                return [test]
    return tests


def row(outcome: Outcome, costs: Costs) -> str:
    """Return a line of the table."""
    mutation = outcome.mutation
    noticed = "not noticed" if outcome.test is None else costs.tier(outcome.test)
    place = f"{mutation.file}:{mutation.line}"
    effort = f"{outcome.ran:6} {outcome.seconds:7.1f}"
    return f"{noticed:12} {place:50} {mutation.kind:18} {effort}  {outcome.test or ''}"


def report(outcomes: list[Outcome], costs: Costs) -> str:
    """Return how many mistakes each tier noticed."""
    tiers = Counter("" if o.test is None else costs.tier(o.test) for o in outcomes)
    missed = tiers.pop("", 0)
    parts = ", ".join(f"{tier} {number}" for tier, number in sorted(tiers.items()))
    return f"noticed {len(outcomes) - missed} of {len(outcomes)}: {parts}"


if __name__ == "__main__":
    sys.exit(main())
