"""Every rule: a function that yields the problems of a model, or of the package around it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from typing import TypeAlias

from idlc.check import names, portability, style
from idlc.diagnostics.report import Diagnostic, Report
from idlc.model import ir
from idlc.model.link import Model, dependents
from idlc.project.package_xml import Facts

Rule: TypeAlias = Callable[[Model], Iterable[Diagnostic]]
PackageRule: TypeAlias = "Callable[[Facts, Model], Iterable[Diagnostic]]"
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
_OF_PACKAGES = (names.package_name, names.unique_modules, names.reserved_package_name)
_VERDICTS = (
    names.interface_names,
    names.unique_names,
    names.reserved_field_names,
    names.reserved_constant_names,
    names.reserved_interface_names,
    names.derived_suffixes,
    portability.constants_and_defaults,
)
#: Rules that only `idlc check` asks; all of them warn.
_ADVICE = (
    style.stamped,
    style.documented_interfaces,
    style.documented_fields,
    style.missing_units,
    style.unusual_units,
    style.constant_prefixes,
    style.enum_marks,
    style.suffixes,
    portability.wide_strings,
    portability.chars,
    portability.nested_bounds,
    portability.several_units,
    portability.removed_types,
    portability.changed_types,
)


def check(model: Model, report: Report, incremental: IncrementalFindings | None = None) -> None:
    """Report the problems that every command reports in the model's own interfaces."""
    for rule in _OF_PACKAGES:
        report.extend(rule(model))
    report.extend(_findings(_VERDICTS, model, incremental))


def advise(model: Model, report: Report, incremental: IncrementalFindings | None = None) -> None:
    """Report all warnings about the model's own interfaces; the caller selects."""
    report.extend(_findings(_ADVICE, model, incremental))


def _findings(
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


def check_package(facts: Facts, model: Model, report: Report) -> None:
    """Report all warnings about the package of a model's interfaces; the caller selects."""
    from idlc.check.package import cmake_lists, manifest

    rules: list[PackageRule] = [
        manifest.declared_dependencies,
        manifest.used_dependencies,
        manifest.interface_group,
        manifest.generators,
        manifest.declared_imports,
        cmake_lists.lists,
    ]
    if facts.modules:
        from idlc.check.package import arguments

        rules.append(arguments.deprecated_arguments)
    if facts.setup_py or facts.setup_cfg or facts.outputs:  # what CMake builds needs no ast
        from idlc.check.package import installation

        rules += [
            installation.installed,
            installation.resource_marker,
            installation.entry_points,
            installation.names,
            installation.current_output,
        ]
    report.extend(chain.from_iterable(rule(facts, model) for rule in rules))
