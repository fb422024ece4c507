"""What `load` compiles: the models of what was asked for and of all that this needs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from idlc.diagnostics.report import Report, Severity
from idlc.disk.find import is_path
from idlc.disk.packages.requested import wanted
from idlc.disk.scope import Scope, scope
from idlc.disk.settings.pyproject import Config
from idlc.driver import named_types
from idlc.driver.recordings.types import Around, RecordedTypes, recorded_types
from idlc.driver.recordings.versions import read, versions
from idlc.driver.stages import Compiler, library_for, sources_of
from idlc.recordings.definitions import recorded
from idlc.recordings.errors import RecordingError
from idlc.recordings.find import is_recording

if TYPE_CHECKING:
    from idlc.model import ir
    from idlc.model.link import Model
    from idlc.recordings.container import Topic

Models = dict[str, "Model"]


def asked_models(
    what: str, include: tuple[str, ...], distro: str | None, report: Report
) -> tuple[Models, list[ir.TypeName]]:
    """Return the models of packages, and which interfaces in them were asked for."""
    where = scope(Config(), None, include, distro=distro)
    if is_recording(what):
        return _of_recording(what, where, report)
    if is_path(what):
        given = wanted([what], [], "", where, report)
        library = library_for(given, where, report)
        names = [name for one in given for name in one.names]
        compiler = Compiler(library)
        for one in given:
            compiler.add(sources_of(one, report), report)
    else:
        library, meant = named_types.resolve(what, where, report)
        names = [one.interface for one in meant]
        compiler = Compiler(library)
    return ({}, []) if report.had_errors else (_models(compiler, names, report), names)


def _models(compiler: Compiler, names: Iterable[ir.TypeName], report: Report) -> Models:
    """Return the models of interfaces and of all that these need, by package."""
    found: dict[str, list[ir.Interface]] = {}
    for name, interface in sorted(compiler.reached(names).items()):
        found.setdefault(name.package, []).append(interface)
    every = Report()
    models = {package: compiler.model(package, own, every) for package, own in found.items()}
    report.extend(one for one in every if one.severity is Severity.ERROR)
    return models


def _of_recording(path: str, where: Scope, report: Report) -> tuple[Models, list[ir.TypeName]]:
    recording = read(path, report)
    found = versions(recording.topics) if recording else []
    if len(found) != 1:
        from idlc.driver.recordings.models import check_versions

        check_versions(found, report)
        return {}, []
    types = recorded_types(found[0], Around(where, report), where, Report())
    models = types.models
    report.extend(types.errors)
    return models, sorted({one.interface for one in types.topics})


def topic_models(topic: Topic, include: tuple[str, ...]) -> tuple[Models, Report]:
    """Return the models of a topic's type, and what there is to say if not all was recorded."""
    types, told = _types(topic, include)
    if not types.topics or types.errors or told.had_errors:
        first = min([*types.errors, *told], key=lambda one: one.severity, default=None)
        why = first.message if first else "its type is not known"
        why = why.removeprefix(f"`{topic.name}` is left out: ")
        raise RecordingError(f"`{topic.name}` cannot be read: {why}", first and first.hint)
    return types.models, told


def recorded_hash(topic: Topic, include: tuple[str, ...]) -> str | None:
    """Return the hash of a topic's type by its definition, or `None` if there is none."""
    types, _ = _types(topic, include)
    return next((types.hash(one) for one in types.topics), None)


def _types(topic: Topic, include: tuple[str, ...]) -> tuple[RecordedTypes, Report]:
    where, told = Scope(include=include), Report()
    (version,) = versions([recorded(topic, topic.name)])
    types = recorded_types(version, Around(where, told), where, told)
    return types, told
