"""The rules that only `idlc check` asks: they warn, and each can be switched off."""

from __future__ import annotations

from idlc.checks import portability, style
from idlc.diagnostics.report import Report
from idlc.model.link import Model

#: In no particular order.
RULES = (
    style.stamped,
    style.documented_interfaces,
    style.documented_fields,
    style.missing_units,
    style.unusual_units,
    style.constant_prefixes,
    style.suffixes,
    portability.wide_strings,
    portability.chars,
    portability.nested_bounds,
    portability.several_units,
)


def lint(model: Model, report: Report) -> None:
    """Report what every rule finds in the model's own interfaces."""
    for rule in RULES:
        rule(model, report)
