"""Checks: rules over a linked model, each a function of the model and a report."""

from __future__ import annotations

from idlc.checks import names, reserved, values
from idlc.diagnostics.report import Report
from idlc.model.link import Model

#: In the order in which their messages help most.
RULES = (
    names.package_name,
    names.interface_names,
    names.unique_fields,
    names.unique_constants,
    names.unique_modules,
    reserved.field_names,
    reserved.constant_names,
    reserved.interface_names,
    reserved.package_name,
    reserved.derived_suffixes,
    values.constants_and_defaults,
)


def check(model: Model, report: Report) -> None:
    """Report what every rule finds in the model's own interfaces."""
    for rule in RULES:
        rule(model, report)
