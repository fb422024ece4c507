"""The reports of several runs over the same files, as one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import msgspec

from idlc.diagnostics.report import Diagnostic, Report, Severity


def merged(runs: Mapping[str, Report]) -> Report:
    """Return the problems of runs for several distributions, each once.

    Those that were not found in every run say in which.
    """
    first: dict[object, Diagnostic] = {}
    names: dict[object, list[str]] = {}
    together = Report()
    for name, report in runs.items():
        for one in report:
            first.setdefault(one.identity, one)
            names.setdefault(one.identity, []).append(name)
    for identity, one in first.items():
        everywhere = len(names[identity]) == len(runs)
        distros = () if everywhere else tuple(names[identity])
        together.add(msgspec.structs.replace(one, distros=distros))
    return together


def without_overruled(found: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """Yield problems without advice for some distributions on lines that others refuse."""
    errors = (one for one in found if one.severity is Severity.ERROR)
    refused = {place for one in errors for place in _line(one)}
    for one in found:
        advice = one.distros and one.severity is Severity.WARNING
        if not (advice and refused.intersection(_line(one))):
            yield one


def _line(found: Diagnostic) -> Iterable[tuple[str, int]]:
    """Return the file and line of a problem, if it has one."""
    if found.span is None:
        return ()
    return ((found.span.source.path, found.span.source.position(found.span.start)[0]),)
