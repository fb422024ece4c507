"""A prefix that ROS 2 and its tools look into, with several packages and files of others in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from idlc.diagnostics.report import Report
from idlc.disk.library import Library
from idlc.disk.machine import environment
from idlc.disk.machine.distribution import Distribution, distribution
from idlc.disk.output import transaction
from idlc.disk.output.folder import Target
from idlc.disk.output.folder_lock import alone
from idlc.disk.output.tree import Tree
from idlc.disk.output.write_plan import Change, Plan
from idlc.disk.packages.enclosing import manifest
from idlc.disk.read import read_bytes, shown
from idlc.native.inspect import inspect

#: How the files begin by which shells learn of a prefix, and which all packages in it share.
MARK = b"# Written by idlc"


class Overlay(Target):
    """A package in a prefix. What idlc wrote of it is recorded in its share folder."""

    def __init__(
        self,
        name: str,
        package: str,
        home: Path | None,
        report: Report,
        *,
        force: bool = False,
        distros: Sequence[str] = (),
    ) -> None:
        super().__init__(name, package, report, force=force)
        self._distros = distros
        declared = manifest(home) if home else None
        #: The content of its package.xml; `None` if there is none to be copied.
        self.manifest = read_bytes(declared, shown(declared), report) if declared else None
        self.home = f"share/{package}/"
        self.modules = f"{environment.modules_folder()}/{package}/"

    @property
    def place(self) -> str:
        """The prefix's path, which shells need where they do not know what they read."""
        return self._path.as_posix()

    @property
    def distribution(self) -> Distribution:
        """The distribution that libraries are for: the installed one, unless others are wanted."""
        found = distribution((self._path, *environment.ament_prefixes()))
        if not self._distros or found.name in self._distros:
            return found
        wanted = self._distros[0]
        self.report.notes.append(
            f"`{self.name}` gets libraries for {wanted}, not for {found.name} ({found.why})"
        )
        return Distribution(wanted, f"--distro {wanted}")

    def alone(self, *, beside: bool = False) -> AbstractContextManager[None]:
        """Keep other runs of idlc from writing here meanwhile; all packages are in one folder."""
        del beside
        return alone(self._path)

    def beside(self, package: str) -> Overlay:
        """Return another package in the prefix."""
        home = Library((), Report()).home(package)
        return Overlay(
            self.name, package, home, self.report, force=self._force, distros=self._distros
        )

    def unchanged(
        self, inputs: Mapping[str, str], library: Library, *, vendor_deps: bool = False
    ) -> bool:
        """Return whether nothing is to be done: not to be told from interfaces alone.

        Libraries depend on what else is installed, too.
        """
        del inputs, library, vendor_deps
        return False

    def cause(self, change: Change) -> str:
        """Say why a library differs, if another distribution is the reason."""
        old, new = (inspect(data or b"") for data in (change.old, change.new))
        if old is None or new is None or old.told == new.told:
            return ""
        return "it is for another distribution of ROS 2"

    def share(self, files: Mapping[str, str]) -> bool:
        """Write the files for shells, but not over those of others, which are noted."""
        tree, changes = Tree(self._path), []
        for path, text in files.items():
            old, new = tree.read(path), text.encode("utf-8")
            if old is None or (isinstance(old, bytes) and old.startswith(MARK)):
                changes += [] if old == new else [Change(path, old, new)]
            else:
                self.report.notes.append(
                    f"`{self.name}/{path}` is not idlc's: put `{self.name}` into AMENT_PREFIX_PATH"
                )
        plan = Plan(self._path, tuple(changes), {})
        return transaction.apply_changes(plan, self.name, self.report)
