"""One package of `idlc gen`: rendered, compared with the files on disk, ready to be written."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from msgspec import UNSET

from idlc.compiler.compiler import derived_names, stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.generate.target import Target
from idlc.model import derive, ir
from idlc.model.distros import Distro
from idlc.model.ir import TypeName
from idlc.model.link import Model
from idlc.project import lock, write
from idlc.project.library import Library
from idlc.project.lock import BUILD_STEP, COPY_HEAD, FILE, Lock, Tree, Vendoring
from idlc.project.step import digest, meaning
from idlc.project.write import WritePlan
from idlc.version import __version__

#: A requirement of numpy, which arrays of a fixed size need.
NUMPY = re.compile(r"\s*numpy(?![\w.-])", re.IGNORECASE)


class PlannedPackage(NamedTuple):
    """A package ready to be written."""

    target: Target
    plan: WritePlan
    lock: lock.Lock


def as_inputs(names: Iterable[ir.TypeName], library: Library) -> dict[str, str]:
    """Return the digests of a library's interfaces, keyed like input files in a lock."""
    digests = dependencies(names, library)
    return {name.file: digests[str(name)] for name in names}


def package_of(
    model: Model,
    target: Target,
    digests: dict[str, str],
    library: Library,
    *,
    vendoring: lock.Vendoring = "",
    copies: Sequence[Model] = (),
    beside: Sequence[str] = (),
) -> PlannedPackage | None:
    """Return a sound model rendered and compared with the files on disk.

    `copies` are models of other packages' types that are written into it, `beside` the packages
    that are written beside it.
    """
    from idlc.generate.python.imports import ALONE, VENDORING
    from idlc.generate.python.render import carried_runtime, installed_runtime, render_package
    from idlc.generate.python.vendored import vendored_files
    from idlc.wire.layout import oversized

    refused = list(oversized(model))
    if refused:
        target.report.extend(refused)
        return None
    with stage("render", model.package):
        runtime = (
            carried_runtime() if target.runtime == "carried" else installed_runtime(model.package)
        )
        surroundings = VENDORING if copies else ALONE
        if target.enums:
            surroundings = surroundings._replace(enums="all")
        rendered = (
            *render_package(model, surroundings, runtime),
            *vendored_files(model.package, copies),
        )
        modules = {file.path: file.text.encode() for file in rendered}
        files = target.placed(model, modules)
    plan = target.plan(files)
    if plan is None:
        return None
    own = {
        ir.TypeName(model.package, n.kind, n.name) for n in model.interfaces if n.file in digests
    }
    others = {name for each in (model, *copies) for name in each.interfaces if name not in own}
    references = {name for interface in model.own for name in derive.references(interface)}
    imports = {f"{n.package}.{n.kind}" for n in references if n.package != model.package}
    return PlannedPackage(
        target,
        plan,
        lock.Lock(
            format=lock.FORMAT,
            idlc=__version__,
            package=model.package,
            runtime=target.runtime,
            vendor_deps=bool(vendoring),
            enums=target.enums,
            converts_values=model.distro.converts_values or UNSET,
            vendored=tuple(beside),
            imports=() if copies else tuple(sorted(imports)),
            inputs=digests,
            dependencies=dependencies(others, library),
            types={n: model.describer.hash(n) for own in model.own for n in derived_names(own)},
            outputs=plan.outputs,
        ),
    )


class Generated(NamedTuple):
    """The outcome of `idlc gen` for one package.

    `files` is the number of all its files; `needs` are packages that it imports
    and that are not installed.
    """

    package: str
    out: str
    interfaces: int
    files: int
    runtime: lock.Runtime
    written: int = 0
    removed: int = 0
    needs: tuple[str, ...] = ()

    @property
    def changes(self) -> str:
        """The numbers of written and removed files, in words."""
        numbers = {"written": self.written, "removed": self.removed}
        done = (f"{number} {what}" for what, number in numbers.items() if number)
        return ", ".join(done) or "unchanged"


def generated(package: PlannedPackage) -> Generated:
    """Return the outcome for a package that is ready to be written."""
    removed = sum(change.new is None for change in package.plan.changes)
    written = len(package.plan.changes) - removed
    target = package.target
    return _outcome(target, package.lock)._replace(written=written, removed=removed)


def _outcome(target: Target, record: lock.Lock) -> Generated:
    counts = len(record.inputs), len(record.outputs)
    return Generated(target.package, target.name, *counts, record.runtime)


def up_to_date(
    target: Target, digests: dict[str, str], library: Library, vendoring: lock.Vendoring
) -> tuple[Generated, ...]:
    """Return the packages if a run would change nothing; empty otherwise."""
    if not unchanged(target, digests, library, vendoring) or target.lock is None:
        return ()
    folders = [target]
    for package in target.lock.vendored:
        folders.append(target.beside(package))
        names = library.interfaces(package)
        if not unchanged(folders[-1], as_inputs(names, library), library):
            return ()
    return tuple(_outcome(folder, folder.lock) for folder in folders if folder.lock)


def with_needs(
    done: Iterable[Generated], targets: Iterable[Target], distro: Distro, report: Report, again: str
) -> tuple[Generated, ...]:
    """Report IDL617 for generated packages that need others that cannot be imported here.

    Where nodes do not run, these are only in `needs` of the result.
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
                "which copies the used types into this package",
            )
        )
    return tuple(package._replace(needs=quiet.get(package.out, ())) for package in done)


_PACKAGE = Path(__file__).parents[1]
#: The sources of idlc that affect the output: a change counts although the version stays.
_ROOMS = (
    *("build", "compiler", "diagnostics", "generate", "language", "model"),
    *("project", "runtime", "tasks", "wire"),
)
_MAKERS = (
    *(_PACKAGE / room for room in _ROOMS),
    _PACKAGE / "templates",
    _PACKAGE.parent / "templates",
)


def unchanged(
    target: Target, inputs: Mapping[str, str], library: Library, vendoring: Vendoring = ""
) -> bool:
    """Return whether compiling the inputs would change nothing in a package's folder.

    `inputs` are the digests of the input files by name within the package. In a prefix they
    do not show it: libraries depend on the installed distribution, too.
    """
    lock = None if target.home else target.lock
    is_unchanged = (
        lock is not None
        and (lock.idlc, lock.package) == (__version__, target.package)
        and lock.runtime == target.runtime
        and lock.enums == target.enums
        and lock.vendors_as(vendoring)
        and bool(lock.converts_values) == library.distro.converts_values
        and lock.inputs == inputs
        and _outputs_stand(target.path, lock)
        and target.step.keys() == lock.outputs.keys() & {BUILD_STEP}
        and _carries_this_runtime(lock)
        and _newest_maker() <= (target.path / FILE).stat().st_mtime_ns
        and all(_dependency(name, library) == old for name, old in lock.dependencies.items())
    )
    if is_unchanged:
        write.sweep(target.path)
    return is_unchanged


def dependencies(names: Iterable[TypeName], library: Library) -> dict[str, str]:
    """Return the digests by which interfaces of other packages are recorded."""
    return {str(name): _dependency(str(name), library) for name in names}


def _dependency(name: str, library: Library) -> str:
    try:
        parsed = TypeName.parse(name)
    except ValueError:
        return ""
    source = library.source(parsed)
    return meaning(source.text, parsed.package) if source else ""


def _outputs_stand(out: Path, lock: Lock) -> bool:
    tree = Tree(out)
    contents = ((tree.read(path), expected) for path, expected in lock.outputs.items())
    return all(
        isinstance(content, bytes) and digest(content) == expected for content, expected in contents
    )


def _carries_this_runtime(lock: Lock) -> bool:
    """Return whether the copy of the runtime is this idlc's, or there is none.

    Its version does not say so: those of two builds between two releases are equal.
    """
    copy = {
        path.rpartition("_idlc/")[2]: content
        for path, content in lock.outputs.items()
        if "/_idlc/" in f"/{path}"
    }
    return not copy or copy == _runtime()


@lru_cache(maxsize=1)
def _runtime() -> dict[str, str]:
    runtime = _PACKAGE / "runtime"
    return {
        path.relative_to(runtime).as_posix(): digest(COPY_HEAD.encode() + path.read_bytes())
        for path in runtime.rglob("*.py")
    }


@lru_cache(maxsize=1)
def _newest_maker() -> int:
    """Return the time at which idlc was last changed: by a developer, or installed."""
    files = (path for folder in _MAKERS for path in folder.rglob("*.*") if path.suffix != ".pyc")
    return max(path.stat().st_mtime_ns for path in files)
