"""What differs between the standard interfaces here and those of another distribution."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from idlc.check.compiler import Compiler, compile_package, library_for, stage
from idlc.compare.packages import Comparison, compare, together
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.model import catalog, derive, ir
from idlc.model.distros import BY_NAME, Distro, unknown_distro
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.library import Library
from idlc.project.settings import Scope

PREFIX = "distro:"


def is_distro(against: str) -> bool:
    """Return whether a text that says what to compare with means a distribution."""
    return against.startswith(PREFIX)


def compare_with_distro(
    against: str, given: Sequence[inputs.Inputs], scope: Scope, report: Report
) -> Comparison | None:
    """Return how what is used here differs from a distribution's, which counts as the old version.

    Used is what packages refer to; without any, all that is built in. What changes in the
    packages themselves because of it is told, too. `None` after an error.
    """
    name = against.removeprefix(PREFIX)
    if name not in BY_NAME:
        message = f"there is no distribution `{name}`"
        report.add(codes.NO_SUCH_REVISION.of("", message, hint=unknown_distro(name)))
        return None
    other = BY_NAME[name]
    here = library_for(given, scope, report)
    there = _Layered(given, scope, other, other_first=True)
    own = [one for one in given if not catalog.is_standard(one.package)]
    after = _models(own, _Layered(given, scope, other), report)
    before = _models(own, there, Report())
    if report.had_errors:
        return None
    with stage("compare", against):
        used = _used(after).union(*(one.names for one in given if one not in own))
        found = [compare(old, new) for old, new in zip(before, after, strict=True)]
        return together([*found, *_of_packages(used if given else _all(here, other), here, there)])


class _Layered(Library):
    """The library here with the standard interfaces of another distribution.

    These count, or, unless `other_first`, only where there is none here. So a message that one
    of the two lacks hides nothing of those that hold it.
    """

    def __init__(
        self,
        given: Sequence[inputs.Inputs],
        scope: Scope,
        other: Distro,
        *,
        other_first: bool = False,
    ) -> None:
        own = {one.package: one.folders for one in given}
        super().__init__(
            scope.include,
            scope.root,
            Report(),
            own=own,
            exclude=scope.exclude,
            distro=scope.distro,
        )
        self.other = other
        self._other_first = other_first

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface, or `None` if neither has it."""
        others = catalog.source(name, self.other)
        return others if others and self._other_first else super().source(name) or others


def _models(given: Sequence[inputs.Inputs], library: Library, report: Report) -> list[Model]:
    found = Report()
    models = [model for _, model in Compiler(library).all(given, found)]
    report.extend(one for one in found if one.severity is codes.ERROR)
    return models


def _used(models: Iterable[Model]) -> set[ir.TypeName]:
    """Return the standard messages in packages' fields, and in the fields of those."""
    found: set[ir.TypeName] = set()
    for model in models:
        waiting = list(model.own)
        while waiting:
            for target in _targets(waiting.pop()):
                if target not in found and catalog.is_standard(target.package):
                    found.add(target)
                    waiting.append(model.interfaces[target])
    return found


def _targets(interface: ir.Interface) -> Iterator[ir.TypeName]:
    for part in derive.sections(interface):
        for field in part.fields:
            element = ir.element_of(field.type)
            if isinstance(element, ir.Ref):
                yield element.target


def _all(here: Library, other: Distro) -> set[ir.TypeName]:
    """Return the standard interfaces that there are here, or in another distribution."""
    names = {name for name in here.packages() if catalog.is_standard(name)}
    return {*catalog.interfaces(other), *(one for name in names for one in here.interfaces(name))}


def _of_packages(
    names: Iterable[ir.TypeName], here: Library, there: _Layered
) -> Iterator[Comparison]:
    """Yield what differs in standard interfaces, package by package."""
    packages: dict[str, list[ir.TypeName]] = {}
    for name in sorted(names):
        packages.setdefault(name.package, []).append(name)
    for package, mine in packages.items():
        texts = ((name, catalog.source(name, there.other), here.source(name)) for name in mine)
        both = list(texts)
        old = [(name, source) for name, source, _ in both if source]
        new = [(name, source) for name, _, source in both if source]
        found = compare(
            compile_package(package, old, there, Report()).only(mine),
            compile_package(package, new, here, Report()).only(mine),
        )
        # what to do instead is nothing that users of ROS 2 can do
        yield found._replace(changes=tuple(one._replace(hint=None) for one in found.changes))
