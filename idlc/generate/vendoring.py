"""The packages of a run with what they need of others: copies in them, or packages beside them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from idlc.check.compiler import Compiler
from idlc.diagnostics.report import Report
from idlc.generate.package import Package, as_inputs, package_of
from idlc.generate.target import Target
from idlc.model import derive
from idlc.project import inputs
from idlc.project.inputs import accept_name
from idlc.project.lock import Vendoring
from idlc.project.write import Plan

if TYPE_CHECKING:
    from idlc.model.link import Model


def planned(
    models: Sequence[Model],
    requested: Mapping[Target, inputs.Inputs],
    compiler: Compiler,
    *,
    check: bool,
    vendoring: Vendoring,
) -> list[Package]:
    """Return sound models, and packages to vendor, ready to be written; empty after an error."""
    beside = _Beside({model.package for model in models}, compiler, check=check)
    packages: list[Package | None] = []
    for model, (target, package) in zip(models, requested.items(), strict=True):
        packages.append(
            package_of(
                model,
                target,
                package.digests,
                compiler.library,
                check=check,
                vendoring=vendoring,
                copies=_copies(model, compiler, target.report) if vendoring == "private" else (),
                beside=beside.add(model, target) if vendoring == "beside" else (),
            )
        )
    packages += [beside.packages[name] for name in sorted(beside.packages)]
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


class _Beside:
    """The packages that others depend on, whole, to be written beside them."""

    def __init__(self, own: set[str], compiler: Compiler, *, check: bool) -> None:
        self._own = own
        self._compiler = compiler
        self._check = check
        self._needed: dict[str, set[str]] = {}
        #: Each ready to be written, `None` for one that must not be.
        self.packages: dict[str, Package | None] = {}

    def add(self, model: Model, target: Target) -> list[str]:
        """Add the packages that a model depends on, and return their names."""
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
        target.report.extend(report.errors)
        self._needed[package] = _needed(whole)
        if not accept_name(package, "what is depended on", target.report) or report.had_errors:
            return None
        beside, digests = target.beside(package), as_inputs(names, library)
        return package_of(whole, beside, digests, library, check=self._check)


def _needed(model: Model) -> set[str]:
    """Return the packages that a model's generated code may import, its own included."""
    implied = {package for own in model.own for package in derive.IMPLICIT_PACKAGES[own.name.kind]}
    return implied | {name.package for name in model.interfaces}


def leftovers(packages: Iterable[Package]) -> Iterator[tuple[Target, Plan | None]]:
    """Yield packages that earlier runs wrote beside these, with the plans that remove them.

    Those that another package beside them imports are left out. A plan is `None` if files must not
    be removed.
    """
    for package in packages:
        old = package.target.lock
        names = {*(old.vendored if old else ())} - {*package.lock.vendored}
        if not names or package.target.modules:  # a prefix is for any packages
            continue
        locks = {**package.target.locks_beside(), package.target.package: package.lock}
        used = [name for name in locks if name not in names]
        while used:
            record = locks.get(used.pop())
            needed = {name.partition(".")[0] for name in record.imports} if record else set()
            used += needed & names
            names -= needed
        for name in sorted(names & locks.keys()):
            beside = package.target.beside(name)
            package.target.report.notes.append(
                f"`{beside.name}` is removed: what `{package.target.package}` uses of it is in "
                f"`{package.target.name}` now"
            )
            yield beside, beside.plan({})
