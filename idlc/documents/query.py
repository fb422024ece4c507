"""The pipelines of `idlc hash` and `idlc describe`."""

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
from idlc.recordings.find import split_recordings

if TYPE_CHECKING:
    from idlc.diagnostics.report import Diagnostic
    from idlc.model import ir
    from idlc.model.link import Model
    from idlc.project.library import Library


def hashes(targets: Sequence[str], scope: Scope, report: Report) -> list[tuple[str, str]]:
    """Return type hash and full name of each type in paths and names, derived types included."""
    named_hashes: list[tuple[str, str]] = []
    scope = _with_hashes(scope)
    if not _has_hashes(scope.distro, report):
        return named_hashes
    for model, names in requested_models(targets, scope, report):
        with stage("describe", model.package):
            named_hashes += [(model.describer.hash(name), name) for name in names]
    return list(dict.fromkeys(named_hashes))


def describe(target: str, scope: Scope, report: Report) -> dict[str, object] | None:
    """Return the content of the JSON file that ROS 2 installs for one interface or derived type."""
    scope = _with_hashes(scope)
    if not _has_hashes(scope.distro, report):
        return None
    models = list(requested_models((target,), scope, report))
    if report.had_errors or not models:
        return None
    (model, names) = models[0]
    tops = [str(own.name) for own in model.own if str(own.name) in names] or names
    if len(models) > 1 or len(tops) > 1:
        hint = f"name one of them, such as `idlc describe {tops[0]}`"
        message = f"`{target}` holds several interfaces"
        report.add(codes.NO_SUCH_TYPE.of(target, message, hint=hint))
        return None
    with stage("describe", tops[0]):
        return {**model.describer.installed(tops[0])}


def _with_hashes(scope: Scope) -> Scope:
    """Return a scope for the first of its distributions with type hashes, if there is one."""
    able = tuple(distro for distro in scope.distros if distro.has_hashes)
    return msgspec.structs.replace(scope, distros=able or scope.distros)


def _has_hashes(distro: Distro, report: Report) -> bool:
    """Return whether a distribution has type hashes and descriptions; report IDL624 otherwise."""
    if not distro.has_hashes:
        first = next(other for other in later(distro) if other.has_hashes)
        message = f"ROS 2 {distro.title} has no type hashes and no type descriptions"
        hint = f"they came with {first.title}; say for which distribution, as in `--distro jazzy`"
        report.add(codes.NO_TYPE_HASHES.of("", message, hint=hint))
    return distro.has_hashes


def requested_models(
    targets: Sequence[str], scope: Scope, report: Report
) -> Iterator[tuple[Model, list[str]]]:
    """Yield, for paths and names, models and the requested names in them.

    Interfaces with errors are left out.
    """
    paths = [target for target in targets if is_path(target, scope.root)]
    for target in targets:
        if target not in paths:
            problems = Report()
            yield from _named(target, scope, problems)
            report.extend(problems)
    recordings, paths = split_recordings(paths, scope.root)
    if recordings:
        from idlc.recordings.packages import recorded_models

        yield from recorded_models(recordings, scope, report)
    if paths:
        problems = Report()
        packages = inputs.packages(
            find(paths, scope.root, problems, scope.exclude), scope, problems
        )
        report.extend(problems)
        report.notes += problems.notes
        if not problems.had_errors:
            yield from sound_models(packages, scope, report)


def _named(text: str, scope: Scope, report: Report) -> Iterator[tuple[Model, list[str]]]:
    """Yield the models of a type's or package's name, and the requested names in them."""
    library, matches = resolve(text, scope, report)
    for name, interface in matches:
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
    parts = (f"`{name.rpartition('/')[2]}`" for name in names if name != str(interface))
    hint = f"the parts of `{interface}` are {', '.join(parts)}"
    return codes.NO_SUCH_TYPE.of("", f"no such type: `{text}`", hint=hint)
