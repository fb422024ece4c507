"""The pipelines of the commands that answer: hash and describe."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import msgspec

from idlc.check.compiler import compile_package, derived_names, sound_models, stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.model.distros import Distro, later
from idlc.project import inputs
from idlc.project.find import find, is_path
from idlc.project.library import resolve
from idlc.project.settings import Scope
from idlc.recordings.find import divided

if TYPE_CHECKING:
    from idlc.diagnostics.report import Diagnostic
    from idlc.model import ir
    from idlc.model.link import Model
    from idlc.project.library import Library


def hashes(wanted: Sequence[str], scope: Scope, report: Report) -> list[tuple[str, str]]:
    """Return type hash and full name of what paths and type names mean, derived types included."""
    found: list[tuple[str, str]] = []
    scope = _with_hashes(scope)
    if not _has_hashes(scope.distro, report):
        return found
    for model, names in wanted_models(wanted, scope, report):
        with stage("describe", model.package):
            found += [(model.describer.hash(name), name) for name in names]
    return list(dict.fromkeys(found))


def describe(wanted: str, scope: Scope, report: Report) -> dict[str, object] | None:
    """Return the content of the JSON file that ROS 2 installs for one interface or derived type."""
    scope = _with_hashes(scope)
    if not _has_hashes(scope.distro, report):
        return None
    found = list(wanted_models((wanted,), scope, report))
    if report.had_errors or not found:
        return None
    (model, names) = found[0]
    tops = [str(own.name) for own in model.own if str(own.name) in names] or names
    if len(found) > 1 or len(tops) > 1:
        hint = f"name one of them, such as `idlc describe {tops[0]}`"
        message = f"`{wanted}` holds several interfaces"
        report.add(codes.NO_SUCH_TYPE.of(wanted, message, hint=hint))
        return None
    with stage("describe", tops[0]):
        return {**model.describer.installed(tops[0])}


def _with_hashes(scope: Scope) -> Scope:
    """Return a scope for the first of its distributions that has type hashes, if any has."""
    able = tuple(distro for distro in scope.distros if distro.has_hashes)
    return msgspec.structs.replace(scope, distros=able or scope.distros)


def _has_hashes(distro: Distro, report: Report) -> bool:
    """Return whether a distribution has type hashes and descriptions; report IDL624 otherwise."""
    if not distro.has_hashes:
        first = next(one for one in later(distro) if one.has_hashes)
        message = f"ROS 2 {distro.title} has no type hashes and no type descriptions"
        hint = f"they came with {first.title}; say for which distribution, as in `--distro jazzy`"
        report.add(codes.NO_TYPE_HASHES.of("", message, hint=hint))
    return distro.has_hashes


def wanted_models(
    wanted: Sequence[str], scope: Scope, report: Report
) -> Iterator[tuple[Model, list[str]]]:
    """Yield, for paths and names, sound models and the names in them that are meant.

    What has errors is left out.
    """
    paths = [one for one in wanted if is_path(one, scope.root)]
    for one in wanted:
        if one not in paths:
            found = Report()
            yield from _named(one, scope, found)
            report.extend(found)
    recordings, paths = divided(paths, scope.root)
    if recordings:
        from idlc.recordings.packages import recorded_models

        yield from recorded_models(recordings, scope, report)
    if paths:
        there = Report()
        given = inputs.packages(find(paths, scope.root, there, scope.exclude), scope, there)
        report.extend(there)
        report.notes += there.notes
        if not there.had_errors:
            yield from sound_models(given, scope, report)


def _named(text: str, scope: Scope, report: Report) -> Iterator[tuple[Model, list[str]]]:
    """Yield the models that a type's or package's name means, and the names that are meant."""
    library, meant = resolve(text, scope, report)
    for name, interface in meant:
        model = _compiled(interface, library, report)
        if model is None:
            return
        names = [n for own in model.own if own.name == interface for n in derived_names(own)]
        if name == interface:
            yield model, names
        elif str(name) in names:
            yield model, [str(name)]
        else:
            report.add(_no_such_part(text, interface, names))


def _compiled(interface: ir.TypeName, library: Library, report: Report) -> Model | None:
    """Return the model of an interface alone, `None` after an error."""
    source = library.source(interface)
    if source is None:
        return None
    model = compile_package(interface.package, [(interface, source)], library, report)
    return None if report.had_errors else model


def _no_such_part(text: str, interface: ir.TypeName, names: Sequence[str]) -> Diagnostic:
    parts = (f"`{one.rpartition('/')[2]}`" for one in names if one != str(interface))
    hint = f"the parts of `{interface}` are {', '.join(parts)}"
    return codes.NO_SUCH_TYPE.of("", f"no such type: `{text}`", hint=hint)
