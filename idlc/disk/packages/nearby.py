"""The packages around the working folder, which need no -I to be found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from idlc.diagnostics.report import Report
from idlc.disk.find import find
from idlc.disk.packages import inputs
from idlc.disk.packages.enclosing import manifest
from idlc.disk.read import absolute
from idlc.disk.scope import scope
from idlc.disk.settings import pyproject


def near() -> Mapping[str, Sequence[Path]]:
    """Return the folders of the packages that pyproject.toml names, or of the one around."""
    declared = manifest(absolute("."))
    around = (str(declared.parent),) if declared else ()
    return _packages(pyproject.load(Report()).paths or around)


def below() -> Mapping[str, Sequence[Path]]:
    """Return the folders of all packages below the working folder; this looks at every folder."""
    return _packages((".",))


def names() -> list[str]:
    """Return what is in the working folder."""
    try:
        return sorted(path.name for path in Path.cwd().iterdir())
    except OSError:
        return []


def _packages(paths: Sequence[str]) -> dict[str, tuple[Path, ...]]:
    """Return folders by package; problems of files are reported when they are compiled."""
    ignored = Report()
    where = scope(pyproject.load(ignored))
    found: dict[str, tuple[Path, ...]] = {}
    for one in inputs.packages(find(paths, ignored, where.exclude), where, ignored):
        found.setdefault(one.package, one.folders)
    return found
