"""Adding files and folders of modules to what a setup.py installs."""

from __future__ import annotations

from collections.abc import Iterable

import libcst as cst

from idlc.checks.package.libraries import edits_for
from idlc.diagnostics.edits import apply
from idlc.diagnostics.source import Source
from idlc.scaffold.edits.outcome import Edited, Outcome, Refused
from idlc.scaffold.edits.python_text import appended, constants, parsed, quoted, string
from idlc.scaffold.edits.setup_py import setup_calls, strings

WHERE = "to `data_files` in the call of setup()"


def add_launch(text: str, package: str, path: str) -> Outcome:
    """Return a setup.py that installs a launch file.

    One that names `launch` anywhere does so already; one without `data_files` installs none.
    """
    line = f"('share/{package}/launch', ['{path}']),"
    module = parsed(text)
    if module is None:
        return Refused("this is not valid Python", line, WHERE)
    if any("launch" in one for one in strings(module, constants(module))):
        return Edited(text)
    calls = setup_calls(module)
    given = _given(calls, "data_files")
    if not given:
        return Edited(text)
    listed = [value for value in given if isinstance(value, cst.List)]
    if len(calls) != 1 or len(listed) != 1:
        return Refused("the data files are not written out as a list", line, WHERE)
    like = [part for element in listed[0].elements for part in _literals(element.value)]
    folder, file = (quoted(one, like).value for one in (f"share/{package}/launch", path))
    new = cst.Element(cst.parse_expression(f"({folder}, [{file}])"))
    changed = module.deep_replace(listed[0], appended(listed[0], new))
    assert isinstance(changed, cst.Module)
    return Edited(changed.code)


def add_libraries(text: str) -> str:
    """Return a setup.py that makes and installs libraries for C++ tools, if it can be told to."""
    return apply(text, edits_for(Source("setup.py", text)))[0]


def add_packages(text: str, names: Iterable[str]) -> Outcome:
    """Return a setup.py that installs packages, where it lists those that it installs."""
    module = parsed(text)
    given = _given(setup_calls(module), "packages") if module else []
    if module is None or len(given) != 1 or not isinstance(given[0], cst.List):
        return Edited(text)
    known = constants(module)
    listed: cst.BaseExpression = given[0]
    present = [string(element.value, known) for element in given[0].elements]
    for name in names:
        if name not in present and None not in present:
            assert isinstance(listed, cst.List)
            literal = quoted(name, [element.value for element in listed.elements])
            listed = appended(listed, cst.Element(literal))
    changed = module.deep_replace(given[0], listed)
    assert isinstance(changed, cst.Module)
    return Edited(changed.code)


def _given(calls: Iterable[cst.Call], keyword: str) -> list[cst.BaseExpression]:
    """Return what calls are given by a keyword."""
    arguments = (arg for call in calls for arg in call.args)
    return [arg.value for arg in arguments if arg.keyword and arg.keyword.value == keyword]


def _literals(value: cst.BaseExpression) -> list[cst.BaseExpression]:
    if isinstance(value, cst.Tuple):
        return [element.value for element in value.elements]
    return []
