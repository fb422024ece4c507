"""Console scripts in texts of sections and lines: setup.cfg, and entry points as one string."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TypeAlias

from idlc.scaffold.edits.outcome import Edited, Outcome, Script, split, taken

Edit: TypeAlias = Callable[[str], Outcome]

SECTION = "options.entry_points"
KEY = "console_scripts"
WHERE = f"below `{KEY} =` in [{SECTION}]"
_HEADER = re.compile(r"\s*\[([^\]]*)\]")


def _section(lines: list[str], name: str) -> tuple[int, int] | None:
    """Return the lines of a section, without its header and the empty lines at its end."""
    headers = [n for n, line in enumerate(lines) if _HEADER.match(line)]
    for at, number in enumerate(headers):
        found = _HEADER.match(lines[number])
        if found and found[1].strip() == name:
            end = headers[at + 1] if at + 1 < len(headers) else len(lines)
            while end > number + 1 and not lines[end - 1].strip():
                end -= 1
            return number + 1, end
    return None


def add_entry(text: str, section: str, script: Script) -> Outcome:
    """Return a text with `name = target` in a section of entries, which is made if need be."""
    lines = text.splitlines(keepends=True)
    found = _section(lines, section)
    if found is None:
        if not lines:
            return Edited(f"\n[{section}]\n{script.line}\n")
        margin = _margin(lines)
        return _inserted(lines, _last(lines), [f"{margin}[{section}]", f"{margin}{script.line}"])
    start, end = found
    refused = _present(lines[start:end], script)
    if refused is not None:
        return Edited(text) if isinstance(refused, Edited) else refused
    margin = _margin(lines[start:end] or lines)
    return _inserted(lines, end, [margin + script.line])


def add_line(text: str, script: Script) -> Outcome:
    """Return a text of entries, one per line, with one more at its end."""
    lines = text.splitlines(keepends=True)
    present = _present(lines, script)
    if present is not None:
        return Edited(text) if isinstance(present, Edited) else present
    return _inserted(lines, _last(lines), [_margin(lines) + script.line])


def add_to_cfg(text: str, script: Script) -> Outcome:
    """Return a setup.cfg with a console script in its `[options.entry_points]`."""
    lines = text.splitlines(keepends=True)
    found = _section(lines, SECTION)
    if found is None:
        gap = "\n" if lines else ""
        if lines and not lines[-1].endswith("\n"):
            lines[-1] += "\n"
        return Edited("".join(lines) + f"{gap}[{SECTION}]\n{KEY} =\n    {script.line}\n")
    start, end = found
    key = next((n for n in range(start, end) if re.match(rf"{KEY}\s*[=:]", lines[n])), None)
    if key is None:
        return _inserted(lines, end, [f"{KEY} =", f"    {script.line}"])
    last = key + 1
    body_end = key + 1
    while last < end and (lines[last][:1].isspace() or not lines[last].strip()):
        last += 1
        if lines[last - 1].strip():
            body_end = last
    own = re.sub(rf"^{KEY}\s*[=:]", "", lines[key])
    body = [own, *lines[key + 1 : body_end]]
    present = _present(body, script)
    if present is not None:
        return Edited(text) if isinstance(present, Edited) else present
    margin = _margin(lines[key + 1 : body_end]) or "    "
    return _inserted(lines, body_end, [margin + script.line])


def _present(lines: list[str], script: Script) -> Outcome | None:
    """Return what is so if the command is there: nothing to do, or another target."""
    for line in lines:
        name, target = split(line.partition("#")[0])
        if name == script.name and target:
            if script.same(line):
                return Edited("")
            return taken(script, target, WHERE)
    return None


def _margin(lines: list[str]) -> str:
    """Return the white space before the last line that has any text."""
    for line in reversed(lines):
        if line.strip():
            return line[: len(line) - len(line.lstrip())]
    return ""


def _last(lines: list[str]) -> int:
    """Return where a line goes that is to follow the last one with text."""
    end = len(lines)
    while end and not lines[end - 1].strip():
        end -= 1
    return end


def _inserted(lines: list[str], at: int, new: list[str]) -> Outcome:
    """Return the text with new lines before line `at`, with the line ends of the others."""
    ending = "\r\n" if lines and lines[0].endswith("\r\n") else "\n"
    before, after = lines[:at], lines[at:]
    if before and not before[-1].endswith(("\n", "\r")):
        before[-1] += ending
    return Edited("".join((*before, *(line + ending for line in new), *after)))
