"""Blocks of interfaces, coloured by the grammar that editors use.

A small reader of TextMate grammars: every rule of this one ends within its line.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

_GRAMMAR = Path(__file__).parents[2] / "editors/vscode/syntaxes/rosmsg.tmLanguage.json"
#: The classes of the site's style sheet by scope; the first that a scope begins with counts.
_CLASSES = {
    "comment": "c1",
    "constant.other.unit": "cs",
    "constant.language": "kc",
    "constant.numeric": "m",
    "entity.name.type": "nc",
    "entity.name.namespace": "nn",
    "keyword.operator": "o",
    "keyword": "k",
    "punctuation.definition.comment": "c1",
    "punctuation": "p",
    "storage.modifier": "k",
    "storage.type": "kt",
    "string": "s",
    "variable.other.constant": "no",
    "variable": "n",
}
_FENCE = re.compile(r"(?ms)^(`{3,})([^\n`]*)\n(.*?)^\1$")
_INTERFACE = re.compile(r"(?:msg|srv|action)(?: .*)?|\S+\.(?:msg|srv|action)")


def with_colours(text: str) -> str:
    """Return a document whose blocks of interfaces are HTML."""

    def coloured(fence: re.Match[str]) -> str:
        if not _INTERFACE.fullmatch(fence[2]):
            return fence[0]
        return block(fence[3], fence[2] if "." in fence[2] else "")

    return _FENCE.sub(coloured, text)


def block(text: str, title: str = "") -> str:
    """Return the text of an interface as a line of HTML."""
    lines = ("".join(map(_span, *zip(*tokens(line), strict=True))) for line in text.splitlines())
    head = f'<span class="filename">{escape(title)}</span>' if title else ""
    code = "".join(f"{line}&#10;" for line in lines)
    return f'<div class="highlight">{head}<pre><code>{code}</code></pre></div>'


def tokens(line: str) -> list[tuple[str, str]]:
    """Return the pieces of a line, each with the innermost scope of the grammar."""
    grammar = _grammar()
    found: list[tuple[str, str]] = []
    _read(line, 0, grammar["patterns"], None, "", found)
    return found or [("", "")]


@cache
def _grammar() -> dict[str, Any]:
    grammar: dict[str, Any] = json.loads(_GRAMMAR.read_text(encoding="utf-8"))
    return grammar


@cache
def _regex(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern)


def _rules(patterns: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    """Yield rules with those of the repository in place of their names."""
    for pattern in patterns:
        if "include" not in pattern:
            yield pattern
            continue
        rule = _grammar()["repository"][pattern["include"].removeprefix("#")]
        yield from _rules([rule] if "match" in rule or "begin" in rule else rule["patterns"])


def _read(
    line: str,
    at: int,
    patterns: Sequence[Mapping[str, Any]],
    end: str | None,
    scope: str,
    out: list[tuple[str, str]],
) -> int:
    """Append the pieces of a line up to an `end`, and return where that is."""
    while at < len(line):
        matches = [
            (match.start(), number, match, rule)
            for number, rule in enumerate(_rules(patterns))
            if (match := _regex(rule.get("match") or rule["begin"]).search(line, at)) and match[0]
        ]
        start, _, match, rule = min(matches, default=(len(line) + 1, 0, None, {}))
        stop = _regex(end).search(line, at) if end else None
        if match is None or (stop and stop.start() <= start):
            until = stop.start() if stop else len(line)
            out.append((line[at:until], scope))
            return until
        out.append((line[at:start], scope))
        name = rule.get("name", scope)
        _captured(match, rule.get("captures") or rule.get("beginCaptures", {}), name, out)
        at = match.end()
        if "begin" in rule:
            at = _read(line, at, rule.get("patterns", ()), rule["end"], name, out)
    return at


def _captured(
    match: re.Match[str], captures: Mapping[str, Any], scope: str, out: list[tuple[str, str]]
) -> None:
    at = match.start()
    for number, capture in captures.items():
        start, end = match.span(int(number))
        if start < 0:
            continue
        out.append((match.string[at:start], scope))
        if "patterns" in capture:
            _read(match[int(number)], 0, capture["patterns"], None, scope, out)
        else:
            out.append((match[int(number)], capture["name"]))
        at = end
    out.append((match.string[at : match.end()], scope))


def style(scope: str) -> str:
    """Return the class of a scope in the style sheet; empty for text without a colour."""
    return next((name for start, name in _CLASSES.items() if scope.startswith(start)), "")


def _span(text: str, scope: str) -> str:
    name = style(scope)
    return f'<span class="{name}">{escape(text)}</span>' if name and text else escape(text)
