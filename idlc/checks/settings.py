"""The table `[tool.idlc.check]`; a mistake is reported as IDL611."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import msgspec
from msgspec import Meta

from idlc.checks.select import Selection, is_selector
from idlc.disk.settings.pyproject import command_table
from idlc.disk.settings.table import Table, Texts, read_value

if TYPE_CHECKING:
    from idlc.diagnostics.report import Report
    from idlc.disk.settings.pyproject import Config


class CheckSettings(msgspec.Struct, frozen=True, rename="kebab"):
    """`[tool.idlc.check]`; without `select`, what is on by default is meant."""

    select: Annotated[tuple[str, ...] | None, Meta(title="a list of strings")] = None
    ignore: Texts = ()
    per_path: Table = {}


def selection(config: Config, report: Report) -> Selection:
    """Return which warnings `[tool.idlc.check]` asks for."""
    table, place = command_table(config, "check", CheckSettings, report)
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
