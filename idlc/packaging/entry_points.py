"""Adding a console script to a setup.py, with entry points of any shape.

In: the file's text. Out: the text with another entry, all else untouched, or a refusal with the
line to add by hand. An existing entry changes nothing.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from contextlib import suppress
from fnmatch import fnmatchcase
from posixpath import normpath
from typing import Any, NamedTuple, TypeAlias

from idlc.diagnostics.report import Edit, apply
from idlc.diagnostics.source import Source, Span
from idlc.packaging import setup_edits
from idlc.packaging.files import (
    SETUP_CFG,
    SETUP_PY,
    Edited,
    Outcome,
    Refused,
    SetupCfg,
)
from idlc.packaging.layout import PackageLayout
from idlc.packaging.setup_py import DataFiles, Setup, name_of_call, parse, range_of
from idlc.project.settings import SETTINGS_FILE, toml

SECTION = "options.entry_points"
KEY = "console_scripts"
UNKNOWN = "idlc cannot parse the entry points"
IN_SETUP_CFG = f"below `{KEY} =` in [{SECTION}]"
_HEADER = re.compile(r"\s*\[([^\]]*)\]")


class ConsoleScript(NamedTuple):
    """A console script: the command and the function that it calls."""

    name: str
    target: str

    @property
    def line(self) -> str:
        """The entry in `console_scripts`."""
        return f"{self.name} = {self.target}"

    def same(self, entry: str) -> bool:
        """Return whether an entry is the same, with any whitespace."""
        return split_entry(entry) == (self.name, self.target)


def split_entry(entry: str) -> tuple[str, str]:
    """Return the command and the target of an entry; an empty target if there is none."""
    name, _, target = entry.partition("=")
    return name.strip(), "".join(target.split())


def already_taken(script: ConsoleScript, target: str, where: str) -> Refused:
    """Return the refusal of a command that calls something else already."""
    why = f"`{script.name}` is already the command for `{target}`"
    return Refused(why, script.line, where)


def _section(lines: list[str], name: str) -> tuple[int, int] | None:
    """Return the lines of a section, without its header and the empty lines at its end."""
    headers = [n for n, line in enumerate(lines) if _HEADER.match(line)]
    for number, end in zip(headers, [*headers[1:], len(lines)], strict=False):
        header = _HEADER.match(lines[number])
        if header and "".join(header[1].split()) == name:
            return number + 1, max(_last(lines[:end]), number + 1)
    return None


def _add_entry(text: str, script: ConsoleScript, *, in_section: bool) -> Outcome:
    """Return a text of entries with one more, at its end or in a section, made if need be."""
    lines = text.splitlines(keepends=True)
    body = _section(lines, KEY) if in_section else (0, _last(lines))
    if body is not None:
        return _with_entry(lines, *body, script, _margin(lines[slice(*body)] or lines))
    if not lines:
        return Edited(f"\n[{KEY}]\n{script.line}\n")
    margin = _margin(lines)
    return _inserted(lines, _last(lines), [f"{margin}[{KEY}]", f"{margin}{script.line}"])


def add_to_cfg(text: str, script: ConsoleScript) -> Outcome:
    """Return a setup.cfg with a console script in its `[options.entry_points]`."""
    try:
        before = SetupCfg(text).lines(SECTION, KEY)
    except ValueError:
        return Refused("this is not a valid setup.cfg", script.line, IN_SETUP_CFG)
    outcome = _with_script_in_cfg(text, script)
    if isinstance(outcome, Refused) or outcome.text == text:
        return outcome
    with suppress(ValueError):
        if SetupCfg(outcome.text).lines(SECTION, KEY) == (*before, script.line):
            return outcome
    return Refused(UNKNOWN, script.line, IN_SETUP_CFG)


def _with_script_in_cfg(text: str, script: ConsoleScript) -> Outcome:
    """Return a setup.cfg with another line, which nobody has read yet."""
    lines = text.splitlines(keepends=True)
    section = _section(lines, SECTION)
    if section is None:
        gap = [""] if lines else []
        new = [*gap, f"[{SECTION}]", f"{KEY} =", f"    {script.line}"]
        return _inserted(lines, len(lines), new)
    start, end = section
    key = next((n for n in range(start, end) if re.match(rf"{KEY}\s*[=:]", lines[n])), None)
    if key is None:
        return _inserted(lines, end, [f"{KEY} =", f"    {script.line}"])
    others = (n for n in range(key + 1, end) if lines[n].strip() and not lines[n][0].isspace())
    end = max(_last(lines[: next(others, end)]), key + 1)
    return _with_entry(lines, key, end, script, _margin(lines[key + 1 : end]) or "    ")


def _with_entry(
    lines: list[str], start: int, end: int, script: ConsoleScript, margin: str
) -> Outcome:
    """Return a text with another line in a range of entries; a command has one entry."""
    for line in lines[start:end]:
        entry = re.sub(rf"^{KEY}\s*[=:]", "", line)
        name, target = split_entry(entry.partition("#")[0])
        if name == script.name and target:
            if script.same(entry):
                return Edited("".join(lines))
            return already_taken(script, target, IN_SETUP_CFG)
    return _inserted(lines, end, [margin + script.line])


def _margin(lines: list[str]) -> str:
    """Return the whitespace before the last line with text."""
    line = "".join(lines[: _last(lines)][-1:])
    return line[: len(line) - len(line.lstrip())]


def _last(lines: list[str]) -> int:
    """Return the index after the last line with text."""
    return max((number for number, line in enumerate(lines, 1) if line.strip()), default=0)


def _inserted(lines: list[str], at: int, new: list[str]) -> Edited:
    """Return the text with new lines before line `at`, with the line ends of the others."""
    ending = "\r\n" if lines and lines[0].endswith("\r\n") else "\n"
    before, after = lines[:at], lines[at:]
    if before and not before[-1].endswith(("\n", "\r")):
        before[-1] += ending
    return Edited("".join((*before, *(line + ending for line in new), *after)))


IN_SETUP = f"to `{KEY}` in the `entry_points` of setup()"

#: The edits of a file, or the reason why there are none.
EntryPointEdits: TypeAlias = tuple[Edit, ...] | str


def add_to_setup(text: str, script: ConsoleScript) -> Outcome:
    """Return the file with a console script."""
    setup = Setup(Source(SETUP_PY, text))
    if parse(text) is None:
        return _refusal(script, "this is not valid Python")
    lines = _lines(setup)
    if any(map(script.same, lines)):
        return Edited(text)
    if setup.call is None:
        return _refusal(script, f"there are {len(setup.calls) or 'no'} calls of setup()")
    change = _with_script(setup, setup.call, script)
    if isinstance(change, str):
        return _refusal(script, change)
    new = apply(text, change)[0]
    after = _lines(Setup(Source(SETUP_PY, new)))
    if not any(map(script.same, after)) or not lines <= after:
        return _refusal(script, UNKNOWN)
    return Edited(new)


def _lines(setup: Setup) -> set[str]:
    """Return the lines of every text that a file shows."""
    texts = (
        node.value if isinstance(node, ast.Constant) else setup.text(node)
        for node in setup.nodes
        if isinstance(node, ast.expr)
    )
    return {line.strip() for text in texts if isinstance(text, str) for line in text.splitlines()}


def _refusal(script: ConsoleScript, why: str) -> Refused:
    return Refused(why, f"'{script.line}',", IN_SETUP)


def _with_script(setup: Setup, call: ast.Call, script: ConsoleScript) -> EntryPointEdits:
    """Return the edits that give setup() a console script."""
    passed = {keyword.arg: keyword.value for keyword in call.keywords}
    if "entry_points" in passed:
        return _in_entry_points(setup, passed["entry_points"], script)
    if None in passed:
        return "setup() takes its arguments from other code (`**`)"
    points = f"{{'{KEY}': ['{script.line}']}}"
    if setup_edits.is_spread(setup.source, call):
        margin, step = setup_edits.margin_of(setup.source, call), setup_edits.step_of(setup.source)
        inner = f"{margin}{step}'{KEY}': [\n{margin}{step * 2}'{script.line}',\n{margin}{step}],"
        points = f"{{\n{inner}\n{margin}}}"
    return setup_edits.append_element(setup.source, call, f"entry_points={points}")


def _in_entry_points(setup: Setup, node: ast.expr, script: ConsoleScript) -> EntryPointEdits:
    """Return the edits of the value of `entry_points`."""
    value = setup.value(node)
    if isinstance(value, ast.Constant) and isinstance(value.value, str):
        return _in_literal(setup, value, script, in_section=True)
    if isinstance(value, ast.Dict):
        scripts = dict(zip(map(setup.text, value.keys), value.values, strict=True))
        if KEY not in scripts and None in value.keys:
            return "the entry points come from other code (`**`)"
    elif isinstance(value, ast.Call) and name_of_call(value) == "dict":
        scripts = {keyword.arg: keyword.value for keyword in value.keywords}
    else:
        scripts = {}
    if KEY in scripts:
        return _in_scripts(setup, scripts[KEY], script)
    if isinstance(value, ast.Dict):
        return setup_edits.append_element(setup.source, value, f"'{KEY}': ['{script.line}']")
    return _unknown(node, value) or "the entry points are not a literal dictionary or string"


def _unknown(node: ast.expr, value: ast.expr | None) -> str:
    """Return the problem with a name whose value is not known."""
    if value is None and isinstance(node, ast.Name):
        return f"`{node.id}` is not set in exactly one place"
    return ""


def _in_scripts(setup: Setup, node: ast.expr, script: ConsoleScript) -> EntryPointEdits:
    """Return the edits of the value of `console_scripts`."""
    value = setup.value(node)
    if isinstance(value, ast.BinOp) and isinstance(value.op, ast.Add):
        for side in (value.left, value.right):
            if isinstance(side, (ast.List, ast.BinOp)):
                return _in_scripts(setup, side, script)
    if isinstance(value, (ast.List, ast.Tuple)) and _is_enclosed(setup.source, value):
        for element in value.elts:
            name, target = split_entry(setup.text(element) or "")
            if name == script.name:
                return already_taken(script, target, IN_SETUP).why
        return setup_edits.append_element(setup.source, value, f"'{script.line}'")
    if isinstance(value, ast.Constant) and isinstance(value.value, str):
        start, end = range_of(setup.source, value)
        literal = setup.source.text[start:end]
        if literal.endswith(("'''", '"""')):
            return _in_literal(setup, value, script, in_section=False)
        name, target = split_entry(value.value)
        if name == script.name:
            return already_taken(script, target, IN_SETUP).why
        line = f"'{script.line}'".replace("'", literal[-1])
        return (Edit(Span(setup.source, start, end), f"[{literal}, {line}]"),)
    return _unknown(node, value) or "the console scripts are not a literal list"


def _is_enclosed(source: Source, node: ast.List | ast.Tuple) -> bool:
    """Return whether a list or tuple has brackets of its own."""
    start, end = range_of(source, node)
    inside = source.text[start + 1 : end - 1]
    return source.text[start] in "[(" and parse(f"({inside}\n)") is not None


def _in_literal(
    setup: Setup, value: ast.Constant, script: ConsoleScript, *, in_section: bool
) -> EntryPointEdits:
    """Return the edit of a text of several lines."""
    start, end = range_of(setup.source, value)
    literal = re.fullmatch(r"(?s)\w*('{3}|\"{3})(.*)\1", setup.source.text[start:end])
    if literal is None or re.sub(r"\r\n?", "\n", literal[2]) != value.value:
        return "the entry points are a text with escapes or on one line"
    new = _add_entry(literal[2], script, in_section=in_section)
    if isinstance(new, Refused):
        return new.why
    return (Edit(Span(setup.source, start + literal.start(2), end - 3), new.text),)


def add_console_script(files: Mapping[str, str], script: ConsoleScript) -> tuple[str, Outcome]:
    """Return the file of a package to edit, and the edit; `files` are the existing ones.

    The order is setuptools' own: `[project]` outranks setup.cfg, which outranks setup.py.
    """
    for name in ("project", "tool.poetry"):
        project = _table(files.get(SETTINGS_FILE, ""), name)
        if isinstance(project, Refused):
            return SETTINGS_FILE, project._replace(line=_line(script))
        dynamic = project.get("dynamic", ())
        if project and not {"scripts", "entry-points"}.intersection(dynamic):
            return SETTINGS_FILE, _in_pyproject(files[SETTINGS_FILE], name, project, script)
    if SETUP_PY in files and not _lists_entry_points(files.get(SETUP_CFG, "")):
        return SETUP_PY, add_to_setup(files[SETUP_PY], script)
    if SETUP_CFG in files:
        return SETUP_CFG, add_to_cfg(files[SETUP_CFG], script)
    why = "there is no setup.py, and no setup.cfg or pyproject.toml that describes a package"
    return SETUP_PY, Refused(why, f"'{script.line}',", "to the package's `console_scripts`")


def _lists_entry_points(text: str) -> bool:
    """Return whether a setup.cfg lists entry points, which then outrank those in setup.py."""
    try:
        return SetupCfg(text).has_section(SECTION)
    except ValueError:
        return False


def _table(text: str, name: str) -> dict[str, Any] | Refused:
    """Return a table of a pyproject.toml, empty if there is none."""
    try:
        table: Any = toml(text)
    except ValueError:
        return Refused("this is not valid TOML", "", f"to [{name}.scripts]")
    for key in name.split("."):
        table = table.get(key) if isinstance(table, dict) else None
    return table if isinstance(table, dict) else {}


def _line(script: ConsoleScript) -> str:
    key = script.name if re.fullmatch(r"[A-Za-z0-9_-]+", script.name) else f'"{script.name}"'
    return f'{key} = "{script.target}"'


def _in_pyproject(text: str, name: str, project: dict[str, Any], script: ConsoleScript) -> Outcome:
    """Return a pyproject.toml with another line in the table of scripts, added if missing."""
    why, table = "idlc cannot edit the scripts", f"{name}.scripts"
    refused = Refused(why, _line(script), f"to [{table}]")
    scripts = project.get("scripts", {})
    if script.name in scripts:
        if script.same(f"{script.name} = {scripts[script.name]}"):
            return Edited(text)
        why = already_taken(script, str(scripts[script.name]), refused.where).why
        return refused._replace(why=why)
    lines = text.splitlines(keepends=True)
    section = _section(lines, table)
    at, header = (section[1], []) if section else (len(lines), ["", f"[{table}]"])
    edited = _inserted(lines, at, [*header, _line(script)])
    expected = {**project, "scripts": {**scripts, script.name: script.target}}
    return edited if _table(edited.text, name) == expected else refused


def add_launch(text: str, package: str, path: str) -> tuple[str, str]:
    """Return a setup.py that installs a launch file, and the line that it lacks, if any.

    The line is for a setup.py that idlc cannot edit or that computes its `data_files`.
    """
    element = f"('share/{package}/launch', ['{path}'])"
    setup = Setup(Source(SETUP_PY, text))
    entries, listed = setup.data_files, setup.list_of("data_files")
    if any(_installs(entry, path) for entry in entries or ()):
        return text, ""
    if setup.call is None or listed is None or entries is None:
        return text, element
    return apply(text, setup_edits.append_element(setup.source, listed, element))[0], ""


def _installs(entry: DataFiles, path: str) -> bool:
    """Return whether an entry of `data_files` installs a file; computed names of files may be it.

    A pattern fits only files in its own folder.
    """
    if entry.files is None:
        return entry.folder is None or "launch" in entry.folder
    return any(
        pattern.count("/") == path.count("/") and fnmatchcase(path, pattern)
        for pattern in map(normpath, entry.files)
    )


def add_package(text: str, package: str, view: PackageLayout | None) -> tuple[str, str]:
    """Return a setup.py that installs a Python package, and what it lacks, if anything.

    `view` is setuptools' view of the folders, the package's included. What is computed stays.
    """
    setup = Setup(Source(SETUP_PY, text))
    missing = f"add `{package}` to `packages`, unless the code that computes it does so"
    if view is None or (view.installed is None and "packages" in setup.arguments):
        return text, missing
    if view.installed is None or view.installed.covers(package, view.folder(package)):
        return text, ""
    listed = setup.list_of("packages")
    target = setup.value(setup.arguments.get("packages"))
    edits: tuple[Edit, ...] = ()
    if listed is not None:
        edits = setup_edits.append_element(setup.source, listed, f"'{package}'")
    elif isinstance(target, ast.Call):
        end = range_of(setup.source, target)[1]
        edits = (setup_edits.insertion(setup.source, end, f" + ['{package}']"),)
    if not edits:
        return text, f"add `{package}` to `packages` in `{view.installed.place.source.path}`"
    return apply(text, edits)[0], ""
