"""Which file holds a package's console scripts, and adding one there."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from typing import Any

from idlc.scaffold.edits import ini
from idlc.scaffold.edits.outcome import Edited, Outcome, Refused, Script, taken

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

PYPROJECT = "pyproject.toml"
SETUP_CFG = "setup.cfg"
SETUP_PY = "setup.py"
TABLE = "project.scripts"


def add_script(files: Mapping[str, str], script: Script) -> tuple[str, Outcome]:
    """Return which of a package's files to edit, and how; `files` are those that exist.

    The order is setuptools' own: `[project]` outranks setup.cfg, which outranks setup.py.
    """
    project = _table(files.get(PYPROJECT, ""), "project")
    if isinstance(project, Refused):
        return PYPROJECT, project._replace(line=_line(script))
    dynamic = project.get("dynamic", ())
    if project and not {"scripts", "entry-points"}.intersection(dynamic):
        return PYPROJECT, _in_pyproject(files[PYPROJECT], project, script)
    if SETUP_CFG in files and _declares_scripts(files[SETUP_CFG]):
        return SETUP_CFG, ini.add_to_cfg(files[SETUP_CFG], script)
    if SETUP_PY in files:
        from idlc.scaffold.edits import setup_py

        return SETUP_PY, setup_py.add_script(files[SETUP_PY], script)
    if SETUP_CFG in files:
        return SETUP_CFG, ini.add_to_cfg(files[SETUP_CFG], script)
    why = "there is no setup.py, and no setup.cfg or pyproject.toml that describes a package"
    return SETUP_PY, Refused(why, f"'{script.line}',", "to the package's `console_scripts`")


def _declares_scripts(text: str) -> bool:
    return re.search(rf"(?m)^\s*\[\s*{re.escape(ini.SECTION)}\s*\]", text) is not None


def _table(text: str, name: str) -> dict[str, Any] | Refused:
    try:
        found = tomllib.loads(text).get(name, {})
    except tomllib.TOMLDecodeError:
        return Refused("this is not valid TOML", "", f"to [{TABLE}]")
    return found if isinstance(found, dict) else {}


def _line(script: Script) -> str:
    key = script.name if re.fullmatch(r"[A-Za-z0-9_-]+", script.name) else f'"{script.name}"'
    return f'{key} = "{script.target}"'


def _in_pyproject(text: str, project: dict[str, Any], script: Script) -> Outcome:
    """Return a pyproject.toml with a line more in `[project.scripts]`, which is made if need be."""
    where = f"to [{TABLE}]"
    scripts = project.get("scripts", {})
    if script.name in scripts:
        if script.same(f"{script.name} = {scripts[script.name]}"):
            return Edited(text)
        refused = taken(script, str(scripts[script.name]), where)
        return refused._replace(line=_line(script))
    ending = "\r\n" if "\r\n" in text else "\n"
    lines = text.splitlines(keepends=True)
    header = re.compile(r"^\s*\[\s*project\s*\.\s*scripts\s*\]\s*(#.*)?$")
    at = next((n for n, line in enumerate(lines) if header.match(line)), None)
    if at is None and "scripts" in project:
        return Refused(
            "the scripts are written in a way that idlc does not edit", _line(script), where
        )
    if lines and not lines[-1].endswith("\n"):
        lines[-1] += ending
    if at is None:
        new = [*lines, ending, f"[{TABLE}]{ending}", _line(script) + ending]
    else:
        end = next((n for n in range(at + 1, len(lines)) if lines[n].lstrip()[:1] == "["), None)
        end = len(lines) if end is None else end
        while not lines[end - 1].strip():
            end -= 1
        new = [*lines[:end], _line(script) + ending, *lines[end:]]
    return _checked("".join(new), project, script, where)


def _checked(text: str, before: dict[str, Any], script: Script, where: str) -> Outcome:
    """Return the edited text if it says what it said, and the script."""
    wanted = {**before, "scripts": {**before.get("scripts", {}), script.name: script.target}}
    if _table(text, "project") == wanted:
        return Edited(text)
    return Refused("the scripts are written in a way that idlc does not edit", _line(script), where)
