"""The rules that only `idlc check` asks, about a model or the package around it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import chain
from typing import TypeAlias

from idlc.check import portability, style
from idlc.compiler.verdicts import IncrementalFindings, findings
from idlc.diagnostics.report import Diagnostic, Report
from idlc.model.link import Model
from idlc.packaging.facts import Facts

PackageRule: TypeAlias = "Callable[[Facts, Model], Iterable[Diagnostic]]"


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


def advise(model: Model, report: Report, incremental: IncrementalFindings | None = None) -> None:
    """Report all warnings about the model's own interfaces; the caller selects."""
    report.extend(findings(_ADVICE, model, incremental))


def check_package(facts: Facts, model: Model, report: Report) -> None:
    """Report all warnings about the package of a model's interfaces; the caller selects."""
    from idlc.check import builds, cmake_lists, manifest

    rules: list[PackageRule] = [
        manifest.declared_dependencies,
        manifest.used_dependencies,
        manifest.interface_group,
        manifest.generators,
        manifest.declared_imports,
        cmake_lists.lists,
        builds.obstacles,
    ]
    if facts.modules:
        from idlc.check import arguments

        rules.append(arguments.deprecated_arguments)
    if facts.setup_py or facts.setup_cfg or facts.outputs:  # what CMake builds needs no ast
        from idlc.check import installation

        rules += [
            installation.installed,
            installation.resource_marker,
            installation.entry_points,
            installation.names,
            installation.current_output,
        ]
    report.extend(chain.from_iterable(rule(facts, model) for rule in rules))
