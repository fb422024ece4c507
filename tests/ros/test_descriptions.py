"""Type descriptions and hashes are those that the wheels install beside their interface files."""

import json
import sys
from pathlib import Path

import pytest

from idlc.model import ir
from idlc.model.link import link
from idlc.model.lower import lower
from idlc.syntax.parse import parse
from idlc.text.diagnostics import Report
from idlc.text.source import Source

SHARE = Path(sys.prefix) / "share"
INSTALLED = sorted(
    path for kind in ("msg", "srv", "action") for path in SHARE.glob(f"*/{kind}/*.json")
)


class Wheels:
    """The interface files of the installed wheels."""

    @staticmethod
    def source(name: ir.TypeName) -> Source | None:
        path = SHARE / name.package / name.kind / f"{name.name}.{name.kind}"
        return Source(str(path), path.read_text(encoding="utf-8")) if path.exists() else None

    @staticmethod
    def names(package: str) -> list[str]:
        return [path.stem for path in (SHARE / package / "msg").glob("*.msg")]

    @staticmethod
    def packages() -> list[str]:
        return [path.parent.name for path in SHARE.glob("*/msg")]


def test_there_are_descriptions():
    assert len(INSTALLED) > 150


@pytest.mark.parametrize(
    "path", INSTALLED, ids=lambda path: "/".join(path.with_suffix("").parts[-3:])
)
def test_the_installed_description(path):
    report = Report()
    package, kind, name = path.with_suffix("").parts[-3:]
    full = ir.TypeName.parse(f"{package}/{kind}/{name}")
    source = Wheels.source(full)
    assert source is not None
    model = link(package, [lower(parse(source), full, report)], Wheels, report)
    assert not report.had_errors
    installed = json.loads(path.read_text(encoding="utf-8"))
    assert model.describer.installed(str(full)) == installed
