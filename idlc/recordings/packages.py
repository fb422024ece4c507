"""Recorded types as models, and as the packages that `idlc gen` writes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec

from idlc.compiler.compiler import derived_names
from idlc.compiler.requests import borrowed
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Label, Report, ReportedError, first_few
from idlc.diagnostics.source import Span
from idlc.diagnostics.text import including
from idlc.model import ir
from idlc.model.link import Model, own_sections
from idlc.model.lowering.lower_types import constant_name, field_name
from idlc.project import inputs, prefixes
from idlc.project.library import InterfaceTexts
from idlc.project.settings import Scope
from idlc.recordings.types import (
    NAMED,
    LocalTypes,
    RecordedTypes,
    TopicsVersion,
    TypesReader,
    contradictions,
    recorded_types,
    topics_of,
    versions,
)


def check_versions(groups: Sequence[TopicsVersion], report: Report) -> None:
    """Report IDL653 for each name with several definitions."""
    for name, first, second in contradictions(groups):
        message = f"conflicting definition of `{name}`"
        other = Label(Span(first, 0, 0), "first definition")
        hint = "select topics with the same definition, or compile the recordings separately"
        here = Span(second, 0, 0)
        report.add(codes.SEVERAL_DEFINITIONS.at(here, message, labels=(other,), hint=hint))


def contradicted(types: RecordedTypes) -> Iterator[Diagnostic]:
    """Yield IDL654 for each topic whose definition does not have the recorded hash."""
    for typed in types.topics:
        topic, hash_ = typed.recorded.topic, types.hash(typed)
        if topic.hash and hash_ and topic.hash != hash_:
            yield codes.RECORDED_HASH_DIFFERS.of(
                f"{typed.recorded.recording}: topic {topic.name}",
                f"the definition of `{typed.name}` differs from the publisher's type",
                hint=f"{including('DIR')}, where DIR contains the publisher's files",
                place=typed.recorded.recording,
                detail=f"type hash recorded  {topic.hash}\nof the definition   {hash_}",
            )


def _forbidden_names(types: RecordedTypes) -> Iterator[Diagnostic]:
    """Yield IDL203 or IDL204 for names that recordings can have, and interface files cannot."""
    hint = "`idlc.load` and `idlc.Recording` make classes of recorded types without files"
    for model in types.models.values():
        for message in own_sections(model):
            faults = [(field.name_span, field_name(field.name)) for field in message.fields]
            faults += [(own.name_span, constant_name(own.name)) for own in message.constants]
            for span, fault in faults:
                if fault:
                    yield fault.code.at(span, fault.message, hint=hint)


def recorded_models(
    read: TypesReader, paths: Sequence[str], scope: Scope, report: Report
) -> Iterator[tuple[Model, list[str]]]:
    """Yield the models of recordings, without faulty interfaces, and the names of their types."""
    local = LocalTypes(scope, report)
    for path in paths:
        recording = read(path, scope.root, report)
        for version in versions(recording.topics) if recording else ():
            types = recorded_types(version, local, report)
            for model in types.models.values():
                yield model, [name for interface in model.own for name in derived_names(interface)]
            report.extend(types.errors)


def recorded_packages(
    read: TypesReader,
    paths: Sequence[str],
    topics_wanted: Sequence[str],
    scope: Scope,
    report: Report,
    *,
    whole: bool,
) -> tuple[list[inputs.Inputs], InterfaceTexts]:
    """Return the packages of recorded types with all that these need, and their definitions.

    `whole` packages are for a prefix, where they hide those of the same name in others. Raises
    ReportedError.
    """
    groups = versions(topics_of(read, paths, topics_wanted, scope.root, report))
    check_versions(groups, report)
    report.raise_errors()
    if not groups:
        return [], {}
    types = recorded_types(groups[0], LocalTypes(scope, report), report)
    report.extend(contradicted(types))
    report.extend(_forbidden_names(types))
    names: dict[str, set[ir.TypeName]] = {}
    for name in types.interfaces:
        names.setdefault(name.package, set()).add(name)
    if whole:
        names = {package: set(types.library.interfaces(package)) for package in names}
    if not names:
        recordings = " or ".join(f"`{path}`" for path in paths)
        message = f"no topic of {recordings} has a known type"
        report.add(codes.NO_INTERFACES.of(paths[0], message))
    # packages that are installed here with more interfaces than were recorded
    hidden = [
        f"`{package}`"
        for package, mine in sorted(names.items())
        if not whole
        and prefixes.python_folders(package)
        and set(types.library.interfaces(package)) - mine
    ]
    if hidden:
        report.notes.append(
            f"{first_few(hidden, NAMED)}: the installed package has more types than the "
            "recording; the generated package hides them if it comes first on Python's path"
        )
    packages = [borrowed(mine, types.library) for _, mine in sorted(names.items())]
    home = scope.root.absolute(paths[0])
    return [msgspec.structs.replace(package, home=home) for package in packages], types.texts


def write_definitions(
    read: TypesReader, recording: str, topics: Sequence[str], out: str, scope: Scope, report: Report
) -> list[str]:
    """Write each definition of a recording, or of some topics, to its file; return their paths.

    Files that exist with another content are an error, and nothing is written: ReportedError.
    """
    from idlc.project import write  # all readers of recordings import this module

    groups = versions(topics_of(read, [recording], topics, scope.root, report))
    check_versions(groups, report)
    report.raise_errors()
    files: dict[str, bytes] = {}
    for name, source in groups[0].texts.items() if groups else ():
        suffix = "idl" if source.is_idl else name.kind
        files[f"{name.package}/{name.kind}/{name.name}.{suffix}"] = source.text.encode()
    if not files:
        message = f"`{recording}` contains no definitions"
        raise report.refused(codes.NO_INTERFACES.of(recording, message))
    folder, shown = Path(scope.root.path(out)).absolute(), out.rstrip("/")
    changes = write.compare(folder, shown, files, {}, report)
    for change in changes:
        if change.old is not None:
            path = write.shown(shown, change.path)
            hint = "choose another folder with -o"
            report.add(codes.EXISTING_FILE.of(path, f"`{path}` exists", hint=hint))
    plan = write.WritePlan(folder, tuple(changes), {})
    report.raise_errors()
    if not write.apply(plan, shown, report):
        raise ReportedError
    return [write.shown(shown, path) for path in files]
