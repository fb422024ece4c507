"""The packages of a run of `idlc gen` ready to be written, with those that they vendor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from idlc.diagnostics.report import Report, Severity
from idlc.disk.output.folder import Target
from idlc.disk.packages import inputs
from idlc.disk.packages.names import accept_name
from idlc.driver.generate.package import Package, as_inputs, package_of
from idlc.driver.stages import Compiler
from idlc.model import derive

if TYPE_CHECKING:
    from idlc.model.link import Model


def planned(
    models: Sequence[Model],
    wanted: Mapping[Target, inputs.Inputs],
    compiler: Compiler,
    *,
    check: bool,
    vendor_deps: bool,
) -> list[Package]:
    """Return sound models, and what they vendor, ready to be written; empty if any must not be."""
    vendor = _Vendor({model.package for model in models}, compiler, check=check)
    found: list[Package | None] = []
    for model, (target, given) in zip(models, wanted.items(), strict=True):
        names = vendor.add(model, target) if vendor_deps else None
        library = compiler.library
        found.append(package_of(model, target, given.digests, library, check=check, vendored=names))
    found += [vendor.packages[name] for name in sorted(vendor.packages)]
    return [] if None in found else [one for one in found if one]


class _Vendor:
    """The packages that others depend on, whole, to be written beside them."""

    def __init__(self, own: set[str], compiler: Compiler, *, check: bool) -> None:
        self._own = own
        self._compiler = compiler
        self._check = check
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
        return package_of(whole, beside, digests, library, check=self._check)


def _needed(model: Model) -> set[str]:
    """Return the packages that a model's generated code may import, its own included."""
    implied = {package for own in model.own for package in derive.IMPLICIT_PACKAGES[own.name.kind]}
    return implied | {name.package for name in model.interfaces}
