"""`pytest --idlc`: interface files are collected and checked beside the tests."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from idlc.diagnostics.report import Diagnostic

SUFFIXES = frozenset({".msg", ".srv", ".action"})


class InterfaceWarning(UserWarning):
    """Advice on an interface file."""


class InterfaceError(Exception):
    """An interface file has errors; the text says which."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("idlc", "ROS 2 interface files")
    group.addoption("--idlc", action="store_true", help="check .msg, .srv and .action files")
    group.addoption("--idlc-strict", action="store_true", help="let warnings of idlc fail as well")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect an interface file."""
    asked = parent.config.getoption("--idlc") or parent.config.getoption("--idlc-strict")
    if not asked or file_path.suffix not in SUFFIXES:
        return None
    return InterfaceFile.from_parent(parent, path=file_path)


class InterfaceFile(pytest.File):
    """An interface file; it has one test."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the test."""
        yield InterfaceItem.from_parent(self, name="idlc")


class InterfaceItem(pytest.Item):
    """The check of one interface file."""

    def runtest(self) -> None:
        """Fail with what idlc says about the file."""
        from idlc.diagnostics.formats.terminal import text
        from idlc.diagnostics.report import Severity

        found = _problems(self.path)
        strict = self.config.getoption("--idlc-strict")
        errors = [one for one in found if strict or one.severity is Severity.ERROR]
        for one in found:
            if one not in errors:
                place = f"{one.where[0]}: {one.code}: {one.message}"
                warnings.warn(place, InterfaceWarning, stacklevel=1)
        if errors:
            raise InterfaceError("\n".join(text(errors)))

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None
    ) -> str:
        """Return the problems as idlc shows them."""
        if isinstance(excinfo.value, InterfaceError):
            return str(excinfo.value)
        return str(super().repr_failure(excinfo, style))  # type: ignore[arg-type]

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Return how the test is called."""
        return self.path, None, f"idlc {self.path.name}"


def _problems(path: Path) -> list[Diagnostic]:
    from idlc.diagnostics.report import Report
    from idlc.disk.scope import scope
    from idlc.disk.settings import commands as command_settings
    from idlc.disk.settings import pyproject
    from idlc.driver.check import CheckOptions, check

    report = Report()
    settings = pyproject.load(report)
    selection = command_settings.selection(settings, report)
    if not report.had_errors:
        check(CheckOptions((str(path),), scope(settings), selection), report)
    return list(report)
