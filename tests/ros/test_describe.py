"""Type descriptions are what ROS 2 installs, for every interface of the installed wheels."""

import json
import sys
from pathlib import Path

from idlc.diagnostics.report import Report
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.tasks.show import describe

INSTALLED = [
    path
    for kind in ("msg", "srv", "action")
    for path in sorted(Path(sys.prefix).glob(f"share/*/{kind}/*.json"))
    if path.with_suffix(f".{kind}").exists()  # some of Kilted are written in .idl
]


def test_descriptions_are_those_installed():
    assert len(INSTALLED) > 100
    for path in INSTALLED:
        name = f"{path.parent.parent.name}/{path.parent.name}/{path.stem}"
        report = Report()
        found = describe(name, Scope(Root.here()), report)
        assert not report.had_errors, [one.message for one in report]
        assert json.dumps(found, indent=2) == path.read_text(encoding="utf-8"), name
