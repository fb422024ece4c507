"""What the packages of a folder are compared with while somebody edits them."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec

from idlc.breaking import settings as breaking_settings
from idlc.breaking.change import Change
from idlc.diagnostics.report import Report, Severity
from idlc.disk import revision
from idlc.disk.packages.inputs import Inputs
from idlc.disk.read import NOTHING_OPEN, absolute, is_folder
from idlc.disk.scope import Scope
from idlc.disk.settings.pyproject import Config
from idlc.disk.working_folder import working_in
from idlc.driver.compare.breaking import GIT, BreakingOptions, Side, earlier, not_allowed

if TYPE_CHECKING:
    from pathlib import Path


class Earlier:
    """The version that settings name: a git revision, or a folder; empty for any other.

    It is compiled when it is asked for, and again when the name means another commit.
    """

    def __init__(self, folder: Path, wished: str, settings: Config, scope: Scope) -> None:
        ignored = Report()  # `idlc breaking` tells what is wrong in its table
        said = wished or breaking_settings.against(settings, ignored) or ""
        comparable = said.startswith(GIT) or (bool(said) and is_folder(absolute(folder / said)))
        self._folder = folder
        self.name = said if comparable else ""
        self._options = BreakingOptions(
            (),
            self.name,
            msgspec.structs.replace(scope, unsaved=NOTHING_OPEN),
            allowed=breaking_settings.allowances(settings, ignored),
        )
        self.commit: str | None = None
        self._side: Side | None = None

    def side(self, packages: Sequence[Inputs]) -> Side:
        """Return the packages as they were then; of a version that cannot be read, why."""
        if self.has_moved() or self._side is None:
            report = Report()
            paths = tuple(one.home.as_posix() for one in packages)
            options = self._options._replace(paths=paths)
            with working_in(self._folder):
                found = earlier(options, tuple(packages), report) if paths and self.name else None
            why = next((one.message for one in report if one.severity is Severity.ERROR), "")
            self._side = found or Side({}, frozenset(), why)
        return self._side

    def follow(self, older: Earlier | None) -> None:
        """Remember which commit the name meant before the folder was read again."""
        if older is not None and older.name == self.name:
            self.commit = older.commit

    def has_moved(self) -> bool:
        """Return whether the name means another commit than when this was asked last."""
        if not self.name.startswith(GIT):
            return False
        name = self.name.removeprefix(GIT)
        before, self.commit = self.commit, revision.commit(name, str(self._folder)) or ""
        if before == self.commit:
            return False
        self._side = None
        return before is not None

    def repository(self) -> tuple[Path, ...]:
        """Return the folders in which git notes what a name means; none without a repository."""
        return revision.places(str(self._folder)) if self.name.startswith(GIT) else ()

    def not_allowed(self, changes: Sequence[Change]) -> tuple[Change, ...]:
        """Return the changes that nobody allowed in the settings."""
        today = datetime.datetime.now().astimezone().date().isoformat()
        return not_allowed(changes, self._options._replace(today=today), Report())
