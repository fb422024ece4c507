"""Adding a node to a Python launch file."""

from __future__ import annotations

from typing import NamedTuple

import libcst as cst

from idlc.check.package.setup_edits import WIDTH
from idlc.project.edits import Edited, Outcome, Refused
from idlc.scaffold.edits.python_text import (
    appended,
    constants,
    inner_indent,
    parsed,
    quoted,
    string,
)

WHERE = "to the launch description"
MODULE = "launch_ros.actions"


class Started(NamedTuple):
    """A node as a launch file starts it."""

    package: str
    executable: str
    lifecycle: bool = False

    @property
    def action(self) -> str:
        """The class of launch_ros that starts it."""
        return "LifecycleNode" if self.lifecycle else "Node"

    @property
    def words(self) -> dict[str, str]:
        """The keyword arguments of the class."""
        words = {"package": self.package, "executable": self.executable, "output": "screen"}
        if self.lifecycle:  # these have no defaults
            words |= {"name": self.executable, "namespace": ""}
        return words

    @property
    def line(self) -> str:
        """The line for a list of nodes."""
        arguments = ", ".join(f"{name}='{word}'" for name, word in self.words.items())
        return f"{self.action}({arguments}),"


def add_node(text: str, node: Started) -> Outcome:
    """Return the file with another node in its only LaunchDescription.

    Its nodes are the list that constructs it, or are added to it one by one.
    """
    module = parsed(text)
    if module is None:
        return Refused("this is not valid Python", node.line, WHERE)
    calls = _calls(module)
    strings = constants(module)
    for call in (*calls["Node"], *calls["LifecycleNode"]):
        arguments = {a.keyword.value: string(a.value, strings) for a in call.args if a.keyword}
        if arguments.get("executable") == node.executable and arguments.get("package") in (
            node.package,
            None,
        ):
            return Edited(text)
    imported = _imported(module, node.action)
    if imported is None:
        return Refused(f"`{node.action}` is something else in this file", node.line, WHERE)
    called = imported or node.action
    descriptions = calls["LaunchDescription"]
    changed = _edited(module, descriptions[0], node, called) if len(descriptions) == 1 else None
    if changed is None:
        return Refused("its nodes are not written out in one place", node.line, WHERE)
    return Edited(changed.code if imported else _with_import(changed, node.action))


def _edited(
    module: cst.Module, description: cst.Call, node: Started, called: str
) -> cst.Module | None:
    """Return the module with the node in the description's list, or added to it before the end."""
    listed = _list(description)
    if listed is None and description.args:
        return None
    literals = _literals(listed, module)
    if listed is not None:
        new = cst.parse_expression(_node_call(called, node, literals, inner_indent(listed), ","))
        changed = module.deep_replace(listed, appended(listed, cst.Element(new)))
    else:
        changed = module.visit(_Adding(description, node, called, literals, module))
    assert isinstance(changed, cst.Module)
    return changed if not changed.deep_equals(module) else None


class _Adding(cst.CSTTransformer):
    """Adds a node by a statement before the one that returns the description."""

    def __init__(
        self,
        description: cst.Call,
        node: Started,
        called: str,
        literals: list[cst.BaseExpression],
        module: cst.Module,
    ) -> None:
        self._description = description
        self._node = node
        self._called = called
        self._literals = literals
        self._config = module.config_for_parsing

    def leave_FunctionDef(  # noqa: N802
        self, original_node: cst.FunctionDef, updated_node: cst.FunctionDef
    ) -> cst.FunctionDef:
        """Add the statement to the function that makes the description and returns it."""
        statements = updated_node.body.body
        name = next(filter(None, map(self._name, original_node.body.body)), None)
        if name is None or not statements or not _returns(statements[-1], name):
            return updated_node
        new = _node_call(self._called, self._node, self._literals, "", ")")
        line = cst.parse_statement(f"{name}.add_action({new})\n", config=self._config)
        body = updated_node.body.with_changes(body=[*statements[:-1], line, statements[-1]])
        return updated_node.with_changes(body=body)

    def _name(self, statement: cst.CSTNode) -> str | None:
        """Return the variable that a statement assigns the description to."""
        for small in statement.body if isinstance(statement, cst.SimpleStatementLine) else ():
            if isinstance(small, cst.Assign) and small.value is self._description:
                target = small.targets[0].target
                return target.value if isinstance(target, cst.Name) else None
        return None


def _returns(statement: cst.CSTNode, name: str) -> bool:
    match statement:
        case cst.SimpleStatementLine(body=[cst.Return(value=cst.Name(value=returned))]):
            return returned == name
    return False


def _literals(listed: cst.List | None, module: cst.Module) -> list[cst.BaseExpression]:
    """Return values whose style of quotes is to be used."""
    calls = _calls(module)["Node"]
    if listed is not None:
        calls = [e.value for e in listed.elements if isinstance(e.value, cst.Call)]
    return [arg.value for call in calls for arg in call.args]


def _node_call(
    function: str, node: Started, like: list[cst.BaseExpression], margin: str, tail: str
) -> str:
    """Return the call that starts the node, in the quotes of others, in a function's block."""
    arguments = [f"{name}={quoted(word, like).value}" for name, word in node.words.items()]
    line = f"{function}({', '.join(arguments)})"
    head = "" if tail == "," else " " * len("description.add_action(")
    if len(f"    {margin}{head}{line}{tail}") > WIDTH:
        lines = "".join(f"{margin}    {argument},\n" for argument in arguments)
        line = f"{function}(\n{lines}{margin})"
    return line


def _calls(module: cst.Module) -> dict[str, list[cst.Call]]:
    calls: dict[str, list[cst.Call]] = {"Node": [], "LifecycleNode": [], "LaunchDescription": []}

    class LaunchCalls(cst.CSTVisitor):
        def visit_Call(self, node: cst.Call) -> None:  # noqa: N802
            called = node.func.attr if isinstance(node.func, cst.Attribute) else node.func
            if isinstance(called, cst.Name) and called.value in calls:
                calls[called.value].append(node)

    module.visit(LaunchCalls())
    return calls


def _list(call: cst.Call) -> cst.List | None:
    """Return the list that a LaunchDescription is made from."""
    if len(call.args) == 1 and isinstance(call.args[0].value, cst.List):
        return call.args[0].value
    return None


def _imported(module: cst.Module, action: str) -> str | None:
    """Return the local name of a class of launch_ros; empty if not imported, `None` if taken."""
    for statement in module.body:
        for small in statement.body if isinstance(statement, cst.SimpleStatementLine) else ():
            if isinstance(small, cst.ImportFrom) and not isinstance(small.names, cst.ImportStar):
                source = module.code_for_node(small.module) if small.module else ""
                for alias in small.names:
                    name = alias.evaluated_alias or alias.evaluated_name
                    if alias.evaluated_name == action and source == MODULE:
                        return name
                    if name == action:
                        return None
            elif isinstance(small, cst.Import):
                for alias in small.names:
                    if alias.evaluated_name == MODULE:
                        return f"{alias.evaluated_alias or MODULE}.{action}"
    return ""


def _with_import(module: cst.Module, action: str) -> str:
    """Return the source with a class of launch_ros imported after the last import at the top."""
    at = 0
    for statement in module.body:
        for small in statement.body if isinstance(statement, cst.SimpleStatementLine) else ():
            if isinstance(small, cst.ImportFrom) and _extensible(small, module):
                changed = module.deep_replace(small, _extended(small, action))
                assert isinstance(changed, cst.Module)
                return changed.code
    for number, statement in enumerate(module.body):
        if isinstance(statement, cst.SimpleStatementLine) and any(
            isinstance(small, (cst.Import, cst.ImportFrom)) for small in statement.body
        ):
            at = number + 1
    new = cst.parse_statement(f"from {MODULE} import {action}\n", config=module.config_for_parsing)
    return module.with_changes(body=[*module.body[:at], new, *module.body[at:]]).code


def _extensible(statement: cst.ImportFrom, module: cst.Module) -> bool:
    """Return whether another class can be imported by a statement, which is on one line."""
    source = module.code_for_node(statement.module) if statement.module else ""
    return source == MODULE and statement.lpar is None and bool(_aliases(statement))


def _aliases(statement: cst.ImportFrom) -> list[cst.ImportAlias]:
    return [] if isinstance(statement.names, cst.ImportStar) else list(statement.names)


def _extended(statement: cst.ImportFrom, action: str) -> cst.ImportFrom:
    """Return an import of another name, in the order of names."""
    names = [*_aliases(statement), cst.ImportAlias(cst.Name(action))]
    names.sort(key=lambda alias: alias.evaluated_name.lower())
    comma = cst.Comma(whitespace_after=cst.SimpleWhitespace(" "))
    plain = [alias.with_changes(comma=comma) for alias in names[:-1]]
    last = names[-1].with_changes(comma=cst.MaybeSentinel.DEFAULT)
    return statement.with_changes(names=[*plain, last])
