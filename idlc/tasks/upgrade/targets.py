"""The types of `--to`: a folder, a git revision, a distribution, or those of this machine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import msgspec

from idlc.api.sources import read_source
from idlc.compiler.compiler import Compiler, sources_of
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.model import catalog, derive, ir
from idlc.model.distros import Distro
from idlc.project import find, inputs
from idlc.project.library import IDL, InterfaceTexts, Library
from idlc.project.package_xml import declared_name
from idlc.project.settings import Scope
from idlc.project.words import VersionWord, read_distro, read_version
from idlc.recordings.packages import check_versions
from idlc.recordings.types import topics_of, versions
from idlc.versions.revision import checked_out
from idlc.wire.layout import report_oversized


class _NewTypes(Library):
    """The types of a target, and of a recording for the packages that the target lacks."""

    def __init__(
        self, target: UpgradeTarget, recorded: InterfaceTexts, *place: Any, **options: Any
    ) -> None:
        super().__init__(*place, **options)
        self._target = target
        self._recorded = recorded

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface, or `None` if it was removed or is nowhere."""
        target = self._target
        if name == derive.SERVICE_EVENT_INFO:  # events have it where a distribution has not
            return super().source(name)
        if name in target.texts or target.defines(name.package):
            own = target.texts.get(name)
            standard = target.distro and catalog.source(name, target.distro)
            return own or standard or None
        if target.distro:  # the packages of others are not a part of it
            return self._recorded.get(name) or super().source(name)
        return super().source(name) or self._recorded.get(name)


class UpgradeTarget(msgspec.Struct, frozen=True, eq=False):
    """The types to upgrade to.

    `texts` are those of its own packages, whose folders are `homes`; `distro` is the distribution
    that it is. Without both it is this machine's types.
    """

    scope: Scope
    texts: InterfaceTexts
    homes: dict[str, Path]
    whole: frozenset[str] = frozenset()
    distro: Distro | None = None

    def defines(self, package: str) -> bool:
        """Return whether the target has all interfaces of a package, so that others are gone."""
        return package in self.whole or bool(self.distro and catalog.is_standard(package))

    def owns(self, package: str) -> bool:
        """Return whether a package is one of the folder or revision that was named."""
        return any(name.package == package for name in self.texts)

    def compiler(self, recorded: InterfaceTexts) -> Compiler:
        """Return a compiler that finds the target's types, and recorded ones where it has none."""
        scope = self.scope
        library = _NewTypes(
            self,
            recorded,
            scope.include,
            scope.root,
            Report(),
            own={} if self.texts else inputs.nearby_packages(scope.root),
            exclude=scope.exclude,
            distro=self.distro or scope.distro,
            idl=True,
        )
        return Compiler(library)


@contextmanager
def target_of(to: str | None, scope: Scope, report: Report) -> Iterator[UpgradeTarget]:
    """Give the types that `--to` means, such as those of a recording. Raises ReportedError."""
    if to is None:
        folders = inputs.nearby_packages(scope.root)
        homes = {package: places[0] for package, places in folders.items() if places}
        yield UpgradeTarget(scope, {}, homes)
        return
    match read_version(to, scope.root):
        case VersionWord("distribution", name):
            yield UpgradeTarget(scope, {}, {}, distro=read_distro(name, report))
        case VersionWord("revision", name):
            paths = scope.paths or (".",)
            with checked_out(name, paths[0], scope.root, report) as revision:
                listing = revision.listing(paths, scope.exclude, report)
                exclude = scope.exclude.seen_from(revision.folder, revision.top)
                yield _of_listing(listing, exclude, revision.shown, scope, report)
        case VersionWord("recording"):
            yield _of_recording(to, scope, report)
        case _:
            yield _of_path(to, scope, report)


def _of_recording(path: str, scope: Scope, report: Report) -> UpgradeTarget:
    groups = versions(topics_of(read_source, [path], (), scope.root, report))
    check_versions(groups, report)
    report.raise_errors()
    return UpgradeTarget(scope, groups[0].texts if groups else {}, {})


def _of_path(path: str, scope: Scope, report: Report) -> UpgradeTarget:
    """Return the types of an interface file, or of all packages in a folder."""
    listing = find.list_files([path], scope.root, report, scope.exclude)
    target = _of_listing(listing, scope.exclude, scope.root.shown, scope, report)
    if not target.texts:
        report.extend(find.no_interfaces(each, scope.root, scope.exclude) for each in listing.empty)
    return target


def _of_listing(
    listing: find.FileListing,
    exclude: find.Exclusions,
    shown: Callable[[Path], str],
    scope: Scope,
    report: Report,
) -> UpgradeTarget:
    """Return the types of files, and of .idl files in the packages that were listed."""
    root = scope.root
    texts: dict[ir.TypeName, Source] = {}
    homes: dict[str, Path] = {}
    for folder in listing.packages:
        manifest = root.manifest(folder)
        declared = declared_name(manifest, root, Report()) if manifest else None
        package = declared or folder.name
        for name in find.unread_idl([folder], exclude):
            kind, _, file = name.partition("/")
            source = root.read_source(folder / name, shown(folder / name), report)
            if source is not None:
                homes[package] = folder
                interface = ir.TypeName(package, cast("ir.Kind", kind), file.removesuffix(IDL))
                texts[interface] = source
    target = _of_files(listing.files, scope, report)
    if not texts:
        return target
    texts.update(target.texts)
    return UpgradeTarget(scope, texts, homes | target.homes, target.whole | homes.keys())


def _of_files(files: tuple[find.InterfaceFile, ...], scope: Scope, report: Report) -> UpgradeTarget:
    packages = inputs.packages(files, scope, report)
    texts = {name: source for package in packages for name, source in sources_of(package, report)}
    report.raise_errors()
    whole = frozenset(package.package for package in packages if package.is_whole(scope.root))
    homes = {package.package: (package.folders or (package.home,))[0] for package in packages}
    return UpgradeTarget(scope, texts, homes, whole)


def compiled(compiler: Compiler, names: set[ir.TypeName], report: Report) -> Any:
    """Return the models of interfaces by package. Raises ReportedError."""
    problems = Report()
    models = compiler.models(compiler.reached(names), problems)
    report_oversized(models.values(), problems)
    report.extend(problems.errors)
    problems.raise_errors()
    return models
