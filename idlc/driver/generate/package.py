"""One package of `idlc gen`: rendered, compared with what is on disk, ready to be written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from symtable import symtable
from typing import TYPE_CHECKING, NamedTuple

from msgspec import UNSET

from idlc import __version__
from idlc.disk.library import Library
from idlc.disk.output import lock_file
from idlc.disk.output.folder import Target
from idlc.disk.output.up_to_date import dependencies
from idlc.disk.output.write_plan import Plan
from idlc.driver.stages import derived_names, stage
from idlc.model import derive, ir

if TYPE_CHECKING:
    from idlc.model.link import Model


class Package(NamedTuple):
    """A package ready to be written."""

    target: Target
    plan: Plan
    lock: lock_file.Lock


def _key(name: ir.TypeName) -> str:
    return f"{name.kind}/{name.name}.{name.kind}"


def as_inputs(names: Iterable[ir.TypeName], library: Library) -> dict[str, str]:
    """Return the digests of a library's interfaces as those of input files are recorded."""
    digests = dependencies(names, library)
    return {_key(name): digests[str(name)] for name in names}


def package_of(
    model: Model,
    target: Target,
    digests: dict[str, str],
    library: Library,
    *,
    check: bool,
    vendored: Sequence[str] | None = None,
) -> Package | None:
    """Return a sound model rendered and compared with what is on disk.

    `vendored` are the packages that are written because of it, where that was asked for.
    """
    from idlc.checks.size import oversized
    from idlc.disk.cache import templates as template_cache
    from idlc.emit.render import render_package

    refused = list(oversized(model))
    if refused:
        target.report.extend(refused)
        return None
    template_cache.keep()
    with stage("render", model.package):
        modules = {file.path: file.text for file in render_package(model)}
        files = _with_surroundings(model, modules, target)
    plan = target.plan(files, check=check)
    if plan is None:
        return None
    _check_syntax(plan, target)
    own = {
        ir.TypeName(model.package, n.kind, n.name) for n in model.interfaces if _key(n) in digests
    }
    others = [name for name in model.interfaces if name not in own]
    return Package(
        target,
        plan,
        lock_file.Lock(
            idlc=__version__,
            package=model.package,
            vendor_deps=vendored is not None,
            converts_values=model.distro.converts_values or UNSET,
            vendored=tuple(vendored or ()),
            imports=_imports(model),
            inputs=digests,
            dependencies=dependencies(others, library),
            types={n: model.describer.hash(n) for own in model.own for n in derived_names(own)},
            outputs=plan.outputs,
        ),
    )


def _with_surroundings(
    model: Model, modules: Mapping[str, str], target: Target
) -> dict[str, str | bytes]:
    """Return the files to write: modules, and in a prefix all that ROS 2 looks for there."""
    if not target.modules:  # a package folder
        return {**modules}
    from idlc.driver.generate.overlay import overlaid

    return overlaid(model, modules, target)


def _check_syntax(plan: Plan, target: Target) -> None:
    """Fail on rendered code that Python cannot read, which would be idlc's own fault.

    Only text from an interface file can have that effect, and text that could has a backslash in
    front of it; modules without one are like those that the tests read.
    """
    for change in plan.changes:
        rendered = change.path.endswith(".py") and "/_idlc/" not in f"/{change.path}"
        if rendered and change.new and b"\\" in change.new:
            with stage("compile", f"{target.name}/{change.path}"):
                # parses, and resolves names, without the cost of making bytecode
                symtable(change.new.decode("utf-8"), change.path, "exec")


def _imports(model: Model) -> tuple[str, ...]:
    """Return the modules of other packages that the package's own files refer to."""
    targets = {target for own in model.own for target in derive.references(own)}
    return tuple(sorted({f"{t.package}.{t.kind}" for t in targets if t.package != model.package}))
