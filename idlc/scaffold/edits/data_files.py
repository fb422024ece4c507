"""Adding files and folders of modules to the ones that a setup.py installs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import libcst as cst

from idlc.check.package.installation import wiring
from idlc.diagnostics.report import apply
from idlc.diagnostics.source import Source
from idlc.project.edits import Edited, Outcome, Refused
from idlc.scaffold.edits.python_text import appended, constants, parsed, quoted
from idlc.scaffold.edits.setup_py import setup_calls, setup_strings

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
    problems = wiring(Source("setup.py", text), package, {key: key for key in keys}, folders)
    return apply(text, (edit for problem in problems for edit in problem.edits))[0]


def _keyword_values(calls: Iterable[cst.Call], keyword: str) -> list[cst.BaseExpression]:
    """Return the values of a keyword argument in calls."""
    arguments = (arg for call in calls for arg in call.args)
    return [arg.value for arg in arguments if arg.keyword and arg.keyword.value == keyword]


def _literals(value: cst.BaseExpression) -> list[cst.BaseExpression]:
    if isinstance(value, cst.Tuple):
        return [element.value for element in value.elements]
    return []
