"""What the packages of a folder are compared with while somebody edits them."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import msgspec

from idlc.breaking.change import Change
from idlc.diagnostics.report import Report
from idlc.disk import revision
from idlc.disk.packages.inputs import Inputs
from idlc.disk.read import NOTHING_OPEN, absolute, is_folder
from idlc.disk.scope import Scope
from idlc.disk.settings import commands as command_settings
from idlc.disk.settings.pyproject import Config
from idlc.disk.working_folder import working_in
from idlc.driver.compare.breaking import GIT, BreakingOptions, earlier, not_allowed
from idlc.model.link import Model

if TYPE_CHECKING:
    from pathlib import Path


class Earlier:
    """The version that settings name: a git revision, or a folder; empty for any other.

    It is compiled when it is asked for, and again when the name means another commit.
    """

    def __init__(self, folder: Path, wished: str, settings: Config, scope: Scope) -> None:
        ignored = Report()  # `idlc breaking` tells what is wrong in its table
        said = wished or command_settings.against(settings, ignored) or ""
        comparable = said.startswith(GIT) or (bool(said) and is_folder(absolute(folder / said)))
        self._folder = folder
        self.name = said if comparable else ""
        self._options = BreakingOptions(
            (),
            self.name,
            msgspec.structs.replace(scope, unsaved=NOTHING_OPEN),
            allowed=command_settings.allowances(settings, ignored),
        )
        self._commit: str | None = None
        self._models: Mapping[str, Model] | None = None

    def models(self, packages: Sequence[Inputs]) -> Mapping[str, Model]:
        """Return the packages' models as they were then; empty if they cannot be compiled."""
        if self.has_moved() or self._models is None:
            report = Report()
            paths = tuple(one.home.as_posix() for one in packages)
            options = self._options._replace(paths=paths)
            with working_in(self._folder):
                found = earlier(options, tuple(packages), report) if paths and self.name else {}
            self._models = {} if report.had_errors else found
        return self._models

    def has_moved(self) -> bool:
        """Return whether the name means another commit than when this was asked last."""
        if not self.name.startswith(GIT):
            return False
        name = self.name.removeprefix(GIT)
        before, self._commit = self._commit, revision.commit(name, str(self._folder)) or ""
        if before == self._commit:
            return False
        self._models = None
        return before is not None

    def repository(self) -> tuple[Path, ...]:
        """Return the folders in which git notes what a name means; none without a repository."""
        return revision.places(str(self._folder)) if self.name.startswith(GIT) else ()

    def not_allowed(self, changes: Sequence[Change]) -> tuple[Change, ...]:
        """Return the changes that nobody allowed in the settings."""
        today = datetime.datetime.now().astimezone().date().isoformat()
        return not_allowed(changes, self._options._replace(today=today), Report())
