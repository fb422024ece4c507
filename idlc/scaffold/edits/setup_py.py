"""Adding a console script to a setup.py, with entry points of any shape.

In: the file's text. Out: the text with another entry, all else untouched, or a refusal with the
line to add by hand. An existing entry changes nothing.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeAlias

import libcst as cst

from idlc.check.package.installation import check_setup
from idlc.diagnostics.report import apply
from idlc.diagnostics.source import Source
from idlc.project.edits import Edited, Outcome, Refused, Script, already_taken, split
from idlc.scaffold.edits.python_text import appended, assignments, constants, parsed, quoted, string

Edit: TypeAlias = Callable[[str], Outcome]

SECTION = "options.entry_points"
KEY = "console_scripts"
IN_SETUP_CFG = f"below `{KEY} =` in [{SECTION}]"
_HEADER = re.compile(r"\s*\[([^\]]*)\]")


def _section(lines: list[str], name: str) -> tuple[int, int] | None:
    """Return the lines of a section, without its header and the empty lines at its end."""
    headers = [n for n, line in enumerate(lines) if _HEADER.match(line)]
    for at, number in enumerate(headers):
        header = _HEADER.match(lines[number])
        if header and header[1].strip() == name:
            end = headers[at + 1] if at + 1 < len(headers) else len(lines)
            while end > number + 1 and not lines[end - 1].strip():
                end -= 1
            return number + 1, end
    return None


def add_entry(text: str, section: str, script: Script) -> Outcome:
    """Return a text with `name = target` in a section of entries, which is made if need be."""
    lines = text.splitlines(keepends=True)
    body = _section(lines, section)
    if body is None:
        if not lines:
            return Edited(f"\n[{section}]\n{script.line}\n")
        margin = _margin(lines)
        return _inserted(lines, _last(lines), [f"{margin}[{section}]", f"{margin}{script.line}"])
    start, end = body
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
    section = _section(lines, SECTION)
    if section is None:
        gap = "\n" if lines else ""
        if lines and not lines[-1].endswith("\n"):
            lines[-1] += "\n"
        return Edited("".join(lines) + f"{gap}[{SECTION}]\n{KEY} =\n    {script.line}\n")
    start, end = section
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
    """Return the outcome for an existing command: nothing to do, or a refusal; `None` without."""
    for line in lines:
        name, target = split(line.partition("#")[0])
        if name == script.name and target:
            if script.same(line):
                return Edited("")
            return already_taken(script, target, IN_SETUP_CFG)
    return None


def _margin(lines: list[str]) -> str:
    """Return the whitespace before the last line with text."""
    for line in reversed(lines):
        if line.strip():
            return line[: len(line) - len(line.lstrip())]
    return ""


def _last(lines: list[str]) -> int:
    """Return the index after the last line with text."""
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


ENTRY_POINT_KEY = "console_scripts"
IN_SETUP = "to `console_scripts` in the `entry_points` of setup()"

#: A node and its replacement, or the reason why there is none.
Change: TypeAlias = tuple[cst.CSTNode, cst.CSTNode] | str


def add_to_setup(text: str, script: Script) -> Outcome:
    """Return the file with a console script."""
    module = parsed(text)
    if module is None:
        return _refusal(script, "this is not valid Python")
    strings = constants(module)
    texts = setup_strings(module, strings)
    if any(script.same(value) for value in texts):
        return Edited(text)
    calls = setup_calls(module)
    if len(calls) != 1:
        return _refusal(script, f"there are {len(calls) or 'no'} calls of setup()")
    change = _edit(module, calls[0], script, strings)
    if isinstance(change, str):
        return _refusal(script, change)
    result = module.deep_replace(*change)
    assert isinstance(result, cst.Module)
    return _checked(result.code, script, texts)


def _checked(text: str, script: Script, before: list[str]) -> Outcome:
    """Return the edited text if it is sound: valid, with the entry, nothing lost."""
    module = parsed(text)
    after = setup_strings(module, constants(module)) if module else []
    if not any(script.same(line) for value in after for line in value.splitlines()):
        return _refusal(script, "the entry points are written in a way that idlc does not know")
    lost = set(_lines(before)) - set(_lines(after))
    if lost:
        return _refusal(script, "the entry points are written in a way that idlc does not know")
    return Edited(text)


def _lines(texts: list[str]) -> list[str]:
    return [line.strip() for text in texts for line in text.splitlines()]


def _refusal(script: Script, why: str) -> Refused:
    return Refused(why, f"'{script.line}',", IN_SETUP)


def setup_strings(module: cst.Module | None, strings: Mapping[str, str]) -> list[str]:
    """Return every string of a module that the source shows."""
    texts: list[str] = []

    class Strings(cst.CSTVisitor):
        def on_visit(self, node: cst.CSTNode) -> bool:
            value = string(node, strings) if isinstance(node, cst.BaseExpression) else None
            if value is not None:
                texts.append(value)
            return value is None

    if module is not None:
        module.visit(Strings())
    return texts


def setup_calls(module: cst.Module) -> list[cst.Call]:
    """Return the calls of setuptools' function, however it was imported."""
    names = {"setup"}
    calls: list[cst.Call] = []

    class SetupCalls(cst.CSTVisitor):
        def visit_ImportAlias(self, node: cst.ImportAlias) -> None:  # noqa: N802
            if node.evaluated_name == "setup" and node.evaluated_alias:
                names.add(node.evaluated_alias)

        def visit_Call(self, node: cst.Call) -> None:  # noqa: N802
            function = node.func
            called = function.attr if isinstance(function, cst.Attribute) else function
            if isinstance(called, cst.Name) and called.value in names:
                calls.append(node)

    module.visit(SetupCalls())
    return calls


def _edit(module: cst.Module, call: cst.Call, script: Script, strings: Mapping[str, str]) -> Change:
    """Return a node and its replacement, or why there is none."""
    argument = next((a for a in call.args if a.keyword and a.keyword.value == "entry_points"), None)
    if argument is not None:
        return _entry_points(argument.value, script, strings, module)
    if any(arg.star == "**" for arg in call.args):
        return "setup() gets its arguments from elsewhere (`**`)"
    return call, _with_argument(call, script, module)


def _named(name: cst.Name, module: cst.Module) -> cst.BaseExpression | str:
    """Return the value of a variable that is assigned in one place."""
    values = [value for variable, value in assignments(module) if variable == name.value]
    if len(values) == 1:
        return values[0]
    return f"`{name.value}` is not set in exactly one place"


def _with_argument(call: cst.Call, script: Script, module: cst.Module) -> cst.Call:
    """Return the call with `entry_points=` as a last argument, laid out like the others."""
    literals = [arg.value for arg in call.args]
    text = quoted(script.line, literals).value
    key = quoted(ENTRY_POINT_KEY, literals).value
    space = call.whitespace_before_args
    last = call.args[-1] if call.args else None
    end = last.whitespace_after_arg if last else cst.SimpleWhitespace("")
    if last and isinstance(last.comma, cst.Comma):
        end = last.comma.whitespace_after
    spread = isinstance(space, cst.ParenthesizedWhitespace) and isinstance(
        end, cst.ParenthesizedWhitespace
    )
    outer = space.last_line.value if isinstance(space, cst.ParenthesizedWhitespace) else ""
    step = "\n" + module.default_indent if spread else ""
    source = (
        f"{{\n{outer}    {key}: [\n{outer}        {text},\n{outer}    ],\n{outer}}}"
        if step
        else f"{{{key}: [{text}]}}"
    )
    new = cst.Arg(
        cst.parse_expression(source, module.config_for_parsing),
        keyword=cst.Name("entry_points"),
        equal=cst.AssignEqual(cst.SimpleWhitespace(""), cst.SimpleWhitespace("")),
    )
    if last is None:
        return call.with_changes(args=[new])
    between: cst.BaseParenthesizableWhitespace = cst.SimpleWhitespace(" ")
    if isinstance(space, cst.ParenthesizedWhitespace) and isinstance(
        end, cst.ParenthesizedWhitespace
    ):
        between = end.with_changes(last_line=space.last_line)
        first = cst.TrailingWhitespace(newline=end.first_line.newline)
        end = end.with_changes(first_line=first, empty_lines=[])
        new = new.with_changes(comma=cst.Comma(whitespace_after=end))
    plain = cst.SimpleWhitespace("")
    before = last.with_changes(
        comma=cst.Comma(whitespace_after=between), whitespace_after_arg=plain
    )
    return call.with_changes(args=[*call.args[:-1], before, new])


def _entry_points(
    value: cst.BaseExpression, script: Script, strings: Mapping[str, str], module: cst.Module
) -> Change:
    """Find the change to the value of `entry_points`."""
    match value:
        case cst.Name():
            named = _named(value, module)
            if isinstance(named, (str, cst.Name)):
                return str(named) if isinstance(named, str) else "the entry points are a variable"
            return _entry_points(named, script, strings, module)
        case cst.Dict():
            return _in_dict(value, script, strings, module)
        case cst.Call(func=cst.Name("dict")):
            for arg in value.args:
                if arg.keyword and arg.keyword.value == ENTRY_POINT_KEY:
                    return _scripts(arg.value, script, strings, module)
        case cst.SimpleString():
            return _in_literal(value, lambda body: add_entry(body, ENTRY_POINT_KEY, script))
    return "the entry points are not written out as a dictionary or a text"


def _in_dict(
    value: cst.Dict, script: Script, strings: Mapping[str, str], module: cst.Module
) -> Change:
    for element in value.elements:
        if isinstance(element, cst.DictElement) and string(element.key, strings) == ENTRY_POINT_KEY:
            return _scripts(element.value, script, strings, module)
    if any(isinstance(element, cst.StarredDictElement) for element in value.elements):
        return "the entry points come from elsewhere (`**`)"
    keys = [e.key for e in value.elements if isinstance(e, cst.DictElement)]
    scripts = cst.List([cst.Element(quoted(script.line, keys))])
    return value, appended(value, cst.DictElement(quoted(ENTRY_POINT_KEY, keys), scripts))


def _scripts(
    value: cst.BaseExpression, script: Script, strings: Mapping[str, str], module: cst.Module
) -> Change:
    """Find the change to the value of `console_scripts`."""
    match value:
        case cst.Name():
            named = _named(value, module)
            if isinstance(named, (str, cst.Name)):
                return str(named) if isinstance(named, str) else "the scripts are a variable"
            return _scripts(named, script, strings, module)
        case cst.List() | cst.Tuple():
            return _in_list(value, script, strings)
        case cst.SimpleString() if len(value.quote) == 3:
            return _in_literal(value, lambda body: add_line(body, script))
        case cst.SimpleString():
            both = cst.List([cst.Element(value)])
            new = _in_list(both, script, strings)
            return new if isinstance(new, str) else (value, new[1])
        case cst.BinaryOperation(operator=cst.Add()):
            for side in (value.left, value.right):
                if isinstance(side, (cst.List, cst.BinaryOperation)):
                    return _scripts(side, script, strings, module)
    return "the console scripts are not written out as a list"


def _in_list(value: cst.List | cst.Tuple, script: Script, strings: Mapping[str, str]) -> Change:
    values = [element.value for element in value.elements]
    for item in values:
        name, target = split(string(item, strings) or "")
        if name == script.name:
            return already_taken(script, target, IN_SETUP).why
    return value, appended(value, cst.Element(quoted(script.line, values)))


def _in_literal(value: cst.SimpleString, edit: Edit) -> Change:
    """Find the change to a text of several lines."""
    if len(value.quote) != 3 or "\\" in value.value or "b" in value.prefix.lower():
        return "the entry points are a text with escapes or on one line"
    start = len(value.prefix) + 3
    new = edit(value.value[start:-3])
    if isinstance(new, Refused):
        return new.why
    return value, value.with_changes(value=value.value[:start] + new.text + value.value[-3:])


if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

PYPROJECT = "pyproject.toml"
SETUP_CFG = "setup.cfg"
SETUP_PY = "setup.py"
TABLE = "project.scripts"


def add_console_script(files: Mapping[str, str], script: Script) -> tuple[str, Outcome]:
    """Return the file of a package to edit, and the edit; `files` are the existing ones.

    The order is setuptools' own: `[project]` outranks setup.cfg, which outranks setup.py.
    """
    project = _table(files.get(PYPROJECT, ""), "project")
    if isinstance(project, Refused):
        return PYPROJECT, project._replace(line=_line(script))
    dynamic = project.get("dynamic", ())
    if project and not {"scripts", "entry-points"}.intersection(dynamic):
        return PYPROJECT, _in_pyproject(files[PYPROJECT], project, script)
    if SETUP_CFG in files and _declares_scripts(files[SETUP_CFG]):
        return SETUP_CFG, add_to_cfg(files[SETUP_CFG], script)
    if SETUP_PY in files:
        return SETUP_PY, add_to_setup(files[SETUP_PY], script)
    if SETUP_CFG in files:
        return SETUP_CFG, add_to_cfg(files[SETUP_CFG], script)
    why = "there is no setup.py, and no setup.cfg or pyproject.toml that describes a package"
    return SETUP_PY, Refused(why, f"'{script.line}',", "to the package's `console_scripts`")


def _declares_scripts(text: str) -> bool:
    return re.search(rf"(?m)^\s*\[\s*{re.escape(SECTION)}\s*\]", text) is not None


def _table(text: str, name: str) -> dict[str, Any] | Refused:
    try:
        table = tomllib.loads(text).get(name, {})
    except tomllib.TOMLDecodeError:
        return Refused("this is not valid TOML", "", f"to [{TABLE}]")
    return table if isinstance(table, dict) else {}


def _line(script: Script) -> str:
    key = script.name if re.fullmatch(r"[A-Za-z0-9_-]+", script.name) else f'"{script.name}"'
    return f'{key} = "{script.target}"'


def _in_pyproject(text: str, project: dict[str, Any], script: Script) -> Outcome:
    """Return a pyproject.toml with another line in `[project.scripts]`, added if missing."""
    where = f"to [{TABLE}]"
    scripts = project.get("scripts", {})
    if script.name in scripts:
        if script.same(f"{script.name} = {scripts[script.name]}"):
            return Edited(text)
        refused = already_taken(script, str(scripts[script.name]), where)
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
    return _checked_scripts("".join(new), project, script, where)


def _checked_scripts(text: str, before: dict[str, Any], script: Script, where: str) -> Outcome:
    """Return the edited text if it differs only by the script."""
    expected = {**before, "scripts": {**before.get("scripts", {}), script.name: script.target}}
    if _table(text, "project") == expected:
        return Edited(text)
    return Refused("the scripts are written in a way that idlc does not edit", _line(script), where)


WHERE = "to `data_files` in the call of setup()"


def add_launch(text: str, package: str, path: str) -> Outcome:
    """Return a setup.py that installs a launch file.

    One that names `launch` anywhere does so already; one without `data_files` installs none.
    """
    line = f"('share/{package}/launch', ['{path}']),"
    module = parsed(text)
    if module is None:
        return Refused("this is not valid Python", line, WHERE)
    if any("launch" in value for value in setup_strings(module, constants(module))):
        return Edited(text)
    calls = setup_calls(module)
    values = _keyword_values(calls, "data_files")
    if not values:
        return Edited(text)
    listed = [value for value in values if isinstance(value, cst.List)]
    if len(calls) != 1 or len(listed) != 1:
        return Refused("the data files are not written out as a list", line, WHERE)
    like = [part for element in listed[0].elements for part in _literals(element.value)]
    folder, file = (quoted(word, like).value for word in (f"share/{package}/launch", path))
    new = cst.Element(cst.parse_expression(f"({folder}, [{file}])"))
    changed = module.deep_replace(listed[0], appended(listed[0], new))
    assert isinstance(changed, cst.Module)
    return Edited(changed.code)


def add_interfaces(
    text: str, package: str, keys: Iterable[str], folders: Mapping[str, bool]
) -> str:
    """Return a setup.py that installs interfaces, their classes and libraries for C++ tools.

    Computed values stay; `idlc check` and the build report missing ones then.
    """
    problems = check_setup(Source("setup.py", text), package, {key: key for key in keys}, folders)
    return apply(text, (edit for problem in problems for edit in problem.edits))[0]


def _keyword_values(calls: Iterable[cst.Call], keyword: str) -> list[cst.BaseExpression]:
    """Return the values of a keyword argument in calls."""
    arguments = (arg for call in calls for arg in call.args)
    return [arg.value for arg in arguments if arg.keyword and arg.keyword.value == keyword]


def _literals(value: cst.BaseExpression) -> list[cst.BaseExpression]:
    if isinstance(value, cst.Tuple):
        return [element.value for element in value.elements]
    return []
