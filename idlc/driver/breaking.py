"""The pipeline of `idlc breaking`: two versions, compiled alike, and what changed between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from idlc.disk import inputs, lock
from idlc.disk.find import InterfaceFile, find
from idlc.disk.package import manifest
from idlc.disk.read import absolute
from idlc.disk.revision import Revision, checked_out
from idlc.disk.statements import statements
from idlc.driver.stages import models_of, stage
from idlc.emit.limits import Extents, oversized
from idlc.model.changes.allow import Allowance, without_allowed
from idlc.model.changes.change import LEVELS
from idlc.model.changes.packages import (
    Comparison,
    compare,
    compare_hashes,
    removed_package,
    together,
)
from idlc.model.changes.version import part_to_raise, raised
from idlc.text import codes
from idlc.text.diagnostics import Report

if TYPE_CHECKING:
    from idlc.model.link import Model

GIT = "git:"


class BreakingOptions(NamedTuple):
    """What `idlc breaking` was asked to do; `today` is a day as YYYY-MM-DD."""

    paths: tuple[str, ...]
    against: str
    package: str | None = None
    include: tuple[str, ...] = ()
    levels: tuple[str, ...] = LEVELS
    allowed: tuple[Allowance, ...] = ()
    allowed_in: str = ""
    today: str = ""


class Verdict(NamedTuple):
    """What came out: how many changes break each level, and the version part to raise."""

    levels: dict[str, int]
    allowed: int
    part: str | None
    version: str | None
    next_version: str | None


def breaking(options: BreakingOptions, report: Report) -> Verdict | None:
    """Report each change that breaks something; `None` if a version could not be compiled."""
    given = inputs.packages(find(options.paths, report), options.package, report)
    comparison = None if report.had_errors else _against(options, given, report)
    if comparison is None or report.had_errors:
        return None
    changes = without_allowed(
        comparison.changes, options.allowed, options.today, options.allowed_in, report
    )
    wanted = [change for change in changes if change.levels & set(options.levels)]
    report.extend(change.diagnostic for change in wanted)
    part = part_to_raise(comparison)
    version = _version(given, report)
    return Verdict(
        {level: sum(level in change.levels for change in wanted) for level in LEVELS},
        len(comparison.changes) - len(changes),
        part,
        version,
        raised(version, part) if version and part else None,
    )


def _against(
    options: BreakingOptions, given: tuple[inputs.Inputs, ...], report: Report
) -> Comparison | None:
    if options.against.startswith(GIT):
        name = options.against.removeprefix(GIT)
        with checked_out(name, options.paths[0], report) as revision:
            return None if revision is None else _compare(options, given, revision, report)
    if options.against.endswith(lock.FILE):
        return _compare_with_lock(options, given, report)
    return _compare(options, given, None, report)


def _compare(
    options: BreakingOptions,
    given: tuple[inputs.Inputs, ...],
    revision: Revision | None,
    report: Report,
) -> Comparison | None:
    include = list(options.include)
    if revision is None:
        files = find([options.against], report)
    else:
        files = revision.files(options.paths, report)
        include = [revision.counterpart(path) or path for path in include]
    old = _named_alike(inputs.packages(files, options.package, report), given, files, report)
    after = _models(given, options.include, report)
    before = _models(old, include, report)
    if report.had_errors:
        return None
    with stage("compare", options.against):
        return together(
            compare(model, after[package]) if package in after else removed_package(model)
            for package, model in before.items()
        )


def _named_alike(
    old: tuple[inputs.Inputs, ...],
    new: tuple[inputs.Inputs, ...],
    files: tuple[InterfaceFile, ...],
    report: Report,
) -> tuple[inputs.Inputs, ...]:
    """Give two single packages one name, unless both are named by a package.xml."""
    if len(old) != 1 or len(new) != 1 or old[0].package == new[0].package:
        return old
    if all(manifest(one.folders[0]) for one in (old[0], new[0]) if one.folders):
        return old
    return inputs.packages(files, new[0].package, report)


def _models(
    given: Sequence[inputs.Inputs], include: Sequence[str], report: Report
) -> dict[str, Model]:
    """Return the packages' models; only errors are reported, warnings are `check`'s."""
    found = Report()
    models = {model.package: model for model, _ in models_of(given, include, found)}
    if not found.had_errors:
        extents: Extents = {}
        for model in models.values():
            found.extend(oversized(model, extents))
    report.extend(one for one in found if one.severity is codes.ERROR)
    return models


def _compare_with_lock(
    options: BreakingOptions, given: tuple[inputs.Inputs, ...], report: Report
) -> Comparison | None:
    folder = options.against.removesuffix(lock.FILE).rstrip("/") or "."
    known = lock.load(absolute(folder), folder, report)
    if known is None:
        if not report.had_errors:
            report.add(codes.NO_SUCH_PATH.of(options.against, f"no such file: `{options.against}`"))
        return None
    mine = [one for one in given if one.package == known.package]
    if len(given) == 1 and not mine:
        mine = list(inputs.packages(find(options.paths, report), known.package, report))
    models = _models(mine, options.include, report)
    if report.had_errors or known.package not in models:
        return None if report.had_errors else Comparison(())
    with stage("compare", options.against):
        return compare_hashes(known.types, models[known.package])


def _version(given: tuple[inputs.Inputs, ...], report: Report) -> str | None:
    """Return the version in the package.xml if there is one package only."""
    if len(given) != 1 or not given[0].folders:
        return None
    path = manifest(given[0].folders[0])
    said = statements(path, path.as_posix(), report) if path else ()
    return next((one.text for one in said if one.tag == "version"), None)
