"""`pytest --idlc`: interface files are collected and checked beside the tests."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

#: How many differences between two messages are listed; pytest shows few of them without -vv.
MOST = 1000
SUFFIXES = frozenset({".msg", ".srv", ".action"})


class InterfaceWarning(UserWarning):
    """Advice on an interface file."""


class InterfaceError(Exception):
    """An interface file has errors; the text says which."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("idlc", "ROS 2 interface files")
    group.addoption("--idlc", action="store_true", help="check .msg, .srv and .action files")
    group.addoption("--idlc-strict", action="store_true", help="also fail on warnings from idlc")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect an interface file."""
    asked = parent.config.getoption("--idlc") or parent.config.getoption("--idlc-strict")
    if not asked or file_path.suffix not in SUFFIXES:
        return None
    return InterfaceCollector.from_parent(parent, path=file_path)


def pytest_assertrepr_compare(op: str, left: object, right: object) -> list[str] | None:
    """Explain which fields of two messages differ.

    pytest does so for dataclasses whose `__eq__` was made by `dataclass` alone.
    """
    generated = [kind for kind in type(left).__mro__ if hasattr(type(kind), "_message")]
    base: Any = generated[-1] if generated else None  # of all messages
    if op != "==" or base is None or type(left) is not type(right):
        return None
    try:  # a field may have the name of a method
        differences = _differences(base.to_dict(left), base.to_dict(right), "")
    except (AttributeError, TypeError, ValueError):  # values that the fields cannot hold
        return None
    name = type(left).__name__
    return [f"{name}(...) == {name}(...)", "", "Differing fields:", *islice(differences, MOST)]


def _differences(left: object, right: object, path: str) -> Iterator[str]:
    """Yield the differences of two messages, as dictionaries."""
    if isinstance(left, dict) and isinstance(right, dict):
        for name in left:
            yield from _differences(left[name], right[name], f"{path}.{name}" if path else name)
    elif isinstance(left, list) and isinstance(right, list):
        if len(left) != len(right):
            yield f"  {path}: {len(left)} elements != {len(right)} elements"
        for index, pair in enumerate(zip(left, right, strict=False)):
            yield from _differences(*pair, f"{path}[{index}]")
    elif left != right:
        yield f"  {path}: {_short(left)} != {_short(right)}"


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


class InterfaceCollector(pytest.File):
    """An interface file; it has one test."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the test."""
        yield InterfaceItem.from_parent(self, name="idlc")


class InterfaceItem(pytest.Item):
    """The check of one interface file."""

    def runtest(self) -> None:
        """Fail with the errors that idlc reports for the file."""
        from idlc.cli.run.check import check_file
        from idlc.diagnostics.text import Audience, addressed_to

        is_strict = self.config.getoption("--idlc-strict")
        with addressed_to(Audience.SETTINGS):
            errors, others = check_file(str(self.path), strict=is_strict)
        for problem in others:
            warnings.warn(problem, InterfaceWarning, stacklevel=1)
        if errors:
            raise InterfaceError("\n".join(errors))

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None
    ) -> str:
        """Return the problems as idlc shows them."""
        if isinstance(excinfo.value, InterfaceError):
            return str(excinfo.value)
        return str(super().repr_failure(excinfo, style))  # type: ignore[arg-type]

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Return the name of the test."""
        return self.path, None, f"idlc {self.path.name}"
