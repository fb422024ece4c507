"""What `idlc gen` writes for a file without being told: as settings say, or as it did before."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from idlc import __version__
from idlc.diagnostics.report import Report
from idlc.disk.find import root_of
from idlc.disk.output import lock_file
from idlc.disk.read import absolute, is_file
from idlc.disk.scope import scope
from idlc.disk.settings import pyproject
from idlc.disk.working_folder import working_in
from idlc.driver.generate.gen import GenOptions, gen, with_settings
from idlc.driver.generate.result import Generated

if TYPE_CHECKING:
    from pathlib import Path


class Run(NamedTuple):
    """A run of `idlc gen` in a folder."""

    folder: Path
    options: GenOptions

    def lock(self, package: str) -> lock_file.Lock | None:
        """Return what the last run recorded of a package; `None` if there was none."""
        out = self.folder / self.options.out
        found = (lock_file.load(one, "", Report()) for one in (out / package, out))
        return next((one for one in found if one and one.package == package), None)

    def is_needed(self, package: str, inputs: Mapping[str, str], key: str) -> bool:
        """Return whether a package was made of other texts than these, or by another idlc.

        `inputs` are the digests of all files of the package, `key` is one that it must have.
        """
        lock = self.lock(package)
        if lock is None or lock.idlc != __version__ or key not in lock.inputs:
            return True
        return any(inputs.get(name) != one for name, one in lock.inputs.items())

    def make(self, report: Report) -> tuple[Generated, ...]:
        """Write, and return what was done; empty after an error. Raises OSError."""
        with working_in(self.folder):
            return gen(self.options, report)


def run_for(path: Path, package: str) -> Run | None:
    """Return the run that compiles a file of a package.

    It is that of the nearest settings which say what is written where, or the one that made a
    generated package in the source package, or beside its interfaces.
    """
    for folder in path.parents:
        if is_file(folder / pyproject.FILE) and (found := _by_settings(folder, path)):
            return found
    return _by_lock(path, package)


def _by_settings(folder: Path, path: Path) -> Run | None:
    report = Report()
    with working_in(folder):
        settings = pyproject.load(report)
        wanted = with_settings(GenOptions((), scope=scope(settings)), settings)
        covered = any(path.is_relative_to(absolute(one)) for one in wanted.paths)
    return Run(folder, wanted) if wanted.out and covered and not report.had_errors else None


def _by_lock(path: Path, package: str) -> Run | None:
    home = root_of(str(path.parent))
    for out in (home / package, home):
        lock = lock_file.load(out, "", Report())
        if lock is not None and lock.package == package:
            with working_in(home):
                found = scope(pyproject.load(Report()), package)
            name = out.relative_to(home).as_posix()
            return Run(home, GenOptions((".",), name, scope=found, vendor_deps=lock.vendor_deps))
    return None
