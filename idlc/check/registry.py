"""Every rule, with the codes that it reports; rules run only if one of their codes is selected.

Each list is a function, so that a run imports only the rules that it needs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report
from idlc.model import ir
from idlc.model.link import Model, dependents

if TYPE_CHECKING:
    from idlc.check.select import Selection
    from idlc.project.package_xml import Facts

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
        new = [
            name
            for name, (now, _) in graph.items()
            if name not in before or before[name] is not now
        ]
        changed = dependents(new, ((name, targets) for name, (_, targets) in graph.items()))
        own = (interface.name for interface in model.own)
        kept = {name: findings[name] for name in own if name in findings and name not in changed}
        self._packages[model.package] = {name: now for name, (now, _) in graph.items()}, kept
        return kept


Check: TypeAlias = Callable[[Model, Report], None]
PackageCheck: TypeAlias = "Callable[[Facts, Model, Report], None]"


class Rule(NamedTuple):
    """A function that checks a model, and the codes that it may report.

    `together`: it needs all interfaces at once, not each with its references.
    """

    check: Check
    codes: tuple[codes.Code, ...]
    together: bool = False


class PackageRule(NamedTuple):
    """A function that checks the package of a model, and the codes that it may report."""

    check: PackageCheck
    codes: tuple[codes.Code, ...]


def verdicts() -> tuple[Rule, ...]:
    """Return the rules that every command runs, the most helpful messages first."""
    from idlc.check import names, portability
    from idlc.check.names import (
        derived_suffixes,
        reserved_constant_names,
        reserved_field_names,
        reserved_interface_names,
        reserved_package_name,
    )

    return (
        Rule(names.package_name, (codes.INVALID_PACKAGE_NAME,), together=True),
        Rule(names.interface_names, (codes.INVALID_INTERFACE_NAME,)),
        Rule(names.unique_fields, (codes.DUPLICATE_FIELD,)),
        Rule(names.unique_constants, (codes.DUPLICATE_CONSTANT,)),
        Rule(names.unique_modules, (codes.SAME_PYTHON_MODULE,), together=True),
        Rule(
            reserved_field_names,
            (codes.BREAKS_ROSIDL_PYTHON, codes.BREAKS_C, codes.BREAKS_CPP),
        ),
        Rule(reserved_constant_names, (codes.BREAKS_CPP,)),
        Rule(reserved_interface_names, (codes.BREAKS_ROSIDL_PYTHON, codes.BREAKS_C)),
        Rule(
            reserved_package_name,
            (codes.BREAKS_ROSIDL_PYTHON, codes.BREAKS_CPP),
            together=True,
        ),
        Rule(derived_suffixes, (codes.BREAKS_ROSIDL_PYTHON, codes.BREAKS_C)),
        Rule(
            portability.constants_and_defaults,
            (
                codes.BREAKS_ROSIDL_PYTHON,
                codes.NON_FINITE_VALUE,
                codes.FLOAT32_RANGE,
                codes.MANGLED_TEXT,
                codes.ODD_TEXT,
            ),
        ),
    )


def advice() -> tuple[Rule, ...]:
    """Return the rules that only `idlc check` runs; all of them warn."""
    from idlc.check import portability, style

    return (
        Rule(style.stamped, (codes.STAMPED_WITHOUT_HEADER,)),
        Rule(style.documented_interfaces, (codes.UNDOCUMENTED_INTERFACE,)),
        Rule(style.documented_fields, (codes.UNDOCUMENTED_FIELD,)),
        Rule(style.missing_units, (codes.MISSING_UNIT,)),
        Rule(style.unusual_units, (codes.UNUSUAL_UNIT,)),
        Rule(style.constant_prefixes, (codes.CONSTANT_WITHOUT_PREFIX,)),
        Rule(style.suffixes, (codes.REDUNDANT_SUFFIX,)),
        Rule(portability.wide_strings, (codes.WIDE_STRING,)),
        Rule(portability.chars, (codes.CHAR_TYPE,)),
        Rule(portability.nested_bounds, (codes.UNENFORCED_BOUND,)),
        Rule(portability.several_units, (codes.SEVERAL_UNITS,)),
        Rule(portability.removed_types, (codes.REMOVED_STANDARD_TYPE,)),
        Rule(portability.changed_types, (codes.CHANGED_STANDARD_TYPE,)),
    )


def package_advice() -> tuple[PackageRule, ...]:
    """Return the rules on the package of the interfaces: the tutorials' troubleshooting."""
    from idlc.check.package import installation, manifest
    from idlc.check.package.manifest import listed_dependencies

    return (
        PackageRule(manifest.declared_dependencies, (codes.MISSING_DEPENDENCY,)),
        PackageRule(manifest.used_dependencies, (codes.UNUSED_DEPENDENCY,)),
        PackageRule(manifest.interface_group, (codes.NOT_IN_INTERFACE_GROUP,)),
        PackageRule(manifest.generators, (codes.NO_INTERFACE_GENERATORS,)),
        PackageRule(manifest.declared_imports, (codes.UNDECLARED_IMPORT,)),
        PackageRule(listed_dependencies, (codes.MISSING_CMAKE_DEPENDENCY,)),
        PackageRule(installation.installed, installation.CODES),
        PackageRule(installation.resource_marker, (codes.NO_RESOURCE_MARKER,)),
        PackageRule(installation.entry_points, (codes.BAD_ENTRY_POINT,)),
        PackageRule(installation.names, (codes.NAME_MISMATCH,)),
        PackageRule(installation.current_output, (codes.STALE_GENERATED_CODE,)),
    )


def check(model: Model, report: Report, incremental: IncrementalFindings | None = None) -> None:
    """Report the problems that every command reports in the model's own interfaces."""
    _ask(verdicts(), model, report, incremental)


def advise(
    model: Model,
    report: Report,
    selection: Selection,
    incremental: IncrementalFindings | None = None,
) -> None:
    """Report the selected warnings about the model's own interfaces."""
    rules = [rule for rule in advice() if any(map(selection.has, rule.codes))]
    _ask(rules, model, report, incremental)


def _ask(
    rules: Sequence[Rule], model: Model, report: Report, incremental: IncrementalFindings | None
) -> None:
    """Run rules; with `incremental`, only on changed interfaces."""
    for rule in rules:
        if rule.together or incremental is None:
            rule.check(model, report)
    if incremental is None:
        return
    findings = incremental.still_valid(model)
    for part in model.per_interface():
        name = part.own[0].name
        if name not in findings:
            problems = Report()
            for rule in rules:
                if not rule.together:
                    rule.check(part, problems)
            findings[name] = tuple(problems)
        report.extend(findings[name])


def check_package(facts: Facts, model: Model, report: Report, selection: Selection) -> None:
    """Report the selected warnings about the package of a model's interfaces."""
    for rule in package_advice():
        if any(map(selection.has, rule.codes)):
            rule.check(facts, model, report)
