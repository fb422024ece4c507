"""The pipeline of `idlc scaffold package`."""

from __future__ import annotations

from collections.abc import Mapping

from idlc.diagnostics.report import Report
from idlc.disk.output.project import Project
from idlc.disk.scope import scope
from idlc.disk.settings import pyproject
from idlc.driver.scaffold.changes import Result, Settings, rendering, templates, write
from idlc.model import catalog, ir
from idlc.scaffold import new_package


def package(
    wanted: new_package.Package,
    folder: str,
    settings: Settings,
    report: Report,
    starters: Mapping[str, str] | None = None,
) -> Result | None:
    """Write a new package below `folder`, with interfaces if it has none yet."""
    name = wanted.name if folder in ("", ".") else f"{folder}/{wanted.name}"
    project = Project(name, report, force=settings.force)
    used = templates(settings, report)
    if report.had_errors:
        return None
    files: dict[str, str] = {}
    with rendering(wanted.name, report):
        there = catalog.packages(scope(pyproject.load(report)).distro)
        depends = tuple(name for name in wanted.depends if name in there)  # Humble lacks one
        files = new_package.files(wanted._replace(depends=depends), used)
    if not any(project.names(kind) for kind in ir.KINDS):
        files |= starters or {}
    # what later commands add to stays as it is
    growing = (*new_package.GROWING, f"launch/{wanted.name}_launch.py")
    new = {
        path: text
        for path, text in files.items()
        if path not in growing or settings.force or not project.has(path)
    }
    return write(project, new, {}, settings, report)
