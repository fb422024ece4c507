"""The pipeline of `idlc gen`: compile, render, compare with what is on disk, write."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, Severity
from idlc.disk import inputs
from idlc.disk.find import is_path
from idlc.disk.library import Library
from idlc.disk.output.folder import Target
from idlc.disk.output.overlay import Overlay
from idlc.disk.package_names import accept_name
from idlc.disk.requested import borrowed, completed, targets, wanted
from idlc.disk.scope import Scope
from idlc.driver import named_types
from idlc.driver.gen_package import Package, as_inputs, package_of
from idlc.driver.overlay import enter
from idlc.driver.stages import Compiler, library_for
from idlc.model import derive, ir

if TYPE_CHECKING:
    from idlc.model.link import Model


class GenOptions(NamedTuple):
    """What `idlc gen` was asked to do: to write to `out`, into the prefix `ament`, or both."""

    paths: tuple[str, ...]
    out: str = ""
    scope: Scope = Scope()
    check: bool = False
    vendor_deps: bool = False
    force: bool = False
    ament: str = ""


class Generated(NamedTuple):
    """What a run of `idlc gen` did to one package.

    `files` counts all that it consists of; `needs` are packages that it imports
    and that are not here.
    """

    package: str
    out: str
    interfaces: int
    files: int
    written: int = 0
    removed: int = 0
    needs: tuple[str, ...] = ()


def gen(options: GenOptions, report: Report) -> tuple[Generated, ...]:
    """Write, or with `check` compare, packages and what they vendor; empty after an error."""
    runs = [options._replace(ament="")] if options.out else []
    runs += [options] if options.ament else []  # OUT may give the package its name
    done: list[Generated] = []
    for run in runs:
        done += () if report.had_errors else _written(run, report)
    report.notes[:] = dict.fromkeys(report.notes)
    return () if report.had_errors else tuple(done)


def _written(options: GenOptions, report: Report) -> tuple[Generated, ...]:
    paths = [word for word in options.paths if not _is_name(word)]
    words = [word for word in options.paths if _is_name(word)]
    named = _named(words, options.scope, report, whole=bool(options.ament))
    if report.had_errors:
        return ()
    given = wanted(paths, named, options.out, options.scope, report)
    found = _targets(given, options, report) if given else ()
    if not found:
        return ()
    with found[0].alone(beside=options.vendor_deps or len(found) > 1):
        done = _made(dict(zip(found, given, strict=True)), options, report)
        if isinstance(found[0], Overlay) and done and not options.check:
            enter(found[0])
        return done


def _targets(
    given: Sequence[inputs.Inputs], options: GenOptions, report: Report
) -> tuple[Target, ...]:
    """Return the folder that each package is written to."""
    if not options.ament:
        return targets(given, options.out, report, force=options.force)
    prefix = options.ament.rstrip("/") or "/"
    homes = (
        (one.package, one.home if not one.borrowed else next(iter(one.folders), None))
        for one in given
    )
    found = [Overlay(prefix, name, home, report, force=options.force) for name, home in homes]
    return tuple(found) if found[0].usable() else ()


def _is_name(word: str) -> bool:
    """Return whether a word means a type, or a package, rather than a path that is not there."""
    last = word.rpartition("/")[2]
    return not is_path(word) and ("/" not in word or not last[:1].islower())


def _named(
    words: Sequence[str], scope: Scope, report: Report, *, whole: bool
) -> list[inputs.Inputs]:
    """Return the packages that names mean, with those of their interfaces that are meant.

    They are `whole` in a prefix, where they hide those of the same name in others.
    """
    chosen: dict[str, set[ir.TypeName]] = {}
    found = []
    for word in words:
        library, meant = named_types.resolve(word, scope.include, report)
        for one in meant:
            package = one.interface.package
            names = library.interfaces(package) if whole else (one.interface,)
            chosen.setdefault(package, set()).update(names)
        found += [(library, package) for package in {one.interface.package for one in meant}]
    libraries = {package: library for library, package in found}
    return [borrowed(types, libraries[package]) for package, types in sorted(chosen.items())]


def _made(
    wanted: Mapping[Target, inputs.Inputs], options: GenOptions, report: Report
) -> tuple[Generated, ...]:
    library = library_for(tuple(wanted.values()), options.scope, report)
    if not (options.check or report.had_errors):
        current = [
            _current(target, given.digests, library, options.vendor_deps)
            for target, given in wanted.items()
        ]
        if all(current):
            return _with_needs([one for done in current for one in done], wanted, report)
    compiler = Compiler(library)
    models = [model for _, model in compiler.all(wanted.values(), report)]
    needed = {name for model in models for name in model.interfaces}
    if not report.had_errors and (more := completed(wanted.values(), needed, library)):
        return _made(dict(zip(wanted, more, strict=True)), options, report)
    packages = [] if report.had_errors else _planned(models, wanted, compiler, options)
    if options.check:
        for one in packages:
            one.target.drift(one.plan, one.lock)
    elif not all(one.target.apply(one.plan, one.lock) for one in packages):
        return ()
    return _with_needs(map(_generated, packages), wanted if packages else (), report)


def _planned(
    models: Sequence[Model],
    wanted: Mapping[Target, inputs.Inputs],
    compiler: Compiler,
    options: GenOptions,
) -> list[Package]:
    """Return sound models, and what they vendor, ready to be written; empty if any must not be."""
    vendor = _Vendor({model.package for model in models}, compiler, options)
    found: list[Package | None] = []
    for model, (target, given) in zip(models, wanted.items(), strict=True):
        names = vendor.add(model, target) if options.vendor_deps else None
        library, check = compiler.library, options.check
        found.append(package_of(model, target, given.digests, library, check=check, vendored=names))
    found += [vendor.packages[name] for name in sorted(vendor.packages)]
    return [] if None in found else [one for one in found if one]


class _Vendor:
    """The packages that others depend on, whole, to be written beside them."""

    def __init__(self, own: set[str], compiler: Compiler, options: GenOptions) -> None:
        self._own = own
        self._compiler = compiler
        self._options = options
        self._needed: dict[str, set[str]] = {}
        #: Each ready to be written, `None` for one that must not be.
        self.packages: dict[str, Package | None] = {}

    def add(self, model: Model, target: Target) -> list[str]:
        """Add what a model depends on, and return the names."""
        names: set[str] = set()
        waiting = _needed(model) - self._own
        while waiting:
            package = waiting.pop()
            names.add(package)
            if package not in self.packages:
                self.packages[package] = self._whole(package, target)
            waiting |= self._needed[package] - self._own - names
        return sorted(names)

    def _whole(self, package: str, target: Target) -> Package | None:
        library, report = self._compiler.library, Report()
        names = library.interfaces(package)
        sources = [(name, source) for name in names if (source := library.source(name))]
        whole = self._compiler.model(package, self._compiler.add(sources, report), report)
        target.report.extend(one for one in report if one.severity is Severity.ERROR)
        self._needed[package] = _needed(whole)
        if not accept_name(package, "what is depended on", target.report) or report.had_errors:
            return None
        beside, digests = target.beside(package), as_inputs(names, library)
        return package_of(whole, beside, digests, library, check=self._options.check)


def _current(
    target: Target, digests: dict[str, str], library: Library, vendor_deps: bool
) -> tuple[Generated, ...]:
    """Return what there is if a run would change nothing; empty otherwise."""
    if not target.unchanged(digests, library, vendor_deps=vendor_deps) or target.lock is None:
        return ()
    found = [target]
    for package in target.lock.vendored:
        found.append(target.beside(package))
        names = library.interfaces(package)
        if not found[-1].unchanged(as_inputs(names, library), library):
            return ()
    return tuple(
        Generated(one.package, one.name, len(one.lock.inputs), len(one.lock.outputs))
        for one in found
        if one.lock
    )


def _needed(model: Model) -> set[str]:
    """Return the packages that a model's generated code may import, its own included."""
    implied = {package for own in model.own for package in derive.IMPLICIT_PACKAGES[own.name.kind]}
    return implied | {name.package for name in model.interfaces}


def _with_needs(
    done: Iterable[Generated], targets: Iterable[Target], report: Report
) -> tuple[Generated, ...]:
    """Report IDL617 for generated packages that need others that cannot be imported here.

    Where they are not imported anyway, that is only noted in what is returned.
    """
    quiet: dict[str, tuple[str, ...]] = {}
    for target in targets:
        missing = target.missing()
        if not missing:
            continue
        if not target.is_at_home():
            quiet[target.name] = tuple(missing)
            continue
        names = ", ".join(f"`{name}`" for name in missing)
        wheels = " ".join(f"ros-jazzy-{name.replace('_', '-')}" for name in missing)
        report.add(
            codes.NOT_IMPORTABLE.of(
                target.name,
                f"`{target.package}` imports {names}, which this Python cannot import",
                hint=f"install it with ROS 2 or `pip install {wheels}`, or run idlc gen again "
                "with --vendor-deps, which writes it next to this one",
            )
        )
    return tuple(one._replace(needs=quiet.get(one.out, ())) for one in done)


def _generated(one: Package) -> Generated:
    removed = sum(change.new is None for change in one.plan.changes)
    written = len(one.plan.changes) - removed
    target = one.target
    files = len(one.plan.outputs)
    return Generated(target.package, target.name, len(one.lock.inputs), files, written, removed)
