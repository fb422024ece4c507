"""The pipeline of `idlc gen`: compile, render, compare with the files on disk, write."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from idlc.compiler.compiler import Compiler, library_for
from idlc.compiler.requests import (
    borrowed,
    completed,
    requested_packages,
)
from idlc.diagnostics.report import Report, first_few
from idlc.generate.package import Generated, PlannedPackage, generated, up_to_date, with_needs
from idlc.generate.target import (
    Output,
    Target,
    folder_targets,
)
from idlc.generate.vendoring import leftovers, planned
from idlc.language.tree import OPTIONAL
from idlc.model import ir
from idlc.packaging.facts import home_of
from idlc.packaging.files import SETUP_PY
from idlc.project import inputs, lock, settings
from idlc.project.atomic import exclusive
from idlc.project.files import is_file
from idlc.project.find import root_of, unread_idl
from idlc.project.library import InterfaceTexts, Library, resolve
from idlc.project.lock import Runtime, Vendoring, load_lock
from idlc.project.package_xml import declared_name
from idlc.project.root import Root
from idlc.project.settings import Config, Scope, load_settings, scope
from idlc.project.words import read_words
from idlc.version import __version__


class GenOptions(NamedTuple):
    """The arguments of `idlc gen`, which writes to `out`, into the prefix `ament`, or both.

    Types of `topics` of recordings are written; none means all. `again` is the command for hints
    that writes the files which `check` compares. Without `runtime`, each package keeps its own.
    """

    paths: tuple[str, ...]
    scope: Scope
    out: str = ""
    topics: tuple[str, ...] = ()
    check: bool = False
    runtime: Runtime | None = None
    vendoring: Vendoring = ""
    force: bool = False
    ament: str = ""
    again: str = "idlc gen"


def with_settings(options: GenOptions, settings: Config) -> GenOptions:
    """Return options, with defaults from pyproject.toml."""
    return options._replace(
        paths=options.paths or settings.paths,
        out=options.out or ("" if options.ament else settings.out or ""),
        runtime=settings.runtime,
        vendoring=options.vendoring or settings.vendoring,
    )


def in_package(options: GenOptions) -> GenOptions:
    """Return options with defaults from the package of the working folder.

    A package that setup.py builds is compiled into the folder from which setup.py installs it.
    """
    if options.ament or (options.out and options.paths) or len(options.paths) > 1:
        return options
    root = options.scope.root
    folder = root.absolute(next(iter(options.paths), "."))
    path = root.manifest(folder)
    if path is None or (options.paths and path.parent != folder):
        return options
    name = declared_name(path, root, Report())
    if not name or not is_file(path.parent / SETUP_PY):
        return options
    return options._replace(
        paths=options.paths or (root.shown(path.parent),),
        out=options.out or root.shown(home_of(path.parent, options.scope.package or name, root)),
    )


def gen(options: GenOptions, report: Report) -> tuple[Generated, ...]:
    """Write, or with `check` compare, packages and what they vendor. Raises ReportedError."""
    runs = [options._replace(ament="")] if options.out else []
    if options.ament:  # last, because the package may be named by OUT
        # all that is in a prefix is beside each other
        runs.append(options._replace(vendoring="beside" if options.vendoring else ""))
    done: list[Generated] = []
    try:
        for run in runs:
            root = options.scope.root.on_disk()  # a run sees the output of the one before
            scope = msgspec.structs.replace(options.scope, root=root)
            done += _run_once(run._replace(scope=scope), report)
            report.raise_errors()
    finally:
        report.notes[:] = dict.fromkeys(report.notes)
    return tuple(done)


def _run_once(options: GenOptions, report: Report) -> tuple[Generated, ...]:
    root = options.scope.root
    meant = read_words(options.paths, root)
    recordings, paths, words = meant["recording"], meant["path"], meant["name"]
    named = named_packages(words, options.scope, report, whole=bool(options.ament))
    report.raise_errors()
    texts: InterfaceTexts = {}
    if recordings:
        from idlc.api.sources import read_source
        from idlc.recordings.packages import recorded_packages

        recorded, texts = recorded_packages(
            read_source,
            recordings,
            options.topics,
            options.scope,
            report,
            whole=bool(options.ament),
        )
        named += recorded
        report.raise_errors()
        from idlc.tasks.check_recordings import note_fitting

        note_fitting(recordings, options.scope, report)
    packages = requested_packages(paths, named, options.out, options.scope, report)
    for package in packages:
        is_whole = options.ament or package.package in words or package.is_whole(root)
        if is_whole and (names := unread_idl(package.folders, options.scope.exclude)):
            files = first_few((f"`{name}`" for name in names), 3)
            report.notes.append(
                f"idlc does not compile .idl files, so `{package.package}` lacks the "
                f"types in {files}"
            )
    folders = _targets(packages, options, report) if packages else ()
    if not folders:
        return ()
    with exclusive(folders[0].path):
        done = _compile_and_write(dict(zip(folders, packages, strict=True)), texts, options, report)
        if options.ament and done and not options.check:
            from idlc.generate.prefix import write_setup_scripts

            write_setup_scripts(folders[0])
        return done


def _targets(
    packages: Sequence[inputs.Inputs], options: GenOptions, report: Report
) -> tuple[Target, ...]:
    """Return the folder that each package is written to."""
    scope = options.scope
    distros = tuple(distro.name for distro in scope.distros)
    output = Output(
        scope.root,
        report,
        options.force,
        options.runtime,
        distros,
        options.check,
        scope.enums,
        options.again,
    )
    if not options.ament:
        return folder_targets(packages, options.out, output)
    from idlc.generate.prefix import Overlay  # imported only where one is written

    prefix = options.ament.rstrip("/") or "/"
    overlays = []
    for package in packages:
        home = next(iter(package.folders), None) if package.borrowed else package.home
        overlays.append(Overlay(prefix, package.package, home, output))
    return tuple(overlays) if overlays[0].usable() else ()


def named_packages(
    words: Sequence[str], scope: Scope, report: Report, *, whole: bool
) -> list[inputs.Inputs]:
    """Return the packages that names resolve to, with the interfaces that they resolve to.

    Packages are `whole` in a prefix, where they hide packages of the same name in others.
    """
    chosen: dict[str, set[ir.TypeName]] = {}
    libraries: dict[str, Library] = {}
    for word in words:
        library, definitions = resolve(word, scope, report)
        for definition in definitions:
            package = definition.interface.package
            names = library.interfaces(package) if whole else (definition.interface,)
            chosen.setdefault(package, set()).update(names)
            libraries[package] = library
    return [borrowed(types, libraries[package]) for package, types in sorted(chosen.items())]


def _compile_and_write(
    requested: Mapping[Target, inputs.Inputs],
    texts: InterfaceTexts,
    options: GenOptions,
    report: Report,
) -> tuple[Generated, ...]:
    library = library_for(tuple(requested.values()), options.scope, report, texts)
    # recorded types may have errors, with which those of the files are reported
    if not options.check and not report.had_errors and not _may_be_refused(requested, library):
        current = [
            up_to_date(target, package.digests, library, options.vendoring)
            for target, package in requested.items()
        ]
        if all(current):
            done = [package for packages in current for package in packages]
            return with_needs(done, requested, library.distro, report, options.again)
    compiler = Compiler(library)
    models = [model for _, model in compiler.all(requested.values(), report)]
    report.raise_errors()
    needed = {name for model in models for name in model.interfaces}
    if more := completed(requested.values(), needed, library):
        return _compile_and_write(dict(zip(requested, more, strict=True)), texts, options, report)
    packages = planned(models, requested, compiler, options.vendoring)
    if options.check:
        for package in packages:
            package.target.drift(package.plan, package.lock, options.again)
    elif not _write(packages):
        return ()
    targets = requested if packages else ()
    return with_needs(map(generated, packages), targets, library.distro, report, options.again)


def _may_be_refused(requested: Mapping[Target, inputs.Inputs], library: Library) -> bool:
    """Return whether files that another distribution accepts may have errors for this one."""
    if library.distro.reads_optional:
        return False
    files = (file for package in requested.values() for file in package.files)
    return any(OPTIONAL.encode() in file.data for file in files)


def _write(packages: Sequence[PlannedPackage]) -> bool:
    """Write packages and remove what earlier runs left; return whether all of it was possible."""
    stale = tuple(leftovers(packages))
    removals = [(target, plan) for target, plan in stale if plan]
    return (
        len(removals) == len(stale)
        and all(package.target.apply(package.plan, package.lock) for package in packages)
        and all(target.remove(plan) for target, plan in removals)
    )


class Run(NamedTuple):
    """A run of `idlc gen` in a folder."""

    folder: Path
    options: GenOptions

    def lock(self, package: str) -> lock.Lock | None:
        """Return the lock of a package from the last run; `None` if there was none."""
        out = self.folder / self.options.out
        locks = (load_lock(folder, "", Report()) for folder in (out / package, out))
        return next((lock for lock in locks if lock and lock.package == package), None)

    def is_needed(self, package: str, inputs: Mapping[str, str], key: str) -> bool:
        """Return whether a package was generated from other texts, or by another idlc.

        `inputs` are the digests of all files of the package, `key` is one that it must have.
        """
        lock = self.lock(package)
        if lock is None or lock.idlc != __version__ or key not in lock.inputs:
            return True
        return any(inputs.get(name) != digest for name, digest in lock.inputs.items())

    def make(self, report: Report) -> tuple[Generated, ...]:
        """Write, and return the packages. Raises OSError and ReportedError."""
        root = Root.at(self.folder)
        scope = msgspec.structs.replace(self.options.scope, root=root)
        return gen(self.options._replace(scope=scope), report)


def run_for(path: Path, package: str) -> Run | None:
    """Return the run that compiles a file of a package.

    The nearest settings with paths and an output decide, or else the lock of a generated package
    in the source package, or beside its interfaces.
    """
    for folder in path.parents:
        if not is_file(folder / settings.SETTINGS_FILE):
            continue
        root, report = Root.at(folder), Report()
        config = load_settings(root, report)
        options = with_settings(GenOptions((), scope(config)), config)
        covered = any(path.is_relative_to(root.absolute(each)) for each in options.paths)
        if options.out and covered and not report.had_errors:
            return Run(folder, options)
    home = root_of(str(path.parent))
    for out in (home / package, home):
        lock = load_lock(out, "", Report())
        if lock is not None and lock.package == package:
            chosen = scope(load_settings(Root.at(home), Report()), package)
            name = out.relative_to(home).as_posix()
            return Run(home, GenOptions((".",), chosen, name, vendoring=lock.vendoring))
    return None
