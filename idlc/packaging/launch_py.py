"""Adding a node to a Python launch file."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from typing import NamedTuple

from idlc.diagnostics.report import Edit, apply
from idlc.diagnostics.source import Source
from idlc.packaging import setup_edits
from idlc.packaging.files import Edited, Outcome, Refused
from idlc.packaging.setup_py import Setup, parse, range_of

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
    def arguments(self) -> list[str]:
        """The keyword arguments of the class."""
        words = {"package": self.package, "executable": self.executable, "output": "screen"}
        if self.lifecycle:  # these have no defaults
            words |= {"name": self.executable, "namespace": ""}
        return [f"{name}='{word}'" for name, word in words.items()]

    @property
    def line(self) -> str:
        """The line for a list of nodes."""
        return f"{self.action}({', '.join(self.arguments)}),"


def add_node(text: str, node: Started) -> Outcome:
    """Return the file with another node in its only LaunchDescription.

    Its nodes are the list that constructs it, or are added to it one by one.
    """
    if parse(text) is None:
        return Refused("this is not valid Python", node.line, WHERE)
    file = Setup(Source("launch.py", text))
    for call in (*file.calls_of("Node"), *file.calls_of("LifecycleNode")):
        arguments = {passed.arg: file.text(passed.value) for passed in call.keywords}
        is_same = arguments.get("executable") == node.executable
        if is_same and arguments.get("package") in (node.package, None):
            return Edited(text)
    imported = _imported(file, node.action)
    if imported is None:
        return Refused(f"`{node.action}` has a different meaning in this file", node.line, WHERE)
    called, imports = imported
    edits: tuple[Edit, ...] = ()
    match [*file.calls_of("LaunchDescription")]:
        case [ast.Call(args=[ast.List() as listed], keywords=[])]:
            margin = setup_edits.margin_of(file.source, listed)
            before = margin if setup_edits.is_spread(file.source, listed) else "    "
            new = _call(called, node, margin, before, ",")
            edits = setup_edits.append_element(file.source, listed, new)
        case [ast.Call(args=[], keywords=[]) as description]:
            edits = tuple(_additions(file, description, node, called))
    if not edits:
        return Refused("its nodes are not in one literal list", node.line, WHERE)
    return Edited(apply(text, (*imports, *edits))[0])


def _additions(file: Setup, description: ast.Call, node: Started, called: str) -> Iterator[Edit]:
    """Yield the statement that adds a node before a function returns its description."""
    for function in file.nodes:
        match function:
            case ast.FunctionDef(body=[*body, ast.Return(value=ast.Name(id=returned)) as end]):
                is_named = any(_names(statement, description, returned) for statement in body)
                if not is_named or (body[-1].end_lineno or 0) >= end.lineno:
                    continue
                margin = setup_edits.indent_of(file.source, range_of(file.source, end)[0])
                nodes = next(file.calls_of("Node"), None)
                quote = setup_edits.quote_of(file.source, nodes) if nodes else "'"
                before = f"{margin}{returned}.add_action("
                new = _call(called, node, margin, before, ")").replace("'", quote)
                at = _line_end(file.source, body[-1])
                yield setup_edits.insertion(file.source, at, f"\n{before}{new})")


def _names(statement: ast.stmt, description: ast.Call, name: str) -> bool:
    """Return whether a statement assigns the description to a variable."""
    match statement:
        case ast.Assign(targets=[ast.Name(id=assigned), *_], value=value):
            return value is description and assigned == name
    return False


def _line_end(source: Source, node: ast.AST) -> int:
    """Return the end of the line on which a node ends."""
    end = range_of(source, node)[1]
    match = re.compile(r"[^\r\n]*").match(source.text, end)
    return match.end() if match else end


def _call(function: str, node: Started, margin: str, before: str, tail: str) -> str:
    """Return the code that starts the node, which stands between others on its line."""
    line = f"{function}({', '.join(node.arguments)})"
    if len(before + line + tail) > setup_edits.WIDTH:
        lines = "".join(f"{margin}    {argument},\n" for argument in node.arguments)
        line = f"{function}(\n{lines}{margin})"
    return line


def _imported(file: Setup, action: str) -> tuple[str, tuple[Edit, ...]] | None:
    """Return the name of a class of launch_ros, and the edit that imports it if need be.

    `None` if its name is taken.
    """
    imports = [node for node in file.tree.body if isinstance(node, (ast.Import, ast.ImportFrom))]
    for statement in imports:
        for alias in statement.names:
            if isinstance(statement, ast.Import):
                if alias.name == MODULE:
                    return f"{alias.asname or MODULE}.{action}", ()
            elif (statement.module, alias.name) == (MODULE, action):
                return alias.asname or action, ()
            elif action == (alias.asname or alias.name):
                return None
    for statement in imports:
        if isinstance(statement, ast.ImportFrom) and statement.module == MODULE:
            code = file.source.text[slice(*range_of(file.source, statement))]
            if code[-1] not in "*)":
                return action, (setup_edits.added_name(file.source, statement, action),)
    new = f"from {MODULE} import {action}"
    if not imports:
        start = range_of(file.source, file.tree)[0]
        return action, (setup_edits.insertion(file.source, start, f"{new}\n"),)
    last: ast.stmt = imports[-1]
    for following in file.tree.body:
        last = following if following.lineno == last.end_lineno else last
    return action, (setup_edits.insertion(file.source, _line_end(file.source, last), f"\n{new}"),)
