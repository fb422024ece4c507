"""The differences between the local standard interfaces and another distribution's."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import groupby
from typing import Any

from idlc.compiler.compiler import Compiler, compile_package, library_for, stage
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.model import catalog, derive, ir
from idlc.model.distros import Distro
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.library import Library
from idlc.project.settings import Scope
from idlc.project.words import read_distro
from idlc.versions.packages import Comparison, combine, compare


def compare_with_distro(
    name: str, packages: Sequence[inputs.Inputs], scope: Scope, report: Report
) -> Comparison:
    """Return the changes from a distribution's interfaces, the old version, to the local ones.

    They are the interfaces that packages refer to; without packages, all built-in ones. Resulting
    changes of the packages themselves are included. Raises ReportedError.
    """
    other = read_distro(name, report)
    library = library_for(packages, scope, report)
    other_library, both = (
        library_for(packages, scope, Report(), kind=partial(_LayeredLibrary, other, other_first))
        for other_first in (True, False)
    )
    own = [package for package in packages if not catalog.is_standard(package.package)]
    after = _models(own, both, report)
    before = _models(own, other_library, Report())
    report.raise_errors()
    with stage("compare", other.name):
        named = (package.names for package in packages if package not in own)
        used = set[ir.TypeName]().union(*map(_used, after), *named)
        names = used if packages else _all(library, other)
        of_packages = _of_packages(names, library, other_library, other)
        standard = combine(of_packages)
        whole = combine([*map(compare, before, after), standard])
        return whole._replace(compared=standard.compared)


class _LayeredLibrary(Library):
    """The local library with the standard interfaces of another distribution.

    With `other_first` they take precedence, otherwise they fill gaps. A message that one of the
    two lacks therefore does not hide the messages that hold it.
    """

    def __init__(self, other: Distro, other_first: bool, *place: Any, **options: Any) -> None:
        super().__init__(*place, **options)
        self._other = other
        self._other_first = other_first

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface, or `None` if neither has it."""
        others = catalog.source(name, self._other)
        return others if others and self._other_first else super().source(name) or others


def _models(packages: Sequence[inputs.Inputs], library: Library, report: Report) -> list[Model]:
    problems = Report()
    models = [model for _, model in Compiler(library).all(packages, problems)]
    report.extend(problems.errors)
    return models


def _used(model: Model) -> set[ir.TypeName]:
    """Return the standard messages in a package's fields, nested ones included."""

    def targets(name: ir.TypeName) -> list[ir.TypeName]:
        references = derive.references(model.interfaces[name])
        return [target for target in references if catalog.is_standard(target.package)]

    own = {interface.name for interface in model.own}
    return derive.closure(own, targets) - own


def _all(library: Library, other: Distro) -> set[ir.TypeName]:
    """Return the standard interfaces of the local library and another distribution."""
    names = {name for name in library.packages() if catalog.is_standard(name)}
    return {
        *catalog.interfaces(other),
        *(interface for name in names for interface in library.interfaces(name)),
    }


def _of_packages(
    names: Iterable[ir.TypeName], library: Library, other_library: Library, other: Distro
) -> Iterator[Comparison]:
    """Yield the differences in standard interfaces, package by package."""
    for package, group in groupby(sorted(names), lambda name: name.package):
        mine = list(group)
        old = [(name, source) for name in mine if (source := catalog.source(name, other))]
        new = [(name, source) for name in mine if (source := library.source(name))]
        comparison = compare(
            compile_package(package, old, other_library, Report()).only(mine),
            compile_package(package, new, library, Report()).only(mine),
        )
        # the hints are for authors of interfaces, not for users of ROS 2
        yield comparison._replace(
            changes=tuple(change._replace(hint=None) for change in comparison.changes)
        )
