"""The pipeline of `idlc gen`: compile, render, compare with what is on disk, write."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import msgspec

from idlc.check.compiler import Compiler, library_for
from idlc.check.package.facts import home_of
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.source import Source
from idlc.generate.package import Generated, generated, planned, up_to_date, with_needs
from idlc.generate.requested import borrowed, completed, targets, unread_idl, wanted
from idlc.generate.target import Target
from idlc.language.tree import OPTIONAL
from idlc.model import ir
from idlc.model.distros import Distro
from idlc.project import inputs, lock, settings
from idlc.project.files import is_file
from idlc.project.find import is_path, root_of
from idlc.project.library import resolve
from idlc.project.lock import load_lock
from idlc.project.package_xml import declared_name
from idlc.project.root import Root
from idlc.project.settings import Config, Scope, load_settings, scope
from idlc.recordings.find import divided, is_recording
from idlc.version import __version__

if TYPE_CHECKING:
    from pathlib import Path


class GenOptions(NamedTuple):
    """What `idlc gen` was asked to do: to write to `out`, into the prefix `ament`, or both.

    `topics` are those of recordings whose types are wanted; none means all. `again` is the command
    that writes what `check` compares, for hints.
    """

    paths: tuple[str, ...]
    scope: Scope
    out: str = ""
    topics: tuple[str, ...] = ()
    check: bool = False
    vendor_deps: bool = False
    force: bool = False
    ament: str = ""
    again: str = "idlc gen"


def with_settings(wanted: GenOptions, settings: Config) -> GenOptions:
    """Return what was typed, with what pyproject.toml says where nothing was."""
    return wanted._replace(
        paths=wanted.paths or settings.paths,
        out=wanted.out or ("" if wanted.ament else settings.out or ""),
        vendor_deps=wanted.vendor_deps or settings.vendor_deps,
    )


def in_package(wanted: GenOptions) -> GenOptions:
    """Return options with what the package around implies where nothing was said.

    A package that setup.py builds is compiled into the folder from which setup.py installs it.
    """
    if wanted.ament or (wanted.out and wanted.paths) or len(wanted.paths) > 1:
        return wanted
    root = wanted.scope.root
    given = root.absolute(next(iter(wanted.paths), "."))
    path = root.manifest(given)
    if path is None or (wanted.paths and path.parent != given):
        return wanted
    name = declared_name(path, root, Report())
    if not name or not is_file(path.parent / "setup.py"):
        return wanted
    return wanted._replace(
        paths=wanted.paths or (root.shown(path.parent),),
        out=wanted.out or root.shown(home_of(path.parent, wanted.scope.package or name, root)),
    )


def gen(options: GenOptions, report: Report) -> tuple[Generated, ...]:
    """Write, or with `check` compare, packages and what they vendor; empty after an error."""
    runs = [options._replace(ament="")] if options.out else []
    runs += [options] if options.ament else []  # OUT may give the package its name
    done: list[Generated] = []
    for run in runs:
        if not report.had_errors:
            root = options.scope.root.on_disk()  # a run sees what the one before it wrote
            scope = msgspec.structs.replace(options.scope, root=root)
            done += _written(run._replace(scope=scope), report)
    report.notes[:] = dict.fromkeys(report.notes)
    return () if report.had_errors else tuple(done)


def _written(options: GenOptions, report: Report) -> tuple[Generated, ...]:
    root = options.scope.root
    recordings, others = divided(options.paths, root)
    paths = [word for word in others if not is_name(word, root)]
    words = [word for word in others if is_name(word, root)]
    named = named_packages(words, options.scope, report, whole=bool(options.ament))
    texts: Mapping[ir.TypeName, Source] = {}
    if recordings and not report.had_errors:
        from idlc.recordings.packages import recorded_packages

        recorded, texts = recorded_packages(
            recordings, options.topics, options.scope, report, whole=bool(options.ament)
        )
        named += recorded
    if report.had_errors:
        return ()
    given = wanted(paths, named, options.out, options.scope, report)
    whole = {one.package for one in given if one.is_whole(root) or options.ament}.union(words)
    _note_idl((one for one in given if one.package in whole), options.scope, report)
    found = _targets(given, options, report) if given else ()
    if not found:
        return ()
    with found[0].alone(beside=options.vendor_deps or len(found) > 1):
        done = _made(dict(zip(found, given, strict=True)), texts, options, report)
        if options.ament and done and not options.check:
            from idlc.generate.prefix import enter

            enter(found[0])
        return done


def _note_idl(given: Iterable[inputs.Inputs], scope: Scope, report: Report) -> None:
    for one in given:
        if names := unread_idl(one.folders, scope.exclude):
            files = first_few((f"`{name}`" for name in names), 3)
            report.notes.append(
                f"idlc does not compile .idl files, so `{one.package}` lacks what these define: "
                f"{files}"
            )


def _targets(
    given: Sequence[inputs.Inputs], options: GenOptions, report: Report
) -> tuple[Target, ...]:
    """Return the folder that each package is written to."""
    if not options.ament:
        return targets(given, options.out, options.scope.root, report, force=options.force)
    from idlc.generate.prefix import Overlay  # imported only where one is written

    prefix = options.ament.rstrip("/") or "/"
    homes = (
        (one.package, one.home if not one.borrowed else next(iter(one.folders), None))
        for one in given
    )
    distros = [one.name for one in options.scope.distros]
    found = [
        Overlay(
            prefix, name, home, options.scope.root, report, force=options.force, distros=distros
        )
        for name, home in homes
    ]
    return tuple(found) if found[0].usable() else ()


def is_name(word: str, root: Root) -> bool:
    """Return whether a word means a type, or a package, rather than a path that is not there."""
    last = word.rpartition("/")[2]
    return not is_path(word, root) and ("/" not in word or not last[:1].islower())


def named_packages(
    words: Sequence[str], scope: Scope, report: Report, *, whole: bool
) -> list[inputs.Inputs]:
    """Return the packages that names mean, with those of their interfaces that are meant.

    They are `whole` in a prefix, where they hide those of the same name in others.
    """
    chosen: dict[str, set[ir.TypeName]] = {}
    found = []
    for word in words:
        library, meant = resolve(word, scope, report)
        for one in meant:
            package = one.interface.package
            names = library.interfaces(package) if whole else (one.interface,)
            chosen.setdefault(package, set()).update(names)
        found += [(library, package) for package in {one.interface.package for one in meant}]
    libraries = {package: library for library, package in found}
    return [borrowed(types, libraries[package]) for package, types in sorted(chosen.items())]


def _made(
    wanted: Mapping[Target, inputs.Inputs],
    texts: Mapping[ir.TypeName, Source],
    options: GenOptions,
    report: Report,
) -> tuple[Generated, ...]:
    library = library_for(tuple(wanted.values()), options.scope, report, texts)
    if not (options.check or report.had_errors or _may_be_refused(wanted.values(), library.distro)):
        current = [
            up_to_date(target, given.digests, library, options.vendor_deps)
            for target, given in wanted.items()
        ]
        if all(current):
            done = [one for each in current for one in each]
            return with_needs(done, wanted, library.distro, report, options.again)
    compiler = Compiler(library)
    models = [model for _, model in compiler.all(wanted.values(), report)]
    needed = {name for model in models for name in model.interfaces}
    if not report.had_errors and (more := completed(wanted.values(), needed, library)):
        return _made(dict(zip(wanted, more, strict=True)), texts, options, report)
    packages = []
    if not report.had_errors:
        packages = planned(
            models, wanted, compiler, check=options.check, vendor_deps=options.vendor_deps
        )
    if options.check:
        for one in packages:
            one.target.drift(one.plan, one.lock, options.again)
    elif not all(one.target.apply(one.plan, one.lock) for one in packages):
        return ()
    targets = wanted if packages else ()
    return with_needs(map(generated, packages), targets, library.distro, report, options.again)


def _may_be_refused(given: Iterable[inputs.Inputs], distro: Distro) -> bool:
    """Return whether files that one distribution accepted may be an error for this one."""
    if distro.reads_optional:
        return False
    return any(OPTIONAL.encode() in file.data for one in given for file in one.files)


class Run(NamedTuple):
    """A run of `idlc gen` in a folder."""

    folder: Path
    options: GenOptions

    def lock(self, package: str) -> lock.Lock | None:
        """Return what the last run recorded of a package; `None` if there was none."""
        out = self.folder / self.options.out
        found = (load_lock(one, "", Report()) for one in (out / package, out))
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
        root = Root.at(self.folder)
        paths = tuple(
            root.path(word) if is_recording(word, root) else word for word in self.options.paths
        )
        scope = msgspec.structs.replace(self.options.scope, root=root)
        return gen(self.options._replace(paths=paths, scope=scope), report)


def run_for(path: Path, package: str) -> Run | None:
    """Return the run that compiles a file of a package.

    It is that of the nearest settings which say what is written where, or the one that made a
    generated package in the source package, or beside its interfaces.
    """
    for folder in path.parents:
        if is_file(folder / settings.SETTINGS_FILE) and (found := _by_settings(folder, path)):
            return found
    return _by_lock(path, package)


def _by_settings(folder: Path, path: Path) -> Run | None:
    report = Report()
    root = Root.at(folder)
    settings = load_settings(root, report)
    wanted = with_settings(GenOptions((), scope(settings)), settings)
    covered = any(path.is_relative_to(root.absolute(one)) for one in wanted.paths)
    return Run(folder, wanted) if wanted.out and covered and not report.had_errors else None


def _by_lock(path: Path, package: str) -> Run | None:
    home = root_of(str(path.parent))
    for out in (home / package, home):
        lock = load_lock(out, "", Report())
        if lock is not None and lock.package == package:
            found = scope(load_settings(Root.at(home), Report()), package)
            name = out.relative_to(home).as_posix()
            return Run(home, GenOptions((".",), found, name, vendor_deps=lock.vendor_deps))
    return None
