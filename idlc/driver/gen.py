"""The pipeline of `idlc gen`: compile, render, compare with what is on disk, write."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from symtable import symtable
from typing import TYPE_CHECKING, NamedTuple

from idlc import __version__
from idlc.disk import inputs, lock
from idlc.disk.find import find
from idlc.disk.fresh import dependencies
from idlc.disk.library import Library
from idlc.disk.plan import Plan
from idlc.disk.target import Target
from idlc.driver.stages import compile_package, derived_names, sources_of, stage
from idlc.model import derive, ir
from idlc.text import codes
from idlc.text.diagnostics import Report, Severity

if TYPE_CHECKING:
    from idlc.model.link import Model


class GenOptions(NamedTuple):
    """What `idlc gen` was asked to do."""

    paths: tuple[str, ...]
    out: str
    package: str | None = None
    include: tuple[str, ...] = ()
    check: bool = False
    vendor_deps: bool = False
    force: bool = False


class Generated(NamedTuple):
    """What a run of `idlc gen` did to one package. `files` counts all that it consists of."""

    package: str
    out: str
    interfaces: int
    files: int
    written: int = 0
    removed: int = 0


class Package(NamedTuple):
    """A package ready to be written."""

    target: Target
    plan: Plan
    lock: lock.Lock


def gen(options: GenOptions, report: Report) -> tuple[Generated, ...]:
    """Write, or with `check` compare, a package and what it vendors; empty after an error."""
    files = find(options.paths, report)
    given = inputs.one_package(files, options.package, options.out, report)
    if given is None:
        return ()
    target = Target(options.out, given.package, report, force=options.force)
    if not target.usable():
        return ()
    with target.alone(beside=options.vendor_deps):
        return _made(target, given, options, report)


def _made(
    target: Target, given: inputs.Inputs, options: GenOptions, report: Report
) -> tuple[Generated, ...]:
    library = Library(options.include, report, own=given.own)
    if not (options.check or report.had_errors):
        current = _current(target, given.digests, library, options.vendor_deps)
        if current:
            _note_missing(target, report)
            return current
    model = compile_package(given.package, sources_of(given, report), library, report)
    packages = [] if report.had_errors else _planned(model, target, given, library, options)
    if options.check:
        for one in packages:
            one.target.drift(one.plan, one.lock)
    elif not all(one.target.apply(one.plan, one.lock) for one in packages):
        return ()
    if packages:
        _note_missing(target, report)
    return tuple(_generated(one) for one in packages)


def _planned(
    model: Model, target: Target, given: inputs.Inputs, library: Library, options: GenOptions
) -> list[Package]:
    """Return a sound model, and what it vendors, ready to be written; empty if any must not be."""
    vendored = _vendored(model, target, library, options) if options.vendor_deps else []
    own = _package(model, target, given.digests, library, options, vendored)
    found = [own, *vendored]
    return [] if None in found else [one for one in found if one]


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
        if not found[-1].unchanged(_as_inputs(names, library), library):
            return ()
    return tuple(
        Generated(one.package, one.name, len(one.lock.inputs), len(one.lock.outputs))
        for one in found
        if one.lock
    )


def _as_inputs(names: Iterable[ir.TypeName], library: Library) -> dict[str, str]:
    """Return the digests of a library's interfaces as those of input files are recorded."""
    digests = dependencies(names, library)
    return {f"{n.kind}/{n.name}.{n.kind}": digests[str(n)] for n in names}


def _package(
    model: Model,
    target: Target,
    digests: dict[str, str],
    library: Library,
    options: GenOptions,
    vendored: Sequence[Package | None] | None = None,
) -> Package | None:
    """Return a sound model rendered and compared with what is on disk."""
    from idlc.emit.limits import oversized
    from idlc.emit.render import render_package

    refused = list(oversized(model))
    if refused:
        target.report.extend(refused)
        return None
    with stage("render", model.package):
        files = {file.path: file.text for file in render_package(model)}
    plan = target.plan(files, check=options.check)
    if plan is None:
        return None
    _check_syntax(plan, target)
    others = [n for n in model.interfaces if f"{n.kind}/{n.name}.{n.kind}" not in digests]
    return Package(
        target,
        plan,
        lock.Lock(
            idlc=__version__,
            package=model.package,
            vendor_deps=options.vendor_deps and vendored is not None,
            vendored=tuple(one.target.package for one in vendored or () if one),
            imports=_imports(model),
            inputs=digests,
            dependencies=dependencies(others, library),
            types={n: model.describer.hash(n) for own in model.own for n in derived_names(own)},
            outputs=plan.outputs,
        ),
    )


def _check_syntax(plan: Plan, target: Target) -> None:
    """Fail on rendered code that Python cannot read, which would be idlc's own fault.

    Only text from an interface file can have that effect, and text that could has a backslash in
    front of it; modules without one are like those that the tests read.
    """
    for change in plan.changes:
        rendered = change.path.endswith(".py") and not change.path.startswith("_idlc/")
        if rendered and change.new and b"\\" in change.new:
            with stage("compile", f"{target.name}/{change.path}"):
                # parses, and resolves names, without the cost of making bytecode
                symtable(change.new.decode("utf-8"), change.path, "exec")


def _imports(model: Model) -> tuple[str, ...]:
    """Return the modules of other packages that the package's own files refer to."""
    targets = {
        element.target
        for own in model.own
        for part in derive.sections(own)
        for field in part.fields
        if isinstance(element := ir.element_of(field.type), ir.Ref)
    }
    return tuple(sorted({f"{t.package}.{t.kind}" for t in targets if t.package != model.package}))


def _vendored(
    model: Model, target: Target, library: Library, options: GenOptions
) -> list[Package | None]:
    """Return every package that a model depends on, whole, to be written beside it."""
    found: dict[str, Package | None] = {}
    waiting = _needed(model)
    while waiting := waiting - found.keys() - {model.package}:
        package = min(waiting)
        names = library.interfaces(package)
        sources = [(name, source) for name in names if (source := library.source(name))]
        report = Report()
        whole = compile_package(package, sources, library, report)
        target.report.extend(one for one in report if one.severity is Severity.ERROR)
        digests = _as_inputs(names, library)
        beside = target.beside(package)
        if report.had_errors:
            return [None]
        found[package] = _package(whole, beside, digests, library, options)
        waiting |= _needed(whole)
    return [found[package] for package in sorted(found)]


def _needed(model: Model) -> set[str]:
    """Return the packages that a model's generated code may import, its own included."""
    implied = {package for own in model.own for package in derive.IMPLICIT_PACKAGES[own.name.kind]}
    return implied | {name.package for name in model.interfaces}


def _note_missing(target: Target, report: Report) -> None:
    """Report IDL617 if the generated package needs others that cannot be imported here."""
    missing = target.missing()
    if missing:
        names = ", ".join(f"`{name}`" for name in missing)
        wheels = " ".join(f"ros-jazzy-{name.replace('_', '-')}" for name in missing)
        report.add(
            codes.NOT_IMPORTABLE.of(
                target.name,
                f"`{target.package}` imports {names}, which this Python cannot import",
                hint=f"install it with ROS 2 or `pip install {wheels}`, or run idlc gen again "
                "with --vendor-deps, which writes it beside",
            )
        )


def _generated(one: Package) -> Generated:
    removed = sum(change.new is None for change in one.plan.changes)
    written = len(one.plan.changes) - removed
    target = one.target
    files = len(one.plan.outputs)
    return Generated(target.package, target.name, len(one.lock.inputs), files, written, removed)
