"""Rules on the package around the interfaces: the tutorials' troubleshooting lists."""

from __future__ import annotations

from idlc.checks.package import installation, manifest
from idlc.checks.package.facts import Facts
from idlc.diagnostics.report import Report
from idlc.model.link import Model

#: In no particular order.
RULES = (
    manifest.declared_dependencies,
    manifest.used_dependencies,
    manifest.interface_group,
    manifest.generators,
    manifest.declared_imports,
    installation.installed_interfaces,
    installation.resource_marker,
    installation.installed_libraries,
    installation.entry_points,
    installation.names,
    installation.current_output,
)


def check_package(facts: Facts, model: Model, report: Report) -> None:
    """Report what every rule finds in the package that holds a model's interfaces."""
    for rule in RULES:
        rule(facts, model, report)
