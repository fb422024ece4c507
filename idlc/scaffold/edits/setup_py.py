"""Adding a console script to a setup.py, whatever shape its entry points have.

In: the file's text. Out: the text with one entry more, all else untouched, or a refusal with the
line to add by hand. An entry that is there already changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

import libcst as cst

from idlc.scaffold.edits import ini
from idlc.scaffold.edits.outcome import Edited, Outcome, Refused, Script, split, taken
from idlc.scaffold.edits.python_text import appended, assignments, constants, parsed, quoted, string

KEY = "console_scripts"
WHERE = "to `console_scripts` in the `entry_points` of setup()"

#: A node and what is to stand in its place, or why nothing can.
Change: TypeAlias = tuple[cst.CSTNode, cst.CSTNode] | str


def add_script(text: str, script: Script) -> Outcome:
    """Return the file with a console script."""
    module = parsed(text)
    if module is None:
        return _refusal(script, "this is not valid Python")
    known = constants(module)
    found = strings(module, known)
    if any(script.same(one) for one in found):
        return Edited(text)
    calls = setup_calls(module)
    if len(calls) != 1:
        return _refusal(script, f"there are {len(calls) or 'no'} calls of setup()")
    change = _edit(module, calls[0], script, known)
    if isinstance(change, str):
        return _refusal(script, change)
    result = module.deep_replace(*change)
    assert isinstance(result, cst.Module)
    return _checked(result.code, script, found)


def _checked(text: str, script: Script, before: list[str]) -> Outcome:
    """Return the edited text if it is sound: valid, with the entry, nothing lost."""
    module = parsed(text)
    after = strings(module, constants(module)) if module else []
    if not any(script.same(line) for one in after for line in one.splitlines()):
        return _refusal(script, "the entry points are written in a way that idlc does not know")
    lost = set(_lines(before)) - set(_lines(after))
    if lost:
        return _refusal(script, "the entry points are written in a way that idlc does not know")
    return Edited(text)


def _lines(texts: list[str]) -> list[str]:
    return [line.strip() for text in texts for line in text.splitlines()]


def _refusal(script: Script, why: str) -> Refused:
    return Refused(why, f"'{script.line}',", WHERE)


def strings(module: cst.Module | None, known: Mapping[str, str]) -> list[str]:
    """Return every string of a module that can be read off the source."""
    found: list[str] = []

    class Collect(cst.CSTVisitor):
        def on_visit(self, node: cst.CSTNode) -> bool:
            value = string(node, known) if isinstance(node, cst.BaseExpression) else None
            if value is not None:
                found.append(value)
            return value is None

    if module is not None:
        module.visit(Collect())
    return found


def setup_calls(module: cst.Module) -> list[cst.Call]:
    """Return the calls of setuptools' function, however it was imported."""
    names = {"setup"}
    found: list[cst.Call] = []

    class Collect(cst.CSTVisitor):
        def visit_ImportAlias(self, node: cst.ImportAlias) -> None:  # noqa: N802
            if node.evaluated_name == "setup" and node.evaluated_alias:
                names.add(node.evaluated_alias)

        def visit_Call(self, node: cst.Call) -> None:  # noqa: N802
            function = node.func
            called = function.attr if isinstance(function, cst.Attribute) else function
            if isinstance(called, cst.Name) and called.value in names:
                found.append(node)

    module.visit(Collect())
    return found


def _edit(module: cst.Module, call: cst.Call, script: Script, known: Mapping[str, str]) -> Change:
    """Return which node to replace by which, or why none can be."""
    given = next((a for a in call.args if a.keyword and a.keyword.value == "entry_points"), None)
    if given is not None:
        return _entry_points(given.value, script, known, module)
    if any(arg.star == "**" for arg in call.args):
        return "setup() gets its arguments from elsewhere (`**`)"
    return call, _with_argument(call, script, module)


def _named(name: cst.Name, module: cst.Module) -> cst.BaseExpression | str:
    """Return the value that a variable is given, if that happens in one place."""
    values = [value for one, value in assignments(module) if one == name.value]
    if len(values) == 1:
        return values[0]
    return f"`{name.value}` is not set in exactly one place"


def _with_argument(call: cst.Call, script: Script, module: cst.Module) -> cst.Call:
    """Return the call with `entry_points=` as a last argument, laid out like the others."""
    literals = [arg.value for arg in call.args]
    text = quoted(script.line, literals).value
    key = quoted(KEY, literals).value
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
    value: cst.BaseExpression, script: Script, known: Mapping[str, str], module: cst.Module
) -> Change:
    """Find the change to the value of `entry_points`."""
    match value:
        case cst.Name():
            named = _named(value, module)
            if isinstance(named, (str, cst.Name)):
                return str(named) if isinstance(named, str) else "the entry points are a variable"
            return _entry_points(named, script, known, module)
        case cst.Dict():
            return _in_dict(value, script, known, module)
        case cst.Call(func=cst.Name("dict")):
            for arg in value.args:
                if arg.keyword and arg.keyword.value == KEY:
                    return _scripts(arg.value, script, known, module)
        case cst.SimpleString():
            return _in_literal(value, lambda body: ini.add_entry(body, KEY, script))
    return "the entry points are not written out as a dictionary or a text"


def _in_dict(
    value: cst.Dict, script: Script, known: Mapping[str, str], module: cst.Module
) -> Change:
    for element in value.elements:
        if isinstance(element, cst.DictElement) and string(element.key, known) == KEY:
            return _scripts(element.value, script, known, module)
    if any(isinstance(element, cst.StarredDictElement) for element in value.elements):
        return "the entry points come from elsewhere (`**`)"
    keys = [e.key for e in value.elements if isinstance(e, cst.DictElement)]
    scripts = cst.List([cst.Element(quoted(script.line, keys))])
    return value, appended(value, cst.DictElement(quoted(KEY, keys), scripts))


def _scripts(
    value: cst.BaseExpression, script: Script, known: Mapping[str, str], module: cst.Module
) -> Change:
    """Find the change to the value of `console_scripts`."""
    match value:
        case cst.Name():
            named = _named(value, module)
            if isinstance(named, (str, cst.Name)):
                return str(named) if isinstance(named, str) else "the scripts are a variable"
            return _scripts(named, script, known, module)
        case cst.List() | cst.Tuple():
            return _in_list(value, script, known)
        case cst.SimpleString() if len(value.quote) == 3:
            return _in_literal(value, lambda body: ini.add_line(body, script))
        case cst.SimpleString():
            both = cst.List([cst.Element(value)])
            new = _in_list(both, script, known)
            return new if isinstance(new, str) else (value, new[1])
        case cst.BinaryOperation(operator=cst.Add()):
            for side in (value.left, value.right):
                if isinstance(side, (cst.List, cst.BinaryOperation)):
                    return _scripts(side, script, known, module)
    return "the console scripts are not written out as a list"


def _in_list(value: cst.List | cst.Tuple, script: Script, known: Mapping[str, str]) -> Change:
    values = [element.value for element in value.elements]
    for one in values:
        name, target = split(string(one, known) or "")
        if name == script.name:
            return taken(script, target, WHERE).why
    return value, appended(value, cst.Element(quoted(script.line, values)))


def _in_literal(value: cst.SimpleString, edit: ini.Edit) -> Change:
    """Find the change to a text of several lines."""
    if len(value.quote) != 3 or "\\" in value.value or "b" in value.prefix.lower():
        return "the entry points are a text with escapes or on one line"
    start = len(value.prefix) + 3
    new = edit(value.value[start:-3])
    if isinstance(new, Refused):
        return new.why
    return value, value.with_changes(value=value.value[:start] + new.text + value.value[-3:])
