"""The table `[tool.idlc.breaking]`; a mistake is reported as IDL611."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
from msgspec import Meta

from idlc.breaking.allow import Allowance
from idlc.diagnostics.codes import CODES
from idlc.disk.settings.pyproject import command_table
from idlc.disk.settings.table import Place, Tables, Text, read_table

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.disk.settings.pyproject import Config


class BreakingSettings(msgspec.Struct, frozen=True):
    """`[tool.idlc.breaking]`."""

    allow: Tables = ()
    against: Text = ""


def _words(what: str) -> Meta:
    return Meta(pattern=r"\S", title="a string that is not blank", description=what)


class AllowSettings(msgspec.Struct, frozen=True):
    """An entry of `[[tool.idlc.breaking.allow]]`."""

    at: Annotated[str, _words("the type or field that it is about")]
    reason: Annotated[str, _words("why the change is made nevertheless")]
    until: Annotated[
        datetime.date,
        Meta(title="a day, as in 2030-12-31", description="its last day, as in 2030-12-31"),
    ]
    code: Text = ""


def against(config: Config, report: Report) -> str | None:
    """Return what `idlc breaking` compares with unless told otherwise."""
    table, place = command_table(config, "breaking", BreakingSettings, report)
    if place is not None:
        place.no_url("against", table.against, report)
    return table.against or None


def allowances(config: Config, report: Report) -> tuple[Allowance, ...]:
    """Return the entries of `[[tool.idlc.breaking.allow]]`."""
    entries = command_table(config, "breaking", BreakingSettings, report)[0].allow
    found = [_allowance(config, at, entry, report) for at, entry in enumerate(entries)]
    return tuple(entry for entry in found if entry is not None)


def _allowance(
    config: Config, number: int, entry: Mapping[str, Any], report: Report
) -> Allowance | None:
    assert config.source is not None
    at, until = entry.get("at"), entry.get("until")
    which = f"the entry for `{at}`" if isinstance(at, str) else "an entry"
    name = "tool.idlc.breaking.allow"
    place = Place(config.source, name, f"{which} in [[{name}]]", number)
    day = {"until": until.date()} if isinstance(until, datetime.datetime) else {}
    found = read_table({**entry, **day}, AllowSettings, place, report)
    if found is None:
        return None
    if found.code and not (found.code in CODES and found.code.startswith("IDL5")):
        message = f"{place.shown} has `{found.code}`, which is no code of a breaking change"
        place.wrong("code", message, report)
        return None
    return Allowance(found.at, found.reason, found.until.isoformat(), found.code or None)
