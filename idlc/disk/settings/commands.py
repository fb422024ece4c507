"""The tables of single commands in `[tool.idlc]`; a mistake is reported as IDL611."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import msgspec
from msgspec import Meta

from idlc.diagnostics.codes import CODES
from idlc.disk.settings.table import Place, Table, Tables, Text, Texts, read_table, read_value

if TYPE_CHECKING:
    from idlc.breaking.allow import Allowance
    from idlc.checks.select import Selection
    from idlc.diagnostics.report import Report
    from idlc.disk.settings.pyproject import Config

_Shape = TypeVar("_Shape", bound=msgspec.Struct)


class CheckSettings(msgspec.Struct, frozen=True, rename="kebab"):
    """`[tool.idlc.check]`; without `select`, what is on by default is meant."""

    select: Annotated[tuple[str, ...] | None, Meta(title="a list of strings")] = None
    ignore: Texts = ()
    per_path: Table = {}


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


def selection(config: Config, report: Report) -> Selection:
    """Return which warnings `[tool.idlc.check]` asks for."""
    from idlc.checks.select import Selection, is_selector

    table, place = _table(config, "check", CheckSettings, report)
    if place is None:
        return Selection()
    paths = place._replace(table=f"{place.table}.per-path", shown=f"[{place.table}.per-path]")
    per_path = {
        path: read_value(words, Texts, path, paths, report) or ()
        for path, words in table.per_path.items()
    }
    lists = [(place, "select", table.select or ()), (place, "ignore", table.ignore)]
    for where, key, words in (*lists, *((paths, *one) for one in per_path.items())):
        for word in words:
            if not is_selector(word):
                message = f"`{key}` in {where.shown} has `{word}`, which means no rule"
                where.wrong(key, message, report)
    return Selection(table.select, table.ignore, tuple(per_path.items()))


def against(config: Config, report: Report) -> str | None:
    """Return what `idlc breaking` compares with unless told otherwise."""
    table, place = _table(config, "breaking", BreakingSettings, report)
    if place is not None:
        place.no_url("against", table.against, report)
    return table.against or None


def allowances(config: Config, report: Report) -> tuple[Allowance, ...]:
    """Return the entries of `[[tool.idlc.breaking.allow]]`."""
    entries = _table(config, "breaking", BreakingSettings, report)[0].allow
    found = [_allowance(config, at, entry, report) for at, entry in enumerate(entries)]
    return tuple(entry for entry in found if entry is not None)


def _allowance(
    config: Config, number: int, entry: Mapping[str, Any], report: Report
) -> Allowance | None:
    from idlc.breaking.allow import Allowance

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


def _table(
    config: Config, name: str, shape: type[_Shape], report: Report
) -> tuple[_Shape, Place | None]:
    """Return the table of a command and its place, without one where there is no file."""
    if config.source is None:
        return shape(), None
    place = Place(config.source, f"tool.idlc.{name}", f"[tool.idlc.{name}]")
    found = read_table(config.tables.get(name, {}), shape, place, report)
    assert found is not None
    return found, place
