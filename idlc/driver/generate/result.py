"""What a run of `idlc gen` did: to packages that it wrote, and to those that were up to date."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.disk.library import Library
from idlc.disk.output.folder import Target
from idlc.driver.generate.package import Package, as_inputs
from idlc.model.distro import Distro


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


def generated(one: Package) -> Generated:
    """Return what is done to a package that is ready to be written."""
    removed = sum(change.new is None for change in one.plan.changes)
    written = len(one.plan.changes) - removed
    target = one.target
    files = len(one.plan.outputs)
    return Generated(target.package, target.name, len(one.lock.inputs), files, written, removed)


def up_to_date(
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


def with_needs(
    done: Iterable[Generated], targets: Iterable[Target], distro: Distro, report: Report, again: str
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
        report.add(
            codes.DEPENDENCY_NOT_IMPORTABLE.of(
                target.name,
                f"`{target.package}` imports {names}, which this Python cannot import",
                hint=f"{distro.installing(missing)}, or run `{again} --vendor-deps`, "
                "which writes it next to this one",
            )
        )
    return tuple(one._replace(needs=quiet.get(one.out, ())) for one in done)
