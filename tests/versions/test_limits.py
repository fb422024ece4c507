"""Types that hold other types twice, many levels deep: their plans take linear time."""

from itertools import islice

import pytest
from mcap.writer import Writer

from idlc.cli.main import main
from idlc.diagnostics.source import Source
from idlc.model import ir
from idlc.versions import classes
from idlc.versions.classes import version_of_texts
from idlc.versions.conversion import Plan, make_plan
from tests.tasks.test_upgrade import write_package

DEPTH = 40


def bodies(last):
    """Return the texts of types, each of which holds the next one twice."""
    texts = [f"T{level + 1} a\nT{level + 1}[] b\n" for level in range(DEPTH)]
    return {f"T{level}": text for level, text in enumerate([*texts, last])}


def version(last):
    texts = {
        ir.TypeName("deep_msgs", "msg", name): Source(f"msg/{name}.msg", text)
        for name, text in bodies(last).items()
    }
    return version_of_texts(texts, ir.TypeName("deep_msgs", "msg", "T0"))


@pytest.fixture
def plan(monkeypatch):
    monkeypatch.setattr(classes, "report_oversized", lambda *_: None)
    return make_plan(version("float32 x\n"), version("float64 x\nint8 y\n"))


def test_each_plan_is_visited_once(plan, monkeypatch):
    assert len(list(islice(plan.walk(), 1000))) == DEPTH + 1
    findings, calls = Plan.findings, []

    def counted(self, *words):
        calls.append(self)
        assert len(calls) <= 2 * DEPTH + 1
        return findings(self, *words)

    monkeypatch.setattr(Plan, "findings", counted)
    assert [each.path for each in plan.findings()] == ["a." * DEPTH + name for name in "xy"]
    calls.clear()
    assert plan.fate == "automatic"


def test_such_types_are_refused_before_classes_are_made(tmp_path, monkeypatch, capsys):
    assert version("float32 x\n") is None
    monkeypatch.chdir(tmp_path)
    write_package(tmp_path, bodies("float64 x\n"), "deep_msgs")
    first, *others = bodies("float32 x\n").items()
    parts = (f"{'=' * 80}\nMSG: deep_msgs/{name}\n{text}" for name, text in others)
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "test")
        definition = "".join((first[1], *parts)).encode()
        schema = writer.register_schema("deep_msgs/msg/T0", "ros2msg", definition)
        channel = writer.register_channel("/deep", "cdr", schema)
        writer.add_message(channel, 10, b"\x00\x01\x00\x00", 20)
        writer.finish()
    assert main(["upgrade", "a.mcap", "--to", "deep_msgs", "-o", "new"]) == 2
    assert "IDL619" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()
