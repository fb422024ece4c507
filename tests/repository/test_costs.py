"""The table of tests that are not quick."""

import json

import pytest

from tests.support import costs


def test_each_row_names_a_test(request):
    """Of the files that this run collected; `make costs` writes the table again."""
    names = request.config.stash[costs.COLLECTED]
    whole = {name.partition("::")[0] for name in names} - {
        word.partition("::")[0] for word in request.config.args if "::" in word
    }
    rows = [test for test in costs.committed().seconds if test.partition("::")[0] in whole]
    assert [test for test in rows if test not in names] == []


def test_the_table_is_as_it_is_written(tmp_path):
    costs.committed().write(tmp_path / "costs.tsv")
    assert (tmp_path / "costs.tsv").read_bytes() == costs.TABLE.read_bytes()


def test_what_tests_share_is_divided_among_them(tmp_path):
    measured = {
        "tests": {"a.py::test_a": 2.0, "a.py::test_b": 1.0, "b.py::test_c": 4.0},
        "fixtures": {"\tbrowser": 6.0, "a.py\tpage": 2.0},
        "users": {
            "a.py::test_a": ["browser", "page"],
            "a.py::test_b": ["page"],
            "b.py::test_c": ["browser", "page"],
        },
    }
    (tmp_path / "gw0.json").write_text(json.dumps(measured), encoding="ascii")
    expected = {"a.py::test_a": 6.0, "a.py::test_b": 2.0, "b.py::test_c": 7.0}
    assert costs.measured(tmp_path) == expected


@pytest.mark.parametrize(
    ("marks", "seconds", "tiers"),
    [
        ((), 0.1, {"quick", "test"}),
        ((), 0.2, {"test"}),
        ((), 2.1, {"long"}),
        (("rounds",), 0.1, {"quick", "test", "long"}),
        (("rounds",), 2.1, {"long"}),
        (("long",), 0.0, {"long"}),
    ],
)
def test_a_test_is_in_its_tiers(marks, seconds, tiers, request, monkeypatch):
    item = request.node
    for mark in marks:
        item.add_marker(mark)
    monkeypatch.setattr(costs, "committed", lambda: costs.Costs({item.nodeid: seconds}))
    assert costs.tiers(item) == tiers


def test_long_tests_have_their_turns_and_others_always_run(request, monkeypatch):
    files = [f"tests/{number}.py" for number in range(costs.TURNS)]
    slow = {f"{file}::test_{number}": 1.5 for file in files for number in range(2)}
    mild = f"{files[0]}::mild"
    monkeypatch.setattr(costs, "committed", lambda: costs.Costs({**slow, mild: 0.4}))
    monkeypatch.setattr(costs, "turns", costs.turns.__wrapped__)

    class Item:
        get_closest_marker = staticmethod(request.node.get_closest_marker)

        def __init__(self, nodeid):
            self.nodeid = nodeid

    def run(turn):
        return {test for test in [*slow, mild] if costs.is_due(Item(test), turn)}

    turns = [run(turn) - {mild} for turn in range(3 * costs.TURNS)]
    cycle = turns[: costs.TURNS]
    assert turns == 3 * cycle
    assert set().union(*turns) == set(slow)
    assert sum(map(len, cycle)) == len(slow), "each in one turn"
    assert {len(turn) for turn in cycle} == {2}, "files of the same cost are not in one turn"
    assert all(mild in run(turn) for turn in range(costs.TURNS))
    for turn in cycle:
        assert {test.replace("test_0", "test_1") for test in turn} <= turn, "whole files"
    request.node.add_marker(pytest.mark.long)
    assert sum(mild in run(turn) for turn in range(costs.TURNS)) == 1, "what the mark makes long"
