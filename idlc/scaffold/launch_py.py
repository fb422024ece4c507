"""Adding a node to a Python launch file."""

from __future__ import annotations

import libcst as cst

from idlc.scaffold.edit import Edited, Outcome, Refused
from idlc.scaffold.layout import WIDTH
from idlc.scaffold.python_text import (
    appended,
    constants,
    inner_indent,
    parsed,
    quoted,
    string,
)

WHERE = "to the list that `LaunchDescription` gets"
MODULE = "launch_ros.actions"


def add_node(text: str, package: str, executable: str) -> Outcome:
    """Return the file with a node more in the list of its only LaunchDescription."""
    line = f"Node(package='{package}', executable='{executable}', output='screen'),"
    module = parsed(text)
    if module is None:
        return Refused("this is not valid Python", line, WHERE)
    calls = _calls(module)
    known = constants(module)
    for call in calls["Node"]:
        given = {a.keyword.value: string(a.value, known) for a in call.args if a.keyword}
        if given.get("executable") == executable and given.get("package") in (package, None):
            return Edited(text)
    descriptions = [_list(call) for call in calls["LaunchDescription"]]
    if len(descriptions) != 1 or descriptions[0] is None:
        return Refused("the nodes are not written out in one list", line, WHERE)
    imported = _imported(module)
    if imported is None:
        return Refused("`Node` is something else in this file", line, WHERE)
    listed = descriptions[0]
    literals = [
        arg.value
        for element in listed.elements
        if isinstance(element.value, cst.Call)
        for arg in element.value.args
    ]
    new = _node_call(imported or "Node", package, executable, literals, inner_indent(listed))
    changed = module.deep_replace(listed, appended(listed, cst.Element(new)))
    assert isinstance(changed, cst.Module)
    result = changed.code if imported else _with_import(changed)
    return Edited(result)


def _node_call(
    function: str, package: str, executable: str, like: list[cst.BaseExpression], margin: str
) -> cst.BaseExpression:
    """Return the call of Node, in the quotes of the others, within a function: indented once."""
    words = {"package": package, "executable": executable, "output": "screen"}
    given = [f"{name}={quoted(word, like).value}" for name, word in words.items()]
    line = f"{function}({', '.join(given)})"
    if len(f"    {margin}{line},") > WIDTH:
        lines = "".join(f"{margin}    {one},\n" for one in given)
        line = f"{function}(\n{lines}{margin})"
    return cst.parse_expression(line)


def _calls(module: cst.Module) -> dict[str, list[cst.Call]]:
    found: dict[str, list[cst.Call]] = {"Node": [], "LaunchDescription": []}

    class Collect(cst.CSTVisitor):
        def visit_Call(self, node: cst.Call) -> None:  # noqa: N802
            called = node.func.attr if isinstance(node.func, cst.Attribute) else node.func
            if isinstance(called, cst.Name) and called.value in found:
                found[called.value].append(node)

    module.visit(Collect())
    return found


def _list(call: cst.Call) -> cst.List | None:
    """Return the list that a LaunchDescription is made from."""
    if len(call.args) == 1 and isinstance(call.args[0].value, cst.List):
        return call.args[0].value
    return None


def _imported(module: cst.Module) -> str | None:
    """Return how launch_ros' Node is called here; empty if it is not imported, `None` if taken."""
    for statement in module.body:
        for small in statement.body if isinstance(statement, cst.SimpleStatementLine) else ():
            if isinstance(small, cst.ImportFrom) and not isinstance(small.names, cst.ImportStar):
                source = module.code_for_node(small.module) if small.module else ""
                for alias in small.names:
                    name = alias.evaluated_alias or alias.evaluated_name
                    if alias.evaluated_name == "Node" and source == MODULE:
                        return name
                    if name == "Node":
                        return None
            elif isinstance(small, cst.Import):
                for alias in small.names:
                    if alias.evaluated_name == MODULE:
                        return f"{alias.evaluated_alias or MODULE}.Node"
    return ""


def _with_import(module: cst.Module) -> str:
    """Return the source with Node imported after the last import at the top."""
    at = 0
    for number, statement in enumerate(module.body):
        if isinstance(statement, cst.SimpleStatementLine) and any(
            isinstance(small, (cst.Import, cst.ImportFrom)) for small in statement.body
        ):
            at = number + 1
    new = cst.parse_statement(f"from {MODULE} import Node\n", config=module.config_for_parsing)
    return module.with_changes(body=[*module.body[:at], new, *module.body[at:]]).code
