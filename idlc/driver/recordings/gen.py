"""The packages that `idlc gen` writes of recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.source import Source
from idlc.disk.library import Library
from idlc.disk.machine import environment
from idlc.disk.packages import inputs
from idlc.disk.packages.requested import borrowed
from idlc.disk.read import absolute
from idlc.disk.scope import Scope
from idlc.driver.recordings.models import check_versions, contradicted
from idlc.driver.recordings.types import NAMED, Around, recorded_types
from idlc.driver.recordings.versions import topics_of, versions
from idlc.model import ir


def recorded_packages(
    paths: Sequence[str], topics_wanted: Sequence[str], scope: Scope, report: Report, *, whole: bool
) -> tuple[list[inputs.Inputs], Mapping[ir.TypeName, Source]]:
    """Return the packages of recorded types with all that these need, and their definitions.

    `whole` packages are for a prefix, where they hide those of the same name in others.
    """
    topics = topics_of(paths, topics_wanted, report)
    if topics is None:
        return [], {}
    found = versions(topics)
    check_versions(found, report)
    if report.had_errors or not found:
        return [], {}
    types = recorded_types(found[0], Around(scope, report), scope, report)
    report.extend(contradicted(types))
    names = types.names
    if whole:
        names = {package: set(types.library.interfaces(package)) for package in names}
    if not names:
        message = (
            f"no topic of {' or '.join(f'`{path}`' for path in paths)} has a type that is known"
        )
        report.add(codes.NO_INTERFACES.of(paths[0], message))
    if not whole:
        _tell_hidden(names, types.library, report)
    packages = [borrowed(mine, types.library) for _, mine in sorted(names.items())]
    home = absolute(paths[0])
    return [msgspec.structs.replace(one, home=home) for one in packages], types.texts


def _tell_hidden(
    names: Mapping[str, AbstractSet[ir.TypeName]], library: Library, report: Report
) -> None:
    """Note the packages that are installed here with more than was recorded."""
    hidden = [
        package
        for package, mine in names.items()
        if environment.python_folders(package) and set(library.interfaces(package)) - mine
    ]
    if hidden:
        listed = first_few((f"`{package}`" for package in sorted(hidden)), NAMED)
        report.notes.append(
            f"{listed}: installed here with more than was recorded, which programs do not see "
            "where what is written comes first on Python's path"
        )
