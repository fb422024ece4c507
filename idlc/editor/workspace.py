"""A folder that is checked again and again while its files are edited, as `idlc check` does.

A load reads the disk. After that only texts change, until the next load: a document that an editor
has open counts instead of its file. The result depends on the files and the open documents only,
never on the order of events.
"""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from idlc.check import select
from idlc.compiler.compiler import internal_error
from idlc.diagnostics.report import Report, Severity
from idlc.diagnostics.text import Audience, addressed_to
from idlc.model import ir
from idlc.packaging.files import PACKAGE_FILES
from idlc.project import inputs, prefixes, settings
from idlc.project.files import MAX_SIZE, is_folder
from idlc.project.find import RULES, DiskSnapshot, FileListing, InterfaceFile, list_files, root_of
from idlc.project.inputs import Inputs, output_folders
from idlc.project.lock import FILE
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import load_settings, scope
from idlc.tasks.check import check_all, checkers

if TYPE_CHECKING:
    from idlc.diagnostics.report import Diagnostic
    from idlc.diagnostics.source import Source
    from idlc.model.link import Model
    from idlc.packaging.facts import Facts
    from idlc.project.library import Library
    from idlc.tasks.breaking.files import Baseline, Side

_BUG = "this is a bug in idlc, please report it"
#: Files that a check of a package may read beside its interfaces.
OTHER_INPUTS = (*PACKAGE_FILES, FILE)


class EditorSettings(msgspec.Struct, frozen=True, rename="camel"):
    """An editor's settings below `idlc`: options of `idlc check`, and of features.

    `against` is the version that the lens on breaking changes compares with.
    """

    select: str = ""
    ignore: str = ""
    package: str = ""
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    distro: str = ""
    inlay_hints: bool = True
    code_lens: bool = True
    default_lens: bool = True
    against: str = ""


class Snapshot(msgspec.Struct, frozen=True, dict=True):
    """A folder as it was checked at one moment.

    `models` maps its packages to their models for the first of its distributions; `library` has
    all other interfaces.
    """

    folder: Path
    root: Root
    problems: tuple[Diagnostic, ...]
    models: Mapping[str, Model]
    library: Library

    @cached_property
    def interfaces(self) -> Mapping[Path, tuple[ir.Interface, Source]]:
        """The interfaces of the folder's own files, by absolute path, with their texts."""
        return {
            self.path_of(interface.source): (interface, interface.source)
            for model in self.models.values()
            for interface in model.own
            if interface.source
        }

    @cached_property
    def _broken(self) -> frozenset[str]:
        """The files that have errors."""
        errors = (problem for problem in self.problems if problem.severity is Severity.ERROR)
        return frozenset(problem.where[0] for problem in errors)

    def model_of(self, interface: ir.Interface) -> Model | None:
        """Return a model of an interface, `None` if it or an interface that it needs has errors.

        Other interfaces of the package may have some.
        """
        for model in self.models.values():
            if model.interfaces.get(interface.name) is interface:
                return model.restricted_to(interface, self._broken)
        return None

    def interface(self, name: ir.TypeName) -> ir.Interface | None:
        """Return an interface that the folder has or uses."""
        models = self.models.values()
        return next((m.interfaces[name] for m in models if name in m.interfaces), None)

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface of any package, those of the folder first."""
        interface = self.interface(name)
        return (interface and interface.source) or self.library.source(name)

    def path_of(self, source: Source) -> Path:
        """Return the absolute path of a file's text."""
        return in_folder(self.folder, source.path)


class Workspace:
    """A folder that is checked as if `idlc check PATHS` ran in it.

    Without `paths`, the paths in its pyproject.toml are checked, or the folder. `texts` returns the
    texts of open documents by absolute path; it is called at each load.
    """

    def __init__(
        self,
        folder: Path,
        options: EditorSettings,
        texts: Callable[[], Mapping[Path, bytes]],
        paths: tuple[str, ...] = (),
    ) -> None:
        self.folder = folder
        #: The last failure of idlc itself.
        self.failure: Diagnostic | None = None
        self.is_loaded = False
        self._options = options
        self._texts = texts
        self._paths = paths
        self._baseline: Baseline | None = None
        self._old_baseline: Baseline | None = None
        self._snapshot: Snapshot | None = None

    def load(self) -> None:
        """Read the disk, unless it is loaded already; raises OSError if the folder is gone."""
        if self.is_loaded:
            return
        self._fixed = report = Report()  # problems that do not depend on texts
        self._old_baseline, self._baseline = self._baseline or self._old_baseline, None
        self._packages: tuple[Inputs, ...] = ()
        files = FileListing((), (), (), {})
        begun = time.time_ns()
        self._root = root = Root.at(self.folder, self._texts())
        with addressed_to(Audience.SETTINGS):
            options = self._options
            self._settings = settings = load_settings(root, report)
            selected = select.selection(settings, report)
            self._selection = selected.with_lists(options.select, options.ignore)
            chosen = (options.package, options.include, options.exclude, options.distro)
            self._scope = scope(settings, *chosen)
            # a mistake in the settings stops the command line, too
            if not report.had_errors:
                paths = self._paths or settings.paths or (".",)
                files = list_files(paths, root, report, self._scope.exclude)
                self._packages = inputs.packages(files.files, self._scope, report, files.packages)
            self._checkers = checkers(self._packages, self._scope, again=True)
            homes = {self.folder, *files.packages, *(file.root for file in files.files)}
            homes |= {settings.folder} if settings.folder else set()
            read = [root.absolute(file.path) for file in files.files]
            read += [home / name for home in homes for name in OTHER_INPUTS]
            rules = [home / RULES for home in homes]
            read += [*rules, *(file for folder in rules for file in folder.glob("*.py"))]
            on_disk = (path for path in read if not root.is_open(path))
            self._picture = DiskSnapshot(files.folders, on_disk, begun)
        self._places = {
            in_folder(self.folder, entry.file.shown): (number, at)
            for number, package in enumerate(self._packages)
            for at, entry in enumerate(package.files)
        }
        self._listed = {in_folder(self.folder, file.shown) for file in files.files}
        self.is_loaded = True

    def forget(self) -> None:
        """Have everything read again when it is needed."""
        self.is_loaded = False
        self._snapshot = None

    def snapshot(self) -> Snapshot | None:
        """Return the folder as it is now; `None` if it is gone, or after a `failure`."""
        if self._snapshot is None:
            self.failure = None
            is_new = not self.is_loaded
            try:
                self.load()
                self._snapshot = self._checked()
                if is_new:
                    gc.freeze()  # the data of a whole folder is no garbage
            except OSError:
                self.forget()
            except Exception as error:
                self.failure = internal_error(error, str(self.folder), _BUG)
        return self._snapshot

    def holds(self, path: Path) -> bool:
        """Return whether a file is checked; reads the disk if need be."""
        try:
            self.load()
        except Exception:  # which `snapshot` keeps
            return False
        return self.has(path)

    def lists(self, path: Path) -> bool:
        """Return whether a file is checked or is a duplicate of one; reads the disk if need be."""
        return self.holds(path) or (self.is_loaded and path in self._listed)

    def has(self, path: Path) -> bool:
        """Return whether a file is checked, as of the last load."""
        return self.is_loaded and path in self._places

    def follow(self, path: Path, data: bytes | None) -> None:
        """Use a new text for a file; `None` for the one on disk."""
        if not self.is_loaded:
            return
        number, at = self._places.get(path, (-1, -1))
        current = self._packages[number].files[at].data if number >= 0 else None
        if current is not None and data == current:
            return
        if data is not None and self._change(path, data):
            self._snapshot = None
        elif current is not None or self._concerns(path):
            self.forget()

    def is_current(self) -> bool:
        """Return whether the disk is certainly as it was read last."""
        if not self.is_loaded:
            return self.failure is not None or not is_folder(self.folder)
        return self._picture.is_current()

    def _change(self, path: Path, data: bytes) -> bool:
        """Use a text for a file that is checked, if no other file depends on it.

        Return whether that was so; otherwise, a load is needed.
        """
        number, at = self._places.get(path, (-1, -1))
        if number < 0 or len(data) > MAX_SIZE:
            return False
        packages, root = list(self._packages), self._root
        home = packages[number].home
        if not root.manifest(home) and any(map(root.locks, output_folders(home, root))):
            return False  # its texts may decide its name
        files = list(packages[number].files)
        files[at] = inputs.Input(files[at].file, data)
        packages[number] = msgspec.structs.replace(packages[number], files=tuple(files))
        self._packages = tuple(packages)
        return True

    def snapshot_with(self, path: Path, text: str) -> Snapshot | None:
        """Return the folder as it would be with a new text of a file; nothing is changed."""
        packages = self._packages
        try:
            is_changed = self._change(path, text.encode("utf-8", "replace"))
            return self._checked() if is_changed else None
        finally:
            self._packages = packages

    def _concerns(self, path: Path) -> bool:
        """Return whether a file outside of the packages may change the result of a check."""
        is_above = self.folder.is_relative_to(path.parent)
        if is_above and path.name in (settings.SETTINGS_FILE, MANIFEST):
            return True
        folders = (self.folder, *(in_folder(self.folder, folder) for folder in self._scope.include))
        return any(path.is_relative_to(folder) for folder in (*folders, *prefixes.ament_prefixes()))

    def inputs(self, path: Path) -> tuple[Inputs, InterfaceFile]:
        """Return the package of a file that is checked, and the file in it."""
        number, at = self._places[path]
        return self._packages[number], self._packages[number].files[at].file

    def facts(self, path: Path) -> Facts | None:
        """Return what package.xml of a file's package says."""
        return next(iter(self._checkers.values())).package_facts(self.inputs(path)[0])

    @property
    def baseline(self) -> Baseline:
        """The version to compare with: that of the options, or the one of pyproject.toml."""
        if self._baseline is None:
            from idlc.tasks.breaking.files import Baseline

            against = self._options.against
            self._baseline = Baseline(self.folder, against, self._settings, self._scope)
            self._baseline.follow(self._old_baseline)
        return self._baseline

    def before(self) -> Side:
        """Return the packages as they were in the version to compare with."""
        return self.baseline.side(self._packages)

    def has_moved(self) -> bool:
        """Return whether the version that was compared with is another commit now."""
        is_known = self.is_loaded and bool(self._baseline or self._old_baseline)
        return is_known and self.baseline.has_moved()

    @property
    def library(self) -> Library:
        """The interfaces that can be found from the folder."""
        return next(iter(self._checkers.values())).library

    def _checked(self) -> Snapshot:
        """Return the folder, checked with its current texts."""
        with addressed_to(Audience.SETTINGS):
            problems, models = check_all(self._checkers, self._packages, self._selection)
        first = next(iter(self._checkers))
        return Snapshot(
            self.folder,
            self._root,
            (*self._fixed, *problems),
            {model.package: model for model in models[first]},
            self._checkers[first].library,
        )


def in_folder(folder: Path, path: str) -> Path:
    """Return the path of a file as the editor spells the folder, which may be a link."""
    return Path(os.path.normpath(folder / path))


def stray_folder(path: Path) -> tuple[Path, tuple[str, ...]]:
    """Return the folder in which a file outside of all workspaces is checked, and its paths.

    That is its package; without a package.xml, only the file with the files that it refers to.
    """
    folder = root_of(str(path.parent))
    declared = Root(folder).manifest(folder)
    if declared is None:
        return folder, (path.relative_to(folder).as_posix(),)
    return declared.parent, (".", path.relative_to(declared.parent).as_posix())
