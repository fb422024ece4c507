"""The pipeline of `idlc gen`: compile, render, compare with what is on disk, write."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from idlc.diagnostics.report import Report
from idlc.disk import inputs
from idlc.disk.find import is_path
from idlc.disk.output.folder import Target
from idlc.disk.requested import borrowed, completed, targets, wanted
from idlc.disk.scope import Scope
from idlc.driver import named_types
from idlc.driver.gen_result import Generated, generated, up_to_date, with_needs
from idlc.driver.gen_vendored import planned
from idlc.driver.stages import Compiler, library_for
from idlc.model import ir


class GenOptions(NamedTuple):
    """What `idlc gen` was asked to do."""

    paths: tuple[str, ...]
    out: str
    scope: Scope = Scope()
    check: bool = False
    vendor_deps: bool = False
    force: bool = False


def gen(options: GenOptions, report: Report) -> tuple[Generated, ...]:
    """Write, or with `check` compare, packages and what they vendor; empty after an error."""
    paths = [word for word in options.paths if not _is_name(word)]
    named = _named([word for word in options.paths if _is_name(word)], options.scope, report)
    if report.had_errors:
        return ()
    given = wanted(paths, named, options.out, options.scope, report)
    found = targets(given, options.out, report, force=options.force) if given else ()
    if not found:
        return ()
    with found[0].alone(beside=options.vendor_deps or len(found) > 1):
        return _made(dict(zip(found, given, strict=True)), options, report)


def _is_name(word: str) -> bool:
    """Return whether a word means a type, or a package, rather than a path that is not there."""
    last = word.rpartition("/")[2]
    return not is_path(word) and ("/" not in word or not last[:1].islower())


def _named(words: Sequence[str], scope: Scope, report: Report) -> list[inputs.Inputs]:
    """Return the packages that names mean, with those of their interfaces that are meant."""
    chosen: dict[str, set[ir.TypeName]] = {}
    found = []
    for word in words:
        library, meant = named_types.resolve(word, scope.include, report)
        for one in meant:
            chosen.setdefault(one.interface.package, set()).add(one.interface)
        found += [(library, package) for package in {one.interface.package for one in meant}]
    libraries = {package: library for library, package in found}
    return [borrowed(types, libraries[package]) for package, types in sorted(chosen.items())]


def _made(
    wanted: Mapping[Target, inputs.Inputs], options: GenOptions, report: Report
) -> tuple[Generated, ...]:
    library = library_for(tuple(wanted.values()), options.scope, report)
    if not (options.check or report.had_errors):
        current = [
            up_to_date(target, given.digests, library, options.vendor_deps)
            for target, given in wanted.items()
        ]
        if all(current):
            return with_needs([one for done in current for one in done], wanted, report)
    compiler = Compiler(library)
    models = [model for _, model in compiler.all(wanted.values(), report)]
    needed = {name for model in models for name in model.interfaces}
    if not report.had_errors and (more := completed(wanted.values(), needed, library)):
        return _made(dict(zip(wanted, more, strict=True)), options, report)
    packages = []
    if not report.had_errors:
        packages = planned(
            models, wanted, compiler, check=options.check, vendor_deps=options.vendor_deps
        )
    if options.check:
        for one in packages:
            one.target.drift(one.plan, one.lock)
    elif not all(one.target.apply(one.plan, one.lock) for one in packages):
        return ()
    return with_needs(map(generated, packages), wanted if packages else (), report)
