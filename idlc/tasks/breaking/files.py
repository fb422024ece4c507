"""The pipeline of `idlc breaking`: compile two versions alike, and report their differences."""

from __future__ import annotations

import datetime
import os
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, TypeAlias

import msgspec

from idlc.compiler.compiler import models_of, stage, without_errors
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError, first_few
from idlc.model import ir
from idlc.model.link import Model
from idlc.project import find, git, inputs, lock
from idlc.project.files import entries, is_file, is_folder
from idlc.project.inputs import Inputs, by_home
from idlc.project.lock import load_lock
from idlc.project.package_xml import read_statements
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import Config, Scope
from idlc.project.words import VersionWord, read_version
from idlc.versions.changes import LEVELS, Change
from idlc.versions.distribution import compare_with_distro
from idlc.versions.packages import (
    Allowance,
    Comparison,
    Skipped,
    against,
    allowances,
    combine,
    compare,
    compare_hashes,
    part_to_raise,
    raised,
)
from idlc.versions.revision import Revision, checked_out, is_revision
from idlc.wire.layout import oversized, report_oversized

#: The inputs of packages.
Packages: TypeAlias = Sequence[Inputs]
#: Names that are listed in a sentence.
NAMED = 5
_CHECK_OUT = "`git sparse-checkout disable` checks out all files"
_SUBMODULES = "compare them in their own repository, or allow it in [[tool.idlc.breaking.allow]]"


class BreakingOptions(msgspec.Struct, frozen=True):
    """The options of `idlc breaking`; `today` is a day as YYYY-MM-DD."""

    paths: tuple[str, ...]
    against: str
    scope: Scope
    levels: tuple[str, ...] = LEVELS
    allowed: tuple[Allowance, ...] = ()
    allowed_in: str = ""
    today: str = ""


class Verdict(NamedTuple):
    """The result: the number of changes by broken level, and the version part to raise.

    `added` breaks nothing; `not_compared` could not be compared. There is no part to raise without
    a difference, after an incomplete comparison, and for a comparison with a distribution.
    `hidden` counts changes that break only other levels than the selected ones, `compared`
    interfaces of the old version.
    """

    levels: dict[str, int]
    allowed: int
    part: str | None
    version: str | None
    next_version: str | None
    added: tuple[str, ...] = ()
    not_compared: tuple[str, ...] = ()
    hidden: int = 0
    compared: int = 0

    @property
    def seen(self) -> dict[str, int]:
        """The number of compared items by kind."""
        return {"interface": self.compared}


def breaking(options: BreakingOptions, report: Report) -> Verdict:
    """Report each change that breaks something; ReportedError if a version cannot be compiled."""
    root, exclude = options.scope.root, options.scope.exclude
    listing = find.list_files(options.paths, root, report, exclude)
    packages = inputs.packages(listing.files, options.scope, report)
    report.raise_errors()
    version = read_version(options.against, root)
    comparison = _against(options, version, packages, report)
    # an empty folder is fine if its interfaces were removed; errors may be why it seems empty
    if listing.empty and not (comparison.differs or report.had_errors):
        report.extend(find.no_interfaces(path, root, exclude) for path in listing.empty)
        raise ReportedError
    is_complete = not comparison.skipped
    skipped = report_skipped(comparison.skipped, options, report)
    # unused allowances may be for what was skipped
    judged = judge(comparison.changes, options, report, is_all=is_complete)
    is_version = is_complete and version.meaning != "distribution"
    part = part_to_raise(comparison) if is_version else None
    current = _version(packages, root, report)
    following = raised(current, part) if current and part else None
    allowed = judged.allowed + sum(len(each.names) for each in comparison.skipped) - len(skipped)
    facts = comparison.additions, skipped, judged.hidden, comparison.compared
    return Verdict(judged.levels, allowed, part, current, following, *facts)


def report_skipped(
    skipped: Iterable[Skipped], options: BreakingOptions, report: Report
) -> tuple[str, ...]:
    """Report IDL520 for what could not be compared, and return its names; some can be allowed."""
    names: list[str] = []
    for each in skipped:
        changes = [Change(codes.NOT_COMPARED, name, "", frozenset()) for name in each.names]
        left = [change.subject for change in not_allowed(changes, options, report)]
        if left:
            listed = first_few((f"`{name}`" for name in left), NAMED)
            message = f"idlc did not compare {listed}: {each.reason}"
            place = options.paths[0] if options.paths else options.against
            report.add(codes.NOT_COMPARED.of(place, message, hint=each.hint))
        names += left
    return tuple(sorted(names))


def report_nothing(options: BreakingOptions, reason: str, hint: str, report: Report) -> None:
    """Report IDL521 for a comparison in which no interface has two versions."""
    message = f"idlc compared nothing: {reason}"
    report.add(codes.NOTHING_COMPARED.of(options.against, message, hint=hint))


class Judged(NamedTuple):
    """The number of reported changes by broken level, of allowed ones, and of unselected ones."""

    levels: dict[str, int]
    allowed: int
    hidden: int


def judge(
    changes: Sequence[Change],
    options: BreakingOptions,
    report: Report,
    *,
    is_all: bool = False,
    concerns: Callable[[Change], bool] = lambda _: False,
) -> Judged:
    """Report the changes of the selected levels, without levels those of which `concerns` is true.

    `is_all`: no other comparison needs the allowances, so unused ones are reported.
    """
    left = not_allowed(changes, options, report, is_all=is_all)
    levels = set(options.levels)
    selected = [each for each in left if (each.levels & levels if levels else concerns(each))]
    report.extend(change.diagnostic for change in selected)
    broken = Counter[str](level for change in selected for level in change.levels)
    counts: dict[str, int] = {level: broken[level] for level in LEVELS}
    return Judged(counts, len(changes) - len(left), len(left) - len(selected))


def not_allowed(
    changes: Sequence[Change], options: BreakingOptions, report: Report, *, is_all: bool = False
) -> tuple[Change, ...]:
    """Return the changes without an allowance; reports ended ones, and unused ones if `is_all`."""
    allowed: set[int] = set()
    for entry in options.allowed:
        covered = [at for at, change in enumerate(changes) if entry.covers(change)]
        if not covered and is_all:
            message = f"unused allowance for `{entry.at}`"
            hint = "remove the entry"
            report.add(codes.UNUSED_ALLOWANCE.of(options.allowed_in, message, hint=hint))
        elif covered and entry.until.isoformat() < options.today:
            message = f"the allowance for `{entry.at}` expired on {entry.until} ({entry.reason})"
            hint = "revert the change, or set a new date"
            report.add(codes.EXPIRED_ALLOWANCE.of(options.allowed_in, message, hint=hint))
        else:
            allowed.update(covered)
    return tuple(change for at, change in enumerate(changes) if at not in allowed)


def _against(
    options: BreakingOptions, version: VersionWord, packages: Packages, report: Report
) -> Comparison:
    if version.meaning == "distribution":
        comparison = compare_with_distro(version.name, packages, options.scope, report)
        if not (comparison.compared or comparison.additions):
            reason = "the interfaces use no standard interface"
            report_nothing(options, reason, "without PATH, idlc compares all of them", report)
            raise ReportedError
        return comparison
    if version.meaning == "revision":
        with checked_out(version.name, options.paths[0], options.scope.root, report) as revision:
            comparison = _compare(options, packages, revision, report)
        prefix = f"{options.against}:"
        return comparison.placed(lambda path: path.removeprefix(prefix))
    if options.against.endswith(lock.FILE):
        return _compare_with_lock(options, packages, report)
    if is_revision(options.against, options.paths[0], options.scope.root):
        message = f"no such file or folder: `{options.against}`"
        hint = f"for the git revision, use `--against git:{options.against}`"
        raise report.refused(codes.NO_SUCH_PATH.of(options.against, message, hint=hint))
    return _compare(options, packages, None, report)


class Side(NamedTuple):
    """One of two versions: the models of its packages, without broken interfaces.

    `broken` are the interfaces that have errors, and their users; `error` is the first error in
    words. `skipped` are interfaces whose version is not known.
    """

    models: Mapping[str, Model]
    broken: frozenset[ir.TypeName]
    error: str
    skipped: tuple[Skipped, ...] = ()

    @property
    def interfaces(self) -> list[ir.Interface]:
        """The interfaces of all packages."""
        return [own for model in self.models.values() for own in model.own]

    @property
    def names(self) -> frozenset[ir.TypeName]:
        """The names of all interfaces, broken ones included."""
        return self.broken.union(own.name for own in self.interfaces)

    def without(self, names: AbstractSet[str]) -> dict[str, Model]:
        """Return the models with their interfaces, except those with these names."""
        return {
            package: model.only({own.name for own in model.own if str(own.name) not in names})
            for package, model in self.models.items()
        }


def _compare(
    options: BreakingOptions, packages: Packages, revision: Revision | None, report: Report
) -> Comparison:
    before = None
    with suppress(ReportedError):  # so that errors of the new version are reported, too
        before = _before(options, packages, revision, report)
    problems = Report()
    after = _side(packages, {}, _newer_scope(options), problems)
    report.extend(problems.errors)
    if before is None or any(problem.code in codes.USAGE for problem in report):
        raise ReportedError
    skipped = [
        Skipped(tuple(map(str, sorted(before.broken))), _errors_in(options.against), before.error),
        *before.skipped,
    ]
    if revision:
        skipped += _outside(options, packages, before, after, revision)
    out = {name for each in skipped for name in each.names} | {*map(str, after.broken)}
    old, new = before.without(out), after.without(out)
    with stage("compare", options.against):
        whole = combine(
            compare(*(side.get(package) or Model(package, (), {}) for side in (old, new)))
            for package in {**old, **new}
        )
    homes = [folder for package in packages for folder in package.folders]
    if any(is_folder(home / find.RULES) for home in homes):
        from idlc.versions.coverage import rule_folders, with_rules

        places = rule_folders(homes)
        changes = with_rules(whole.changes, old, new, places, options.scope.root)
        whole = whole._replace(changes=changes)
    rest = out.difference(*(each.names for each in skipped))
    skipped += [Skipped(tuple(sorted(rest)), "the new version contains errors")]
    return whole._replace(skipped=tuple(each for each in skipped if each.names))


def _errors_in(version: str) -> str:
    return f"`{version}` contains errors"


def _outside(
    options: BreakingOptions, packages: Packages, before: Side, after: Side, revision: Revision
) -> Iterator[Skipped]:
    """Yield the interfaces whose old version, or new version, is not in the repository's files."""
    earlier, present = before.names, after.names
    others = {
        str(name)
        for package in packages
        for file in (entry.file for entry in package.files)
        if (name := ir.TypeName(package.package, file.kind, file.name)) not in earlier
        and not revision.holds(file.path)
    }
    places = (*sorted(others), *revision.unknown(options.paths))
    yield Skipped(places, "the history is in another git repository", _SUBMODULES)
    absent = (own for own in before.interfaces if own.name not in present)
    hidden = [own for own in absent if own.source and revision.is_skipped(own.source.path)]
    names = tuple(sorted(str(own.name) for own in hidden))
    yield Skipped(names, "this sparse checkout omits the new version", _CHECK_OUT)


def _before(
    options: BreakingOptions, packages: Packages, revision: Revision | None, report: Report
) -> Side:
    scope = options.scope
    skipped: Sequence[Skipped] = ()
    problems = Report()
    if revision is None:
        files = find.find([options.against], scope.root, report, scope.exclude)
        old = inputs.packages(files, scope, problems)
    else:
        files = revision.files(options.paths, scope.exclude, report)
        include = tuple(revision.counterpart(path) or path for path in scope.include)
        scope = msgspec.structs.replace(
            scope, include=include, exclude=scope.exclude.seen_from(revision.folder, revision.top)
        )
        old = inputs.packages(files, scope, problems)
        moved, skipped = _moved(packages, old, revision, options)
        if moved:
            files += moved
            problems = Report()
            old = inputs.packages(files, scope, problems)
    if len(old) == len(packages) == 1 and old[0].package != packages[0].package:
        # two single packages get one name, unless both are named by a package.xml
        folders = [package.folders[0] for package in (*old, *packages) if package.folders]
        if not all(map(scope.root.manifest, folders)):
            named = msgspec.structs.replace(scope, package=packages[0].package)
            old = inputs.packages(files, named, problems)
    report.extend(problem for problem in problems if problem.code in codes.USAGE)
    if any(problem.code in codes.USAGE for problem in report):
        raise ReportedError
    homes = (
        {package.home: files for package in old} if scope.package else by_home(files, scope.root)
    )
    if revision is None:
        beside = tuple(_beside(packages, old, scope))
        scope = msgspec.structs.replace(scope, include=(*beside, *scope.include))
    again = Report()
    again.extend(problems)
    side = _side(old, homes, scope, problems)
    if revision and side.broken:  # a package that they use may have moved
        include = (*scope.include, revision.folder.as_posix())
        side = _side(old, homes, msgspec.structs.replace(scope, include=include), again)
    return side._replace(skipped=tuple(skipped))


def _moved(
    packages: Packages, old: Packages, revision: Revision, options: BreakingOptions
) -> tuple[tuple[find.InterfaceFile, ...], list[Skipped]]:
    """Return files of packages that were outside of the paths, and interfaces without a history.

    Packages are found by their names. If several had the name, the one that is gone has moved.
    """
    scope = options.scope
    known = {name for package in old for name in package.names}
    missing = {each.package: each.names - known for each in packages if each.names - known}
    if not missing:
        return (), []
    top = revision.top.as_posix()
    candidates = _candidates(revision, scope)
    present = {package.package for package in old}
    submodules = {*revision.unknown([top])}.difference(revision.unknown(options.paths))
    moved: list[find.InterfaceFile] = []
    skipped: list[Skipped] = []
    for package in packages:
        names = missing.get(package.package)
        if names is None:
            continue
        places = candidates.get(package.package, [])
        if len(places) > 1:
            gone = [each for each in places if not revision.is_present(each[0].home)]
            places = gone if len(gone) == 1 else places
        listed = tuple(map(str, sorted(names)))
        if len(places) > 1:
            folders = " and ".join(f"`{revision.shown(each.home)}`" for each, _ in places)
            skipped.append(Skipped(listed, f"package `{package.package}` is in {folders}"))
        elif places:
            (earlier, files), parts = places[0], set[Path]()
            if package.package not in present:
                parts = _parts(package, scope.root)
            moved += _moved_files(files, names, [earlier.home / part for part in parts])
        elif submodules:
            gone_from = first_few((f"`{each}`" for each in sorted(submodules)), NAMED)
            reason = f"the earlier version may be in the submodule {gone_from}"
            skipped.append(Skipped(listed, reason))
    return tuple(moved), skipped


def _candidates(
    revision: Revision, scope: Scope
) -> Mapping[str, list[tuple[Inputs, Sequence[find.InterfaceFile]]]]:
    """Return the packages of a whole revision by name, with their files."""
    files = revision.files([revision.top.as_posix()], scope.exclude, Report())
    unnamed = msgspec.structs.replace(scope, package=None)
    candidates: dict[str, list[tuple[Inputs, Sequence[find.InterfaceFile]]]] = {}
    for group in by_home(files, scope.root).values():
        for package in inputs.packages(group, unnamed, Report()):
            candidates.setdefault(package.package, []).append((package, group))
    return candidates


def _moved_files(
    files: Iterable[find.InterfaceFile], names: AbstractSet[ir.TypeName], parts: Collection[Path]
) -> Iterator[find.InterfaceFile]:
    """Yield the files with these interfaces, and all files in these parts of the package."""
    for file in files:
        package = next(iter(names)).package
        is_missing = ir.TypeName(package, file.kind, file.name) in names
        if is_missing or any(file.path.is_relative_to(part) for part in parts):
            yield file


def _parts(package: Inputs, root: Root) -> set[Path]:
    """Return the parts of a package that arguments mean, relative to its folder."""
    arguments = {root.absolute(entry.file.argument) for entry in package.files}
    return {
        argument.relative_to(package.home) if argument.is_relative_to(package.home) else Path()
        for argument in arguments
    }


def _beside(packages: Packages, old: Packages, scope: Scope) -> Iterator[str]:
    """Yield folders of the old version that stand for the folders of -I in the new version."""
    homes = {package.package: package.home for package in packages}
    for home, new in ((each.home, homes.get(each.package)) for each in old):
        siblings = entries(home.parent) if scope.include else []
        yield from (entry.as_posix() for entry in siblings if entry != home and _is_package(entry))
        for folder in scope.include if new else ():
            with suppress(ValueError):  # another drive
                place = home / os.path.relpath(scope.root.absolute(folder), new)
                if is_folder(place):
                    yield os.path.normpath(place)


def _is_package(folder: Path) -> bool:
    return is_file(folder / MANIFEST) or any(is_folder(folder / kind) for kind in find.KIND_FOLDERS)


def _newer_scope(options: BreakingOptions) -> Scope:
    """Return the scope in which dependencies near the old version come last."""
    scope = options.scope
    old = scope.root.absolute(options.against)
    new = [scope.root.absolute(path) for path in options.paths]

    def is_older(folder: str) -> bool:
        place = scope.root.absolute(folder)
        return _common(place, old) > max((_common(place, path) for path in new), default=0)

    return msgspec.structs.replace(scope, include=tuple(sorted(scope.include, key=is_older)))


def _common(path: Path, other: Path) -> int:
    """Return the number of the first parts that two paths have in common."""
    return len(Path(os.path.commonpath((path, other))).parts) if path.drive == other.drive else 0


def _side(
    packages: Packages,
    files: Mapping[Path, Sequence[find.InterfaceFile]],
    scope: Scope,
    report: Report,
) -> Side:
    """Compile one version; `files` are all files by package, including unread ones."""
    compiled = {
        ir.TypeName(package.package, entry.file.kind, entry.file.name): entry.file.shown
        for package in packages
        for entry in package.files
    }
    every = {
        file.shown: ir.TypeName(package.package, file.kind, file.name)
        for package in packages
        for file in files.get(package.home, ())
    }
    # a type that is defined twice is ambiguous
    also = {shown: compiled[name] for shown, name in every.items() if name in compiled}
    pairs = list(models_of(packages, scope, report))
    report.extend(oversized(*without_errors(pairs, report, also)))
    models = list(without_errors(pairs, report, also))
    names = {*compiled, *every.values()}
    sound = {own.name for model in models for own in model.own}
    error = ""
    if first := next(iter(report.errors), None):
        line = first.span.source.position(first.span.start)[0] if first.span else 1
        error = f"the first error is {first.code} at {first.where[0]}:{line}: {first.message}"
    return Side({model.package: model for model in models}, frozenset(names - sound), error)


def error_free_models(packages: Packages, scope: Scope, report: Report) -> dict[str, Model]:
    """Return the packages' models; reports errors only, warnings are reported by `check`."""
    problems = Report()
    models = {model.package: model for _, model in models_of(packages, scope, problems)}
    report_oversized(models.values(), problems)
    report.extend(problems.errors)
    return models


def _compare_with_lock(options: BreakingOptions, packages: Packages, report: Report) -> Comparison:
    folder = options.against.removesuffix(lock.FILE).rstrip("/") or "."
    record = load_lock(options.scope.root.absolute(folder), folder, report)
    if record is None:
        report.raise_errors()
        message = f"no such file: `{options.against}`"
        raise report.refused(codes.NO_SUCH_PATH.of(options.against, message))
    mine = [package for package in packages if package.package == record.package]
    if len(packages) == 1 and not mine:
        named = msgspec.structs.replace(options.scope, package=record.package)
        files = find.find(options.paths, named.root, report, named.exclude)
        mine = list(inputs.packages(files, named, report))
    others = [package for package in packages if len(packages) > 1 and package not in mine]
    models = error_free_models([*mine, *others], options.scope, report)
    if not record.types:
        hint = "`idlc gen` writes a lock with the type hashes"
        report_nothing(options, "the lock has no type hashes", hint, report)
    report.raise_errors()
    model = models.get(record.package) or Model(record.package, (), {})
    same = bool(mine) and mine[0].digests == record.inputs
    with stage("compare", options.against):
        comparison = compare_hashes(record.types, model)
        new = [compare(Model(each.package, (), {}), models[each.package]) for each in others]
        whole = combine([comparison, *new])
        return whole._replace(differs=whole.differs or not same)


def _version(packages: Packages, root: Root, report: Report) -> str | None:
    """Return the version in the package.xml if there is one package only."""
    if len(packages) != 1 or not packages[0].folders:
        return None
    path = root.manifest(packages[0].folders[0])
    statements = read_statements(path, path.as_posix(), root, report) if path else ()
    return next((statement.text for statement in statements if statement.tag == "version"), None)


class Baseline:
    """The version that settings name: a git revision, or a folder; empty for any other.

    It is compiled on demand, and again when the name refers to another commit.
    """

    def __init__(self, folder: Path, wished: str, settings: Config, scope: Scope) -> None:
        ignored = Report()  # `idlc breaking` reports problems of its table
        name = wished or against(settings, ignored) or ""
        version = read_version(name, scope.root)
        self._revision = version.name if version.meaning == "revision" else None
        comparable = self._revision or (bool(name) and is_folder(folder / name))
        self._folder = folder
        self.name = name if comparable else ""
        self._options = BreakingOptions((), self.name, scope, allowed=allowances(settings, ignored))
        self.commit: str | None = None
        self._side: Side | None = None

    def side(self, packages: Packages) -> Side:
        """Return the packages as they were then, or the error if that cannot be read."""
        if self.has_moved() or self._side is None:
            report = Report()
            paths = tuple(package.home.as_posix() for package in packages)
            # open texts are for the version that is compared with this one
            scope = self._options.scope
            scope = msgspec.structs.replace(scope, root=scope.root.on_disk())
            options = msgspec.structs.replace(self._options, paths=paths, scope=scope)
            side = None
            with suppress(ReportedError):
                if paths and self._revision:
                    with checked_out(self._revision, paths[0], scope.root, report) as revision:
                        side = _before(options, packages, revision, report)
                elif paths and self.name:
                    side = _before(options, packages, None, report)
            why = next((problem.message for problem in report.errors), "")
            self._side = side or Side({}, frozenset(), why)
        return self._side

    def follow(self, older: Baseline | None) -> None:
        """Take over the commit that the name referred to before the folder was read again."""
        if older is not None and older.name == self.name:
            self.commit = older.commit

    def has_moved(self) -> bool:
        """Return whether the name refers to another commit than at the last call."""
        if not self._revision:
            return False
        before, self.commit = self.commit, git.commit(self._revision, self._folder) or ""
        if before == self.commit:
            return False
        self._side = None
        return before is not None

    def not_allowed(self, changes: Sequence[Change]) -> tuple[Change, ...]:
        """Return the changes that the settings do not allow."""
        today = datetime.datetime.now().astimezone().date().isoformat()
        return not_allowed(changes, msgspec.structs.replace(self._options, today=today), Report())
