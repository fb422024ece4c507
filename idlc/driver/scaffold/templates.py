"""The pipelines of `idlc scaffold templates`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from idlc.diagnostics.report import Report
from idlc.disk.output.project import Project
from idlc.disk.settings import pyproject, user_templates
from idlc.driver.scaffold.changes import Result, Settings, write
from idlc.scaffold.templates import ENDING, copy, folders, names

#: Where copies go unless that is set.
FOLDER = "templates"


class Listed(NamedTuple):
    """A template that can be replaced, and the user's file that does so, if any."""

    name: str
    replaced_by: str


def listed(settings: Settings, report: Report) -> list[Listed]:
    """Return the templates that a user can replace."""
    folder = settings.templates or pyproject.load(report).templates
    found = user_templates.read(folder, folders(), ENDING, report) if folder else {}
    return [Listed(name, found[name].path if name in found else "") for name in names()]


def copied(wanted: Sequence[str], settings: Settings, report: Report) -> Result | None:
    """Copy templates into the user's folder, to be changed there."""
    set_already = settings.templates or pyproject.load(report).templates
    if report.had_errors:
        return None
    folder = set_already or FOLDER
    project = Project(folder, report, force=settings.force)
    result = write(project, {name: copy(name) for name in wanted}, {}, settings, report)
    if result is None or set_already:
        return result
    note = f'set `templates = "{folder}"` in [tool.idlc] of pyproject.toml, or use --templates'
    return result._replace(notes=(note,))
