"""Benchmarks still run, and documents tell of the run that is kept. No time is asserted."""

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import __main__ as benchmarks
from benchmarks import report, results
from benchmarks.measure import IDLC, Goal, Result, Times
from benchmarks.peers import PEERS, installed
from benchmarks.work import Work
from tests.support.paths import ROOT


def rows(folder: Path) -> set[tuple[str, str]]:
    work = Work(folder, quick=True)
    return {(row.group, row.name) for row in benchmarks.selected(work, [])}


@pytest.mark.long
def test_everything_can_be_measured(tmp_path):
    """One tiny round of all, in a process of its own, because rclpy stays where it once was."""
    path = tmp_path / "run.json"
    words = ["-m", "benchmarks", "--quick", "--rounds", "1", "--json", path]
    command = [sys.executable, *map(str, words)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    run = results.load(path)
    assert {(one.group, one.name) for one in run.results} == rows(tmp_path)
    assert all(min(times) > 0 for one in run.results for times in one.times.values())
    measured = {who for one in run.results for who in one.times}
    present = {peer for peer in PEERS if installed(peer)}
    assert "rosbags" in present
    assert {IDLC, *present} <= measured
    for peer in PEERS:
        assert (peer in done.stdout.partition("\n")[0]) == (peer in present)


def result(goal: Goal | None, **microseconds: float) -> Result:
    times = {who.replace("_", " "): Times(t, t, t) for who, t in microseconds.items()}
    return Result("group", "row", times, goal)


@pytest.mark.parametrize(
    ("goal", "times", "peer", "ratio", "verdict"),
    [
        (Goal(times=3), {"idlc": 1, "rosbags": 3, "rclpy": 9}, "rosbags", 3, "ok"),
        (Goal(times=3), {"idlc": 1, "rosbags": 9, "rclpy": 2}, "rclpy", 2, "MISS"),
        (Goal(at_most=2, than="memcpy"), {"idlc": 2, "memcpy": 1, "rclpy": 1}, "rclpy", 0.5, "ok"),
        (Goal(at_most=2, than="memcpy"), {"idlc": 3, "memcpy": 1, "rclpy": 3}, "rclpy", 1, "MISS"),
        (Goal(at_most=2), {"idlc": 3}, None, None, "MISS"),
        (Goal(at_most=3), {"idlc": 3}, None, None, "ok"),
        (Goal(times=3), {"idlc": 3}, None, None, ""),
        (None, {"idlc": 3, "empty_module": 1}, None, None, ""),
    ],
)
def test_the_fastest_peer_is_the_measure(goal, times, peer, ratio, verdict):
    assert results.standing(result(goal, **times))[:3] == (peer, ratio, verdict)


def test_a_run_outlives_its_file(tmp_path):
    run = results.here()
    run.results.append(result(Goal(times=3), idlc=0.25, rosbags=0.5, memcpy=2e-6))
    run.results.append(result(None, idlc=1))
    results.save(run, tmp_path / "run.json")
    assert results.load(tmp_path / "run.json") == run


@pytest.mark.parametrize("path", report.PARTS, ids=lambda path: path.name)
def test_documents_tell_of_the_kept_run(path):
    """`make bench ARGS=--keep` measures anew; ARGS=--documents only writes the documents."""
    assert path.read_text(encoding="utf-8") == report.written(path, results.load())


def test_the_kept_run_is_of_everything(tmp_path):
    run = results.load()
    assert rows(tmp_path) <= {(one.group, one.name) for one in run.results}
    assert set(PEERS) <= set(run.versions)


@pytest.mark.long
def test_readers_of_recordings_can_be_measured(tmp_path):
    path = tmp_path / "run.json"
    words = ["recording zstd: imu", "--quick", "--rounds", "1", "--json", str(path)]
    command = [sys.executable, "-m", "benchmarks", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    run = results.load(path)
    (found,) = run.results
    assert {IDLC, "rosbags", "mcap-ros2", "copy", "decompression"} <= {*found.times}
    assert all(times.median > 0 for times in found.times.values())
    for who, times in found.times.items():
        assert f"{who} {report.amount(times.median)}" in done.stdout or who == IDLC
    heading, _, row, *_ = report.recordings_table(run).splitlines()
    assert all(who in heading for who in found.times)
    assert heading.startswith("| recording zstd | ")
    assert row.startswith("| Imu | ")
    assert not report.full_table(run).count("recording")
