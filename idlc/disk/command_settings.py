"""The tables of single commands in `[tool.idlc]`; a mistake is reported as IDL611."""

from __future__ import annotations

import datetime
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from idlc.diagnostics.codes import BAD_CONFIG, CODES
from idlc.diagnostics.suggest import did_you_mean
from idlc.disk.pyproject import Config, wrong

if TYPE_CHECKING:
    from idlc.breaking.allow import Allowance
    from idlc.checks.select import Selection
    from idlc.diagnostics.report import Report

_ENTRY = {"at", "reason", "until", "code"}


def allowances(config: Config, report: Report) -> tuple[Allowance, ...]:
    """Return the entries of `[[tool.idlc.breaking.allow]]`."""
    table = _table(config, "breaking", ("allow", "against"), report)
    entries = table.get("allow", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        _complain(
            config, "allow", "`allow` in [tool.idlc.breaking] must be a list of tables", report
        )
        return ()
    found = [_allowance(config, entry, report) for entry in entries]
    return tuple(entry for entry in found if entry is not None)


def against(config: Config, report: Report) -> str | None:
    """Return what `idlc breaking` compares with unless told otherwise."""
    value = _table(config, "breaking", ("allow", "against"), report).get("against")
    if value is not None and not isinstance(value, str):
        _complain(config, "against", "`against` in [tool.idlc.breaking] must be a string", report)
        return None
    return value


def selection(config: Config, report: Report) -> Selection:
    """Return which warnings `[tool.idlc.check]` asks for."""
    from idlc.checks.select import is_selector, selection

    table = _table(config, "check", ("select", "ignore", "per-path"), report)
    per_path = table.get("per-path", {})
    if not isinstance(per_path, dict):
        _complain(config, "per-path", "`per-path` in [tool.idlc.check] must be a table", report)
        return selection({})
    lists = [(key, table[key]) for key in ("select", "ignore") if key in table]
    for key, words in (*lists, *per_path.items()):
        if not isinstance(words, list) or not all(isinstance(word, str) for word in words):
            message = f"`{key}` in [tool.idlc.check] must be a list of strings"
            _complain(config, key, message, report)
            return selection({})
        for word in words:
            if not is_selector(word):
                message = f"`{key}` in [tool.idlc.check] has `{word}`, which means no rule"
                _complain(config, key, message, report)
    return selection(table)


def _complain(config: Config, key: str, message: str, report: Report) -> None:
    if config.source is not None:
        report.add(wrong(config.source, key, message))


def _table(config: Config, name: str, known: Iterable[str], report: Report) -> Mapping[str, Any]:
    table = config.tables.get(name, {})
    for key in table:
        if key not in known and config.source is not None:
            message = f"unknown setting `{key}` in [tool.idlc.{name}]"
            hint = did_you_mean(key, known) or f"the settings are {_listed(known)}"
            report.add(wrong(config.source, key, message, hint))
    return table


def _listed(words: Iterable[str]) -> str:
    return ", ".join(f"`{word}`" for word in words)


def _allowance(config: Config, entry: Mapping[str, Any], report: Report) -> Allowance | None:
    from idlc.breaking.allow import Allowance

    problem = _problem(entry)
    if problem is not None:
        at = entry.get("at")
        which = f"the entry for `{at}`" if isinstance(at, str) else "an entry"
        message = f"{which} in [[tool.idlc.breaking.allow]] {problem}"
        if config.source is not None:
            report.add(BAD_CONFIG.of(config.source.path, message))
        return None
    return Allowance(entry["at"], entry["reason"], _day(entry["until"]), entry.get("code"))


def _problem(entry: Mapping[str, Any]) -> str | None:
    """Return what is wrong with an entry."""
    for key in entry:
        if key not in _ENTRY:
            return f"has no setting `{key}`"
    for key, what in (
        ("at", "the type or field that it is about"),
        ("reason", "why the change is made nevertheless"),
    ):
        if not isinstance(entry.get(key), str) or not entry[key].strip():
            return f"needs `{key}`, {what}"
    if not _day(entry.get("until")):
        return "needs `until`, its last day, as in 2030-12-31"
    code = entry.get("code")
    if code is not None and (code not in CODES or not code.startswith("IDL5")):
        return f"has `{code}`, which is no code of a breaking change"
    return None


def _day(value: object) -> str:
    """Return a day as YYYY-MM-DD, empty if it is none."""
    if isinstance(value, datetime.date):
        return value.isoformat()[:10]
    try:
        return datetime.date.fromisoformat(str(value)).isoformat()
    except ValueError:
        return ""
