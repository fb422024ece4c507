"""Rows of the table, and how they are measured.

A candidate is a function that does its operation and returns the seconds that one took. A row's
candidates take turns, round after round, so that whatever else the machine does meets all alike.
"""

import gc
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

Candidate = Callable[[], float]

IDLC = "idlc"
#: Seconds that one measurement of `Repeated` takes, about.
SLICE = 0.002


class Goal(NamedTuple):
    """How fast idlc shall be: `times` faster than the fastest peer, or `at_most` times `than`.

    `than` names a candidate that is no peer. Without it, `at_most` is in seconds.
    """

    times: float | None = None
    at_most: float | None = None
    than: str | None = None


class Times(NamedTuple):
    """The seconds of one operation: the median of all rounds, and its quartiles."""

    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Row:
    """One row: `prepare` gives its candidates by name, which is when anything costly happens."""

    group: str
    name: str
    prepare: Callable[[], dict[str, Candidate]]
    goal: Goal | None = None
    rounds: int = 41


class Result(NamedTuple):
    """The measurements of a row."""

    group: str
    name: str
    times: dict[str, Times]
    goal: Goal | None = None


class Repeated:
    """The candidate that calls a short function many times, more from round to round.

    The clock counts the thread's CPU time: the wall's on a machine with nothing else to do.
    """

    def __init__(
        self, function: Callable[[], object], clock: Callable[[], float] = time.thread_time
    ) -> None:
        self._function = function
        self._clock = clock
        self._calls = 1
        function()

    def __call__(self) -> float:
        function, calls = self._function, range(self._calls)
        begin = self._clock()
        for _ in calls:
            function()
        taken = (self._clock() - begin) / len(calls)
        self._calls = max(self._calls, int(SLICE / max(taken, 1e-8)))
        return taken


def measure(row: Row, rounds: int | None) -> Result:
    """Return what each candidate takes, in at most `rounds` rounds."""
    candidates = row.prepare()
    found: dict[str, list[float]] = {name: [] for name in candidates}
    gc.collect()
    for _ in range(min(row.rounds, rounds or row.rounds)):
        for name, candidate in candidates.items():
            found[name].append(candidate())
    times = {name: spread(measured) for name, measured in found.items()}
    return Result(row.group, row.name, times, row.goal)


def spread(measured: list[float]) -> Times:
    if len(measured) == 1:
        return Times(*measured * 3)
    low, median, high = statistics.quantiles(measured, n=4, method="inclusive")
    return Times(median, low, high)
