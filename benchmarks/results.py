"""A run as a file, and what its rows say: how idlc stands against the fastest peer and the goal."""

import json
import os
import platform
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import idlc
from benchmarks.measure import IDLC, Goal, Result, Times
from benchmarks.peers import versions

#: The run that the documents show.
KEPT = Path(__file__).with_name("results.json")
#: Candidates that compete with nobody.
REFERENCES = {
    "bare interpreter",
    "copy",
    "copy=False",
    "decompression",
    "deserialize_many",
    "deserialize",
    "empty module",
    "idlc cold",
    "join of the buffers",
    "memcpy",
    "serialize",
    "to_arrow",
}


@dataclass(frozen=True)
class Run:
    """Results, and where they are from."""

    python: str
    machine: str
    versions: dict[str, str]
    results: list[Result] = field(default_factory=list)


class Standing(NamedTuple):
    """`ratio`: the fastest peer's time per idlc's. `verdict`: "ok", "MISS", or "" without goal."""

    peer: str | None
    ratio: float | None
    verdict: str
    said: str


def here() -> Run:
    """Return an empty run on this machine, of which it says no more than its kind."""
    python = f"{platform.python_implementation()} {platform.python_version()}"
    machine = f"{platform.system()} {platform.machine()}, {os.cpu_count()} CPUs, {processor()}"
    return Run(python, machine, {IDLC: idlc.__version__} | versions())


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or "unknown processor"


def standing(result: Result) -> Standing:
    mine = result.times[IDLC].median
    peers = {who: t.median for who, t in result.times.items() if who not in (IDLC, *REFERENCES)}
    peer = min(peers, key=peers.__getitem__, default=None)
    ratio = peers[peer] / mine if peer else None
    verdict, said = judge(result, mine, ratio)
    return Standing(peer, ratio, verdict, said)


def judge(result: Result, mine: float, ratio: float | None) -> tuple[str, str]:
    """Return whether the goal is reached, and the goal in words."""
    goal = result.goal
    if goal is None:
        return "", ""
    if goal.times is not None:
        if ratio is None:
            return "", "no peer is here"
        return ("ok" if ratio >= goal.times else "MISS"), f"≥ {goal.times:g}×"
    if goal.than is None:
        return ("ok" if mine <= goal.at_most else "MISS"), f"≤ {goal.at_most * 1e3:g} ms"
    reached = mine / result.times[goal.than].median
    verdict = "ok" if reached <= goal.at_most else "MISS"
    return verdict, f"{reached:.2f} of {goal.than}, ≤ {goal.at_most:g}"


def save(run: Run, path: Path) -> None:
    """Write a run as JSON; times are in microseconds: median, lower and upper quartile."""
    rows = [
        {
            "group": one.group,
            "name": one.name,
            "times": {who: [round(t * 1e6, 3) for t in times] for who, times in one.times.items()},
            "goal": one.goal and {k: v for k, v in one.goal._asdict().items() if v is not None},
            "fastest peer": standing(one).peer,
            "verdict": standing(one).verdict,
        }
        for one in run.results
    ]
    head = {"python": run.python, "machine": run.machine, "versions": run.versions}
    body = ",\n".join(f"    {json.dumps(row)}" for row in rows)
    text = json.dumps(head, indent=2)[:-2] + f',\n  "rows": [\n{body}\n  ]\n}}\n'
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def load(path: Path = KEPT) -> Run:
    found = json.loads(path.read_text(encoding="utf-8"))
    return Run(found["python"], found["machine"], found["versions"], list(results(found["rows"])))


def results(rows: Iterable[dict]) -> Iterable[Result]:
    for row in rows:
        times = {who: Times(*(t / 1e6 for t in given)) for who, given in row["times"].items()}
        goal = row["goal"] and Goal(**row["goal"])
        yield Result(row["group"], row["name"], times, goal)
