"""The packages of a run with what they need of others: copies in them, or packages beside them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial

from idlc.compiler.compiler import Compiler
from idlc.diagnostics.report import Report
from idlc.generate.package import PlannedPackage, as_inputs, package_of
from idlc.generate.target import Target
from idlc.model import derive
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.inputs import accept_name
from idlc.project.lock import FILE, Vendoring, load_lock
from idlc.project.write import WritePlan


def planned(
    models: Sequence[Model],
    requested: Mapping[Target, inputs.Inputs],
    compiler: Compiler,
    vendoring: Vendoring,
) -> list[PlannedPackage]:
    """Return sound models, and packages to vendor, ready to be written; empty after an error."""
    library = compiler.library
    own = {model.package for model in models}
    #: Each ready to be written, `None` for one that must not be.
    others: dict[str, PlannedPackage | None] = {}
    needed: dict[str, set[str]] = {}

    def needed_by(target: Target, package: str) -> set[str]:
        """Add a whole package to `others`, and return the names of those that it depends on."""
        if package not in others:
            interfaces, report = library.interfaces(package), Report()
            sources = [(name, text) for name in interfaces if (text := library.source(name))]
            whole = compiler.model(package, compiler.add(sources, report), report)
            target.report.extend(report.errors)
            needed[package] = _needed(whole) - own
            others[package] = None
            is_accepted = accept_name(package, "the dependencies", target.report)
            if is_accepted and not report.had_errors:
                place, digests = target.beside(package), as_inputs(interfaces, library)
                others[package] = package_of(whole, place, digests, library)
        return needed[package]

    packages: list[PlannedPackage | None] = []
    for model, (target, package) in zip(models, requested.items(), strict=True):
        beside = set[str]()
        if vendoring == "beside":
            beside = derive.closure(_needed(model) - own, partial(needed_by, target))
        packages.append(
            package_of(
                model,
                target,
                package.digests,
                library,
                vendoring=vendoring,
                copies=_copies(model, compiler, target.report) if vendoring == "private" else (),
                beside=sorted(beside),
            )
        )
    packages += [others[name] for name in sorted(others)]
    return [] if None in packages else [package for package in packages if package]


def _copies(model: Model, compiler: Compiler, report: Report) -> list[Model]:
    """Return models of the other packages' types that a model's generated code may import."""
    names = set(model.interfaces)
    if any(own.name.kind == "action" for own in model.own):
        names |= derive.ACTION_PROTOCOL
    reached = compiler.reached(names).items()
    others = {name: own for name, own in reached if name.package != model.package}
    problems = Report()
    copies = compiler.models(others, problems)
    report.extend(problems.errors)
    return [*copies.values()]


def _needed(model: Model) -> set[str]:
    """Return the packages that a model's generated code may import, its own included."""
    implied = {package for own in model.own for package in derive.IMPLICIT_PACKAGES[own.name.kind]}
    return implied | {name.package for name in model.interfaces}


def leftovers(packages: Iterable[PlannedPackage]) -> Iterator[tuple[Target, WritePlan | None]]:
    """Yield packages that earlier runs wrote beside these, with the plans that remove them.

    Those that another package beside them imports are left out. A plan is `None` if files must not
    be removed.
    """
    for package in packages:
        old = package.target.lock
        names = {*(old.vendored if old else ())} - {*package.lock.vendored}
        if not names or package.target.modules:  # a prefix is for any packages
            continue
        folders = (path.parent for path in package.target.path.parent.glob(f"*/{FILE}"))
        records = ((folder.name, load_lock(folder, "", Report())) for folder in folders)
        locks = {name: record for name, record in records if record}
        locks[package.target.package] = package.lock
        used = [name for name in locks if name not in names]
        while used:
            record = locks.get(used.pop())
            needed = {name.partition(".")[0] for name in record.imports} if record else set()
            used += needed & names
            names -= needed
        for name in sorted(names & locks.keys()):
            beside = package.target.beside(name)
            package.target.report.notes.append(
                f"`{beside.name}` is removed: the types that `{package.target.package}` uses are "
                f"now in `{package.target.name}`"
            )
            yield beside, beside.plan({})
