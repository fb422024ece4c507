"""The pipeline of `idlc breaking`: two versions, compiled alike, and what changed between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import msgspec

from idlc.breaking.allow import Allowance, without_allowed
from idlc.breaking.change import LEVELS, Change
from idlc.breaking.packages import (
    Comparison,
    added_package,
    compare,
    compare_hashes,
    removed_package,
    together,
)
from idlc.breaking.version import part_to_raise, raised
from idlc.checks.size import Extents, oversized
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.disk.find import InterfaceFile, find, look, nothing_in
from idlc.disk.output import lock_file
from idlc.disk.packages import inputs
from idlc.disk.packages.enclosing import manifest, statements
from idlc.disk.read import absolute
from idlc.disk.revision import Revision, checked_out, is_revision
from idlc.disk.scope import Scope
from idlc.driver.compare.distribution import compare_with_distro, is_distro
from idlc.driver.stages import models_of, stage
from idlc.model.link import Model

GIT = "git:"


class BreakingOptions(NamedTuple):
    """What `idlc breaking` was asked to do; `today` is a day as YYYY-MM-DD."""

    paths: tuple[str, ...]
    against: str
    scope: Scope = Scope()
    levels: tuple[str, ...] = LEVELS
    allowed: tuple[Allowance, ...] = ()
    allowed_in: str = ""
    today: str = ""


class Verdict(NamedTuple):
    """What came out: how many changes break each level, and the version part to raise.

    `added` breaks nothing. There is no part to raise without a difference, and none for
    a comparison with a distribution.
    """

    levels: dict[str, int]
    allowed: int
    part: str | None
    version: str | None
    next_version: str | None
    added: tuple[str, ...] = ()


def breaking(options: BreakingOptions, report: Report) -> Verdict | None:
    """Report each change that breaks something; `None` if a version could not be compiled."""
    there = look(options.paths, report, options.scope.exclude)
    given = inputs.packages(there.files, options.scope, report)
    comparison = None if report.had_errors else _against(options, given, report)
    if comparison is not None and not comparison.differs:
        # of what was removed, there is something to compare with
        report.extend(nothing_in(one, options.scope.exclude) for one in there.empty)
    if comparison is None or report.had_errors:
        return None
    changes = without_allowed(
        comparison.changes, options.allowed, options.today, options.allowed_in, report
    )
    wanted = [change for change in changes if change.levels & set(options.levels)]
    report.extend(change.diagnostic for change in wanted)
    part = None if is_distro(options.against) else part_to_raise(comparison)
    version = _version(given, report)
    return Verdict(
        {level: sum(level in change.levels for change in wanted) for level in LEVELS},
        len(comparison.changes) - len(changes),
        part,
        version,
        raised(version, part) if version and part else None,
        comparison.additions,
    )


def not_allowed(
    changes: Sequence[Change], options: BreakingOptions, report: Report
) -> tuple[Change, ...]:
    """Return the changes that nobody allowed; allowances may be for other comparisons."""
    found = Report()
    left = without_allowed(changes, options.allowed, options.today, options.allowed_in, found)
    report.extend(one for one in found if one.code != codes.UNUSED_ALLOWANCE.id)
    return left


def _against(
    options: BreakingOptions, given: tuple[inputs.Inputs, ...], report: Report
) -> Comparison | None:
    if is_distro(options.against):
        return compare_with_distro(options.against, given, options.scope, report)
    if options.against.startswith(GIT):
        name = options.against.removeprefix(GIT)
        with checked_out(name, options.paths[0], report) as revision:
            found = revision and _compare(options, given, revision, report)
        return found and found.placed(f"{options.against}:")
    if options.against.endswith(lock_file.FILE):
        return _compare_with_lock(options, given, report)
    if is_revision(options.against, options.paths[0]):
        report.add(
            codes.NO_SUCH_PATH.of(
                options.against,
                f"no such file or folder: `{options.against}`",
                hint=f"the git revision is `--against {GIT}{options.against}`",
            )
        )
        return None
    return _compare(options, given, None, report)


def earlier(
    options: BreakingOptions, given: tuple[inputs.Inputs, ...], report: Report
) -> dict[str, Model]:
    """Return the models of packages as they are in a folder or git revision; empty after errors."""
    if not options.against.startswith(GIT):
        return _before(options, given, None, report)
    with checked_out(options.against.removeprefix(GIT), options.paths[0], report) as revision:
        return _before(options, given, revision, report) if revision else {}


def _compare(
    options: BreakingOptions,
    given: tuple[inputs.Inputs, ...],
    revision: Revision | None,
    report: Report,
) -> Comparison | None:
    before = _before(options, given, revision, report)
    after = sound_ones(given, options.scope, report)
    if report.had_errors:
        return None
    with stage("compare", options.against):
        found = [
            compare(model, after[package]) if package in after else removed_package(model)
            for package, model in before.items()
        ]
        new = (model for package, model in after.items() if package not in before)
        return together([*found, *map(added_package, new)])


def _before(
    options: BreakingOptions,
    given: tuple[inputs.Inputs, ...],
    revision: Revision | None,
    report: Report,
) -> dict[str, Model]:
    scope = options.scope
    if revision is None:
        files = find([options.against], report, scope.exclude)
    else:
        files = revision.files(options.paths, scope.exclude, report)
        include = tuple(revision.counterpart(path) or path for path in scope.include)
        scope = msgspec.structs.replace(
            scope, include=include, exclude=scope.exclude.seen_from(revision.root, revision.top)
        )
    old = _named_alike(inputs.packages(files, scope, report), given, files, scope, report)
    return sound_ones(old, scope, report)


def _named_alike(
    old: tuple[inputs.Inputs, ...],
    new: tuple[inputs.Inputs, ...],
    files: tuple[InterfaceFile, ...],
    scope: Scope,
    report: Report,
) -> tuple[inputs.Inputs, ...]:
    """Give two single packages one name, unless both are named by a package.xml."""
    if len(old) != 1 or len(new) != 1 or old[0].package == new[0].package:
        return old
    if all(manifest(one.folders[0]) for one in (old[0], new[0]) if one.folders):
        return old
    return inputs.packages(files, msgspec.structs.replace(scope, package=new[0].package), report)


def sound_ones(given: Sequence[inputs.Inputs], scope: Scope, report: Report) -> dict[str, Model]:
    """Return the packages' models; only errors are reported, warnings are `check`'s."""
    found = Report()
    models = {model.package: model for _, model in models_of(given, scope, found)}
    if not found.had_errors:
        extents: Extents = {}
        for model in models.values():
            found.extend(oversized(model, extents))
    report.extend(one for one in found if one.severity is codes.ERROR)
    return models


def _compare_with_lock(
    options: BreakingOptions, given: tuple[inputs.Inputs, ...], report: Report
) -> Comparison | None:
    folder = options.against.removesuffix(lock_file.FILE).rstrip("/") or "."
    known = lock_file.load(absolute(folder), folder, report)
    if known is None:
        if not report.had_errors:
            report.add(codes.NO_SUCH_PATH.of(options.against, f"no such file: `{options.against}`"))
        return None
    mine = [one for one in given if one.package == known.package]
    if len(given) == 1 and not mine:
        named = msgspec.structs.replace(options.scope, package=known.package)
        files = find(options.paths, report, named.exclude)
        mine = list(inputs.packages(files, named, report))
    models = sound_ones(mine, options.scope, report)
    if report.had_errors:
        return None
    model = models.get(known.package) or Model(known.package, (), {})
    same = bool(mine) and mine[0].digests == known.inputs
    with stage("compare", options.against):
        found = compare_hashes(known.types, model)
        return found._replace(differs=found.differs or not same)


def _version(given: tuple[inputs.Inputs, ...], report: Report) -> str | None:
    """Return the version in the package.xml if there is one package only."""
    if len(given) != 1 or not given[0].folders:
        return None
    path = manifest(given[0].folders[0])
    found = statements(path, path.as_posix(), report) if path else ()
    return next((one.text for one in found if one.tag == "version"), None)
