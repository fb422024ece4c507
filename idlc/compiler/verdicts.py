"""The rules that every command asks: functions that yield the problems of a model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from typing import TypeAlias

from idlc.compiler import name_rules, value_rules
from idlc.diagnostics.report import Diagnostic, Report
from idlc.model import ir
from idlc.model.link import Model, dependents

Rule: TypeAlias = Callable[[Model], Iterable[Diagnostic]]
Findings: TypeAlias = dict[ir.TypeName, tuple[Diagnostic, ...]]


class IncrementalFindings:
    """The findings of earlier runs, kept for interfaces that did not change since.

    An interface has changed if it, or any interface that it refers to, is another object.
    """

    def __init__(self) -> None:
        self._packages: dict[str, tuple[dict[ir.TypeName, ir.Interface | None], Findings]] = {}

    def still_valid(self, model: Model) -> Findings:
        """Return the findings of a package's unchanged interfaces; the caller adds the others."""
        graph = model.graph()
        before, findings = self._packages.get(model.package, ({}, {}))
        now = {name: interface for name, (interface, _) in graph.items()}
        new = [name for name in now if name not in before or before[name] is not now[name]]
        changed = dependents(new, ((name, targets) for name, (_, targets) in graph.items()))
        own = (interface.name for interface in model.own)
        kept = {name: findings[name] for name in own if name in findings and name not in changed}
        self._packages[model.package] = now, kept
        return kept


#: Rules that every command asks, the most helpful messages first; of the whole package, then
#: of each interface with its references.
_OF_PACKAGES = (
    name_rules.package_name,
    name_rules.unique_modules,
    name_rules.reserved_package_name,
)
_VERDICTS = (
    name_rules.interface_names,
    name_rules.unique_names,
    name_rules.reserved_field_names,
    name_rules.reserved_constant_names,
    name_rules.reserved_interface_names,
    name_rules.derived_suffixes,
    value_rules.constants_and_defaults,
)


def check(model: Model, report: Report, incremental: IncrementalFindings | None = None) -> None:
    """Report the problems that every command reports in the model's own interfaces."""
    for rule in _OF_PACKAGES:
        report.extend(rule(model))
    report.extend(findings(_VERDICTS, model, incremental))


def findings(
    rules: Sequence[Rule], model: Model, incremental: IncrementalFindings | None
) -> Iterator[Diagnostic]:
    """Yield the findings of rules; with `incremental`, only changed interfaces are looked at."""
    if incremental is None:
        yield from chain.from_iterable(rule(model) for rule in rules)
        return
    findings = incremental.still_valid(model)
    for interface in model.own:
        if interface.name not in findings:
            alone = model.alone(interface)
            findings[interface.name] = tuple(chain.from_iterable(rule(alone) for rule in rules))
        yield from findings[interface.name]
