"""The compiler's passes in order, from texts to a checked model.

The passes are imported where they are used, so that a run with nothing to do costs little.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from itertools import groupby
from types import MappingProxyType
from typing import TYPE_CHECKING

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, first_few
from idlc.diagnostics.source import Source
from idlc.model import derive, ir
from idlc.project import inputs
from idlc.project.library import InterfaceTexts, Library
from idlc.project.settings import Scope

if TYPE_CHECKING:
    from idlc.compiler.verdicts import IncrementalFindings
    from idlc.model import link
    from idlc.model.link import Model, Pool


class InternalError(Exception):
    """A failure that is idlc's own fault, with its stage and subject."""


def internal_error(error: Exception, subject: str, hint: str) -> Diagnostic:
    """Return an unexpected exception as a problem, of `subject` if it does not have one."""
    cause, where = error, ""
    if isinstance(error, InternalError):
        name, subject = error.args
        where = f" in stage `{name}`"
        cause = error.__cause__ if isinstance(error.__cause__, Exception) else error
    message = f"idlc failed{where}: {type(cause).__name__}: {cause}"
    return codes.INTERNAL_ERROR.of(subject, message, hint=hint)


@contextmanager
def stage(name: str, subject: str) -> Iterator[None]:
    """Turn any exception inside into an InternalError with the stage and subject."""
    try:
        yield
    except InternalError:
        raise
    except Exception as error:
        raise InternalError(name, subject) from error


class Compiler:
    """Compiles the packages of one run; files that several of them use are lowered once.

    Runs that share a library, a `memory` of lowered files and the findings in `checked` repeat
    only the work on changed files.
    """

    def __init__(
        self,
        library: Library,
        memory: link.Memory | None = None,
        checked: IncrementalFindings | None = None,
    ) -> None:
        self.library = library
        self._memory = memory
        self._checked = checked

    @cached_property
    def _pool(self) -> Pool:
        from idlc.model.link import Pool

        return Pool(self.library, self._memory)

    def add(
        self, sources: Iterable[tuple[ir.TypeName, Source]], report: Report
    ) -> tuple[ir.Interface, ...]:
        """Return the interfaces of texts; from now on, references resolve to them."""
        own = []
        for name, source in sources:
            with stage("parse", source.path):
                entry = self._pool.lower(name, source)
            own.append(entry.interface)
            report.extend(entry.problems)
        return tuple(own)

    def model(self, package: str, own: Sequence[ir.Interface], report: Report) -> Model:
        """Return the linked and checked model of a package; every problem is reported."""
        from idlc.compiler.verdicts import check
        from idlc.model import link

        with stage("link", package):
            model = link.link(package, own, self.library, report, self._pool)
        with stage("check", package):
            check(model, report, self._checked)
        return model

    def models(
        self, interfaces: Mapping[ir.TypeName, ir.Interface], report: Report
    ) -> dict[str, Model]:
        """Return the models of interfaces by package; every problem is reported."""
        return {
            package: self.model(package, [interfaces[name] for name in names], report)
            for package, names in groupby(sorted(interfaces), lambda name: name.package)
        }

    def reached(self, names: Iterable[ir.TypeName]) -> dict[ir.TypeName, ir.Interface]:
        """Return interfaces and all that they refer to, without missing ones."""
        graph = self._pool.graph(names)
        return {name: interface for name, (interface, _) in graph.items() if interface}

    def all(
        self, packages: Iterable[inputs.Inputs], report: Report
    ) -> Iterator[tuple[inputs.Inputs, Model]]:
        """Yield the model of each package; all of them see each other."""
        added = [(package, self.add(sources_of(package, report), report)) for package in packages]
        for package, own in added:
            yield package, self.model(package.package, own, report)
        self._pool.check_packages(report)


def compile_package(
    package: str, sources: Iterable[tuple[ir.TypeName, Source]], library: Library, report: Report
) -> Model:
    """Return the linked and checked model of one package; every problem is reported."""
    compiler = Compiler(library)
    return compiler.model(package, compiler.add(sources, report), report)


def sources_of(package: inputs.Inputs, report: Report) -> Iterator[tuple[ir.TypeName, Source]]:
    """Yield the texts of a package's files; reports files that are not text."""
    for entry in package.files:
        source = entry.source(report)
        if source is not None:
            yield ir.TypeName(package.package, entry.file.kind, entry.file.name), source


def library_for(
    packages: Sequence[inputs.Inputs],
    scope: Scope,
    report: Report,
    texts: InterfaceTexts = MappingProxyType({}),
    kind: Callable[..., Library] = Library,
) -> Library:
    """Return the library, of a `kind`, in which compiled packages look up their references."""
    own = {package.package: package.folders for package in packages}
    return kind(
        scope.include,
        scope.root,
        report,
        own=own,
        exclude=scope.exclude,
        distro=scope.distro,
        texts=texts,
    )


def models_of(
    packages: Sequence[inputs.Inputs], scope: Scope, report: Report
) -> Iterator[tuple[inputs.Inputs, Model]]:
    """Yield each package with its model; all problems are reported."""
    yield from Compiler(library_for(packages, scope, report)).all(packages, report)


def sound_models(
    packages: Sequence[inputs.Inputs], scope: Scope, report: Report
) -> list[tuple[Model, list[str]]]:
    """Return each package's model and the names of its files' types, derived ones included.

    Interfaces with errors, and interfaces that hold these, are left out, with a note.
    """
    models = list(models_of(packages, scope, report))
    sound_packages, left_out = [], []
    for (package, _), sound in zip(models, without_errors(models, report), strict=True):
        mine = sound.only(package.names).own
        names = [name for interface in mine for name in derived_names(interface)]
        sound_packages.append((sound, names))
        left_out += sorted(package.names - {interface.name for interface in mine})
    if left_out:
        listed = first_few((f"`{name}`" for name in left_out), 5)
        report.notes.append(f"idlc skipped these interfaces because of errors: {listed}")
    return sound_packages


def without_errors(
    models: Iterable[tuple[inputs.Inputs, Model]],
    report: Report,
    also: Mapping[str, str] = MappingProxyType({}),
) -> Iterator[Model]:
    """Yield models without the interfaces that a report has errors of, and their users.

    An error in a file counts for its file in `also` as well.
    """
    errors = report.errors
    broken = {problem.where[0] for problem in errors}
    broken |= {also[path] for path in broken & also.keys()}
    is_all = any(problem.code == codes.INVALID_PACKAGE_NAME.id for problem in errors)
    for _, model in models:
        sound = model.sound(broken) if errors else model
        yield sound.only(()) if is_all or model.package in broken else sound


def derived_names(interface: ir.Interface) -> list[str]:
    """Return the names of an interface and of all structures derived from it, sorted."""
    return sorted({str(part.name) for part in derive.structures(interface)})
