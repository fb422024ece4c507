"""The packages that `idlc gen` writes of recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.disk import inputs
from idlc.disk.requested import borrowed
from idlc.driver.gen import GenOptions
from idlc.driver.recorded import topics_of, versions
from idlc.driver.recorded_models import check_versions, contradicted
from idlc.driver.recorded_types import Around, RecordedTypes
from idlc.model import ir


def recorded_packages(
    paths: Sequence[str], options: GenOptions, report: Report
) -> tuple[list[inputs.Inputs], Mapping[ir.TypeName, Source]]:
    """Return the packages of recorded types with all that these need, and their definitions.

    Into a prefix, packages go whole, because they hide those of the same name in others.
    """
    topics = topics_of(paths, options.topics, report)
    if topics is None:
        return [], {}
    found = versions(topics)
    check_versions(found, report)
    if report.had_errors or not found:
        return [], {}
    types = RecordedTypes(found[0], Around(options.scope, report), options.scope, report)
    report.extend(contradicted(types))
    names = types.names
    if options.ament:
        names = {package: set(types.library.interfaces(package)) for package in names}
    if not names:
        message = (
            f"no topic of {' or '.join(f'`{path}`' for path in paths)} has a type that is known"
        )
        report.add(codes.NO_INTERFACES.of(paths[0], message))
    packages = [borrowed(mine, types.library) for _, mine in sorted(names.items())]
    return packages, types.texts
